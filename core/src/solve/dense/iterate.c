/* One iteration: the quadratic program completed, solved, and expanded to a plan. */
#ifndef RUMO_ITERATE_C
#define RUMO_ITERATE_C

#include "controller.h"
#include "guard/follow.c"
#include "stages/linearise.c"
#include "stages/inner.c"
#include "solve/active_set/qp.c"
#include "solve/dense/condense.c"

/* A constraint counts as violated above this share of its scale. */
#define SLACK_TOLERANCE 1e-6
/* Steps below this share of the inputs' ranges are rounding. */
#define NO_STEP 1e-12

static inline double entry(const rumo_controller *ctl, const sparse *matrix, int e, int k) {
    return ctl->terms[(ptrdiff_t)(matrix->first + e) * ctl->s.lanes + k];
}

/* An output or constraint of stage k at (dx, du), as linearised, less what is wanted or allowed. */
static inline double linearised(const rumo_controller *ctl, int value, int r, const sparse *of_x, const sparse *of_u, int k,
                                const double *dx, const double *du, double less) {
    double y = ctl->terms[(ptrdiff_t)(value + r) * ctl->s.lanes + k] - less;
    for (int e = of_x->start[r]; e < of_x->start[r + 1]; ++e) y += entry(ctl, of_x, e, k) * dx[of_x->column[e]];
    if (du)
        for (int e = of_u->start[r]; e < of_u->start[r + 1]; ++e) y += entry(ctl, of_u, e, k) * du[of_u->column[e]];
    return y;
}

/* Gradient and limits of the QP, now that measurement and reference are known. */
static void set_up_qp(rumo_controller *ctl, const double *x, const double *reference) {
    const dims s = dims_of(&ctl->problem.sizes);
    const rumo_problem *p = &ctl->problem;
    const rumo_numbers *numbers = &p->numbers;
    qp *q = &ctl->q;
    const double *last = last_decided(&ctl->guard), *u = ctl->guess_values;
    /* What happens if the inputs stay with the guess from the first free one on. */
    for (int r = 0; r < s.nx; ++r) ctl->dx[r] = x[r] - ctl->guess_x[r];
    for (int i = 0; i < s.d * s.nu; ++i) ctl->du[i] = ctl->guard.applied[i] - ctl->guess_u[i];
    for (int k = s.d; !unblocked(&s) && k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j)
            ctl->du[k * s.nu + j] = blocked_input(&s, &ctl->condensed.held, last, u, k, j) - ctl->guess_u[k * s.nu + j];
    zero(ctl->gradient, s.ld);
    for (int k = 0; k < s.N; ++k) {
        double *dx = ctl->dx + (ptrdiff_t)(k + 1) * s.ldx;
        const double *du = k < s.d || !unblocked(&s) ? ctl->du + k * s.nu : NULL;
        advance(&s, ctl->condensed.stages + (ptrdiff_t)k * s.width * s.ldx, dx - s.ldx, du, dx);
        for (int r = 0; r < s.nc; ++r) {
            const int i = k * s.nc + r;
            ctl->constraints[i] = linearised(ctl, p->G_first, r, &ctl->D, &ctl->E, k, dx, du, numbers->constraint_limits[i]);
            q->upper[q->dense + i] = ctl->imposed_now[i] ? -ctl->constraints[i] : INFINITY;
        }
        if (k < s.d) continue;
        for (int r = 0; r < s.ny; ++r) {
            const int i = k * s.ny + r;
            const double error = linearised(ctl, p->y_first, r, &ctl->Cx, &ctl->Cu, k, dx, du, 0.0) - reference[(k + 1) * s.ny + r];
            axpy(ctl->gradient, ctl->condensed.root_weights[i] * error, ctl->condensed.outputs + (ptrdiff_t)i * s.ld, padded(inputs_at(&s, &ctl->condensed.held, k)));
        }
    }
    for (int i = 0; i < s.n; ++i) {
        const int j = i % s.nu;
        const double scale = numbers->input_scales[j], move = u[i] - (i < s.nu ? last[j] : u[i - s.nu]);
        const double slope = 2.0 * numbers->move_weights[i] * move * scale;
        ctl->gradient[i] += slope;
        if (i >= s.nu) ctl->gradient[i - s.nu] -= slope;
        q->lower[i] = (ctl->free_lower[i] - u[i]) / scale;
        q->upper[i] = (ctl->free_upper[i] - u[i]) / scale;
        if (!q->band) continue;
        q->lower[s.n + i] = (numbers->block_lower[i] - move) / scale;
        q->upper[s.n + i] = (numbers->block_upper[i] - move) / scale;
    }
    watch_members(q);
}

