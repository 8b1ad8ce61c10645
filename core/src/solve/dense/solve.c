/* The dense solver's part once the measurement is known: the quadratic program completed, solved, and expanded. */
#ifndef RUMO_SOLVE_C
#define RUMO_SOLVE_C

#include "base/admissible.h"
#include "solve/active_set/qp.c"
#include "solve/dense/dense.h"
#include "stages/along.c"
/* Gradient and limits of the QP, now that measurement and reference are known. */
static WITHIN void set_up_qp(dense *d, const stage_maps *m, const stage_known *known, stage_step *step) {
    const rumo_problem *p = d->problem;
    const dims s = dims_of(&p->sizes);
    const condensed *h = &d->condensed;
    const rumo_numbers *numbers = &p->numbers;
    qp *q = &d->q;
    const double *last = known->decided + (decided_inputs(&s) - 1) * s.nu, *u = m->guess_values;
    /* What happens if the inputs stay with the guess from the first free one on. */
    for (int r = 0; r < s.nx; ++r) step->dx[r] = known->x[r] - m->guess_x[r];
    for (int i = 0; i < s.d * s.nu; ++i) step->du[i] = known->decided[i] - m->guess_u[i];
    for (int k = s.d; !unblocked(&s) && k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j)
            step->du[k * s.nu + j] = blocked_input(&s, &h->held, last, u, k, j) - m->guess_u[k * s.nu + j];
    zero(d->gradient, s.ld);
    for (int k = 0; k < s.N; ++k) {
        double *dx = step->dx + (ptrdiff_t)(k + 1) * s.ldx;
        const double *du = k < s.d || !unblocked(&s) ? step->du + k * s.nu : NULL;
        advance_stage(m, &s, h->stages, k, dx - s.ldx, du, dx);
        for (int r = 0; r < s.nc; ++r) {
            const int i = k * s.nc + r;
            d->constraints[i] =
                linearised(m, p->G_first, r, &m->D, &m->E, k, dx, du, numbers->constraint_limits[i]);
            q->upper[q->dense + i] = d->imposed_now[i] ? -d->constraints[i] : INFINITY;
        }
        if (k < s.d) continue;
        for (int r = 0; r < s.ny; ++r) {
            const int i = k * s.ny + r;
            const double error =
                linearised(m, p->y_first, r, &m->Cx, &m->Cu, k, dx, du, 0.0) - known->reference[(k + 1) * s.ny + r];
            axpy(d->gradient, h->root_weights[i] * error, h->outputs + (ptrdiff_t)i * s.ld,
                 padded(inputs_at(&s, &h->held, k)));
        }
    }
    for (int i = 0; i < s.n; ++i) {
        const int j = i % s.nu;
        const double scale = numbers->input_scales[j], move = u[i] - (i < s.nu ? last[j] : u[i - s.nu]);
        const double slope = 2.0 * numbers->move_weights[i] * move * scale;
        d->gradient[i] += slope;
        if (i >= s.nu) d->gradient[i - s.nu] -= slope;
        q->lower[i] = (d->free_lower[i] - u[i]) / scale;
        q->upper[i] = (d->free_upper[i] - u[i]) / scale;
        if (!q->band) continue;
        q->lower[s.n + i] = (numbers->block_lower[i] - move) / scale;
        q->upper[s.n + i] = (numbers->block_upper[i] - move) / scale;
    }
    watch_members(q);
}

/* Cost of v and of its violation of soft rows; *violation is the largest of hard ones, in units of the ranges. */
RARE static double merit(const dense *d, const double *v, double *violation) {
    const qp *q = &d->q;
    double cost = 0.0;
    *violation = 0.0;
    for (int i = 0; i < q->n; ++i) {
        double sum = 0.5 * q->hessian[(ptrdiff_t)i * q->ld + i] * v[i];
        for (int j = i + 1; j < q->n; ++j) sum += q->hessian[(ptrdiff_t)i * q->ld + j] * v[j];
        cost += v[i] * (sum + d->gradient[i]);
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
static void clip_deviations(const dense *d, const double *guess, const double *last, double *v) {
    const dims *s = &d->s;
    const rumo_numbers *numbers = &d->problem->numbers;
    const double *scale = numbers->input_scales;
    double *u = d->inputs;
    for (int i = 0; i < s->n; ++i) u[i] = guess[i] + scale[i % s->nu] * v[i];
    make_admissible(s->nu, last, d->free_lower, d->free_upper, numbers->block_lower, numbers->block_upper, s->nu, u, s->nb);
    for (int i = 0; i < s->n; ++i) v[i] = (u[i] - guess[i]) / scale[i % s->nu];
}

/* When the budget has run out: the better of where the solver stands and the guess, both made admissible. */
RARE static void choose_best(dense *d, const double *guess, const double *last) {
    double beyond, beyond_guess;
    copy(d->best, d->q.v, d->s.ld);
    zero(d->other, d->s.ld);
    clip_deviations(d, guess, last, d->best);
    clip_deviations(d, guess, last, d->other);
    const double cost = merit(d, d->best, &beyond), cost_guess = merit(d, d->other, &beyond_guess);
    const int worse = fabs(beyond - beyond_guess) > RUMO_SLACK_TOLERANCE ? beyond > beyond_guess : !(cost <= cost_guess);
    copy(d->q.v, worse ? d->other : d->best, d->s.ld);
    update_values(&d->q);
}

/* From v to deviations of inputs and states, and constraints there. */
static WITHIN void dense_expand(const dense *d, const stage_maps *m, stage_step *step) {
    const dims s = dims_of(&d->problem->sizes);
    const condensed *h = &d->condensed;
    const qp *q = &d->q;
    const double *scale = d->problem->numbers.input_scales;
    for (int i = 0; unblocked(&s) && i < s.n; ++i) step->du[s.d * s.nu + i] = scale[i % s.nu] * q->v[i];
    for (int k = s.d; !unblocked(&s) && k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j)
            step->du[k * s.nu + j] += scale[j] * blocked_input(&s, &h->held, d->zeros, q->v, k, j);
    for (int k = 0; k < s.N; ++k) {
        double *dx = step->dx + (ptrdiff_t)(k + 1) * s.ldx;
        if (k >= s.d) advance_stage(m, &s, h->stages, k, dx - s.ldx, step->du + k * s.nu, dx);
        for (int i = k * s.nc; i < (k + 1) * s.nc; ++i)
            step->constraints[i] = d->constraints[i] + (k < s.d ? 0.0 : q->value[q->dense + i]);
    }
}

/* At the solution g + H v + A' mu = 0: the slope at the guess is known without H. */
static double slope_at_guess(const dense *d) {
    const dims s = dims_of(&d->problem->sizes);
    const qp *q = &d->q;
    double *slope = d->other;
    copy(slope, d->gradient, s.ld);
    for (int i = 0; i < q->count; ++i) add_row(q, q->member[i], q->mu[i], slope);
    if (q->saturated) add_saturated(q, slope);
    return largest_size(slope, s.ld);
}

/* Rows of the quadratic program as limits of stages. */
RARE static void name_conflicts(const dense *d) {
    const dims *s = &d->s;
    const qp *q = &d->q;
    for (int i = 0; i < q->conflicts; ++i) {
        const int row = q->conflict[i], input = row < q->n ? row : row - q->n, path = row - q->dense;
        d->conflict[i] = path >= 0 ? (rumo_conflict){RUMO_PATH_CONSTRAINT, path / s->nc + 1, path % s->nc}
                                   : (rumo_conflict){row < q->n ? RUMO_INPUT_BOUND : RUMO_MOVE_BOUND,
                                                     first_stage(s, &d->condensed.held, input / s->nu) + 1, input % s->nu};
    }
}

static rumo_status dense_solve(void *self, const stage_maps *m, const stage_known *known, const budget *limits,
                               stage_step *step) {
    dense *const d = (dense *)self;
    const dims s = dims_of(&d->problem->sizes);
    qp *const q = &d->q;
    set_up_qp(d, m, known, step);
    const rumo_status status = solve_qp(q, d->gradient, limits);
    step->iterations = q->iterations;
    step->conflicts = q->conflicts;
    step->conflict = d->conflict;
    if (q->conflicts) name_conflicts(d);
    if (status == RUMO_SOLVER_FAILED) return status;
    if (status == RUMO_BUDGET_EXCEEDED) choose_best(d, m->guess_values, known->decided + (decided_inputs(&s) - 1) * s.nu);
    step->size = largest_size(q->v, s.ld);
    step->kkt_residual = status == RUMO_OPTIMAL ? slope_at_guess(d) : NAN; /* else v is not the solver's */
    dense_expand(d, m, step);
    return status;
}

#endif