/* Cost of v and of its violation of soft rows; *violation is the largest of hard ones, in units of the ranges. */
RARE static double merit(const rumo_controller *ctl, const double *v, double *violation) {
    const qp *q = &ctl->q;
    double cost = 0.0;
    *violation = 0.0;
    for (int i = 0; i < q->n; ++i) {
        double sum = 0.5 * q->hessian[(ptrdiff_t)i * q->ld + i] * v[i];
        for (int j = i + 1; j < q->n; ++j) sum += q->hessian[(ptrdiff_t)i * q->ld + j] * v[j];
        cost += v[i] * (sum + ctl->gradient[i]);
    }
    for (int r = q->dense; r < q->rows; ++r) {
        const double over = dot(q->matrix + (ptrdiff_t)(r - q->dense) * q->ld, v, q->extent[r - q->dense]) - q->upper[r];
        if (!(over > 0.0)) continue;
        if (isinf(q->l1[r])) *violation = fmax(*violation, over * q->weight[r]);
        else cost += over * (q->l1[r] + q->l2[r] * over);
    }
    return cost;
}

/* Put v within bounds and move bounds. */
static void clip_deviations(const rumo_controller *ctl, double *v) {
    const dims *s = &ctl->s;
    double *u = plan_u(ctl) + s->d * s->nu;
    const double *guess = ctl->guess_values, *scale = ctl->problem.numbers.input_scales;
    for (int i = 0; i < s->n; ++i) u[i] = guess[i] + scale[i % s->nu] * v[i];
    make_admissible(s->nu, last_decided(&ctl->guard), ctl->free_lower, ctl->free_upper, ctl->problem.numbers.block_lower,
                    ctl->problem.numbers.block_upper, s->nu, u, s->nb);
    for (int i = 0; i < s->n; ++i) v[i] = (u[i] - guess[i]) / scale[i % s->nu];
}

/* When the budget has run out: the better of where the solver stands and the guess, both made admissible. */
RARE static void choose_best(rumo_controller *ctl) {
    double beyond, beyond_guess;
    copy(ctl->best, ctl->q.v, ctl->s.ld);
    zero(ctl->other, ctl->s.ld);
    clip_deviations(ctl, ctl->best);
    clip_deviations(ctl, ctl->other);
    const double cost = merit(ctl, ctl->best, &beyond), cost_guess = merit(ctl, ctl->other, &beyond_guess);
    const int worse = fabs(beyond - beyond_guess) > SLACK_TOLERANCE ? beyond > beyond_guess : !(cost <= cost_guess);
    copy(ctl->q.v, worse ? ctl->other : ctl->best, ctl->s.ld);
    update_values(&ctl->q);
}

/* Inputs, states and constraints of the QP's solution; returns the status it deserves. */
static rumo_status expand(rumo_controller *ctl, const double *x, rumo_status status) {
    const dims s = dims_of(&ctl->problem.sizes);
    const double *scale = ctl->problem.numbers.input_scales;
    double *u = plan_u(ctl), *states = plan_x(ctl), *constraints = plan_constraints(ctl);
    for (int i = 0; unblocked(&s) && i < s.n; ++i) ctl->du[s.d * s.nu + i] = scale[i % s.nu] * ctl->q.v[i];
    for (int k = s.d; !unblocked(&s) && k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j)
            ctl->du[k * s.nu + j] += scale[j] * blocked_input(&s, &ctl->condensed.held, ctl->zeros, ctl->q.v, k, j);
    for (int i = 0; i < s.N * s.nu; ++i) u[i] = ctl->guess_u[i] + ctl->du[i];
    copy(states, x, s.nx);
    int violated = 0, usable = 1;
    for (int k = 0; k < s.N; ++k) {
        double *dx = ctl->dx + (ptrdiff_t)(k + 1) * s.ldx;
        if (k >= s.d)
            advance(&s, ctl->condensed.stages + (ptrdiff_t)k * s.width * s.ldx, dx - s.ldx, ctl->du + k * s.nu, dx);
        for (int r = 0; r < s.nx; ++r) states[(k + 1) * s.nx + r] = ctl->guess_x[(k + 1) * s.nx + r] + dx[r];
        for (int r = 0; r < s.nc; ++r) {
            const int i = k * s.nc + r;
            constraints[i] = ctl->constraints[i] + (k < s.d ? 0.0 : ctl->q.value[ctl->q.dense + i]);
            violated |= constraints[i] > SLACK_TOLERANCE * ctl->problem.numbers.constraint_scales[r] && ctl->problem.imposed[i];
            usable &= constraints[i] < INFINITY; /* below an infinite limit it is infinite itself */
        }
    }
    expand_inner(ctl);
    if (!usable || !all_finite(ctl->numbers, s.N * s.nu + (s.N + 1) * s.nx)) return RUMO_SOLVER_FAILED;
    if (!all_finite(ctl->inner, s.ni * s.lanes)) return RUMO_SOLVER_FAILED;
    return status == RUMO_OPTIMAL && violated ? RUMO_SOFT_VIOLATED : status;
}

/* How far the iteration has come. At the solution g + H v + A' mu = 0: the slope at the guess is known without H. */
static void diagnose(rumo_controller *ctl, rumo_status status) {
    const dims s = dims_of(&ctl->problem.sizes);
    const qp *q = &ctl->q;
    double *d = plan_diagnostics(ctl), *slope = ctl->other;
    const double size = largest_size(q->v, s.ld);
    d[RUMO_INTEGRATOR_RESIDUAL] = ctl->straying;
    d[RUMO_STEP] = size;
    d[RUMO_CONTRACTION] = ctl->last_step > NO_STEP ? size / ctl->last_step : NAN;
    d[RUMO_KKT_RESIDUAL] = NAN;
    ctl->last_step = size;
    if (status == RUMO_BUDGET_EXCEEDED) return; /* v is not the solver's */
    copy(slope, ctl->gradient, s.ld);
    for (int i = 0; i < q->count; ++i) add_row(q, q->member[i], q->mu[i], slope);
    if (q->saturated) add_saturated(q, slope);
    d[RUMO_KKT_RESIDUAL] = largest_size(slope, s.ld);
}

/* One QP about a prepared guess; SOLVER_FAILED leaves no plan. */
static rumo_status iterate(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan) {
    const qp_limits limits = {ctl->settings.qp_iterations, ctl->settings.qp_tolerance, ctl->settings.qp_seconds};
    set_up_qp(ctl, x, reference);
    const rumo_status status = solve_qp(&ctl->q, ctl->gradient, &limits);
    plan->iterations += ctl->q.iterations;
    plan->conflicts = ctl->q.conflicts;
    if (status == RUMO_SOLVER_FAILED) return status;
    if (status == RUMO_BUDGET_EXCEEDED) choose_best(ctl);
    diagnose(ctl, status);
    return expand(ctl, x, status);
}

static int is_solved(rumo_status status) { return status == RUMO_OPTIMAL || status == RUMO_SOFT_VIOLATED; }

/* Largest change of an input over its range, or of a state over the reach of the inputs, from guess to plan. */
static double change(const rumo_controller *ctl) {
    const dims *s = &ctl->s;
    double largest = 0.0;
    for (int i = 0; i < s->N * s->nu; ++i)
        largest = fmax(largest, fabs(plan_u(ctl)[i] - ctl->guess_u[i]) / ctl->problem.numbers.input_scales[i % s->nu]);
    for (int i = 0; i < (s->N + 1) * s->nx; ++i)
        if (ctl->condensed.reach[i % s->nx] > 0.0)
            largest = fmax(largest, fabs(plan_x(ctl)[i] - ctl->guess_x[i]) / ctl->condensed.reach[i % s->nx]);
    return largest;
}

#endif
