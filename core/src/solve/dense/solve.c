/* The dense solver's part once the measurement is known: the quadratic program completed, solved, and expanded. */
#ifndef RUMO_SOLVE_C
#define RUMO_SOLVE_C

#include "solve/active_set/qp.c"
#include "solve/dense/dense.h"
#include "stages/adjoint.c"
#include "stages/along.c"

/* dx and dz (ldx,) of stage k from dx of the one before; du may be NULL for none. */
static void advance_stage(const dense *d, int k, const double *before, const double *du, double *dx) {
    const dims s = dims_of(&d->problem->sizes);
    if (is_wide(d->maps)) advance_interval(&d->maps->equations, k, before, du, dx);
    else advance(&s, d->condensed.stages + (ptrdiff_t)k * s.width * s.ldx, before, du, dx);
}

/* Slopes by dx and dz of stage k, lambda, become those by dx of the one before; by du they are `through` (nu,). */
static void retreat_stage(const dense *d, int k, double *through) {
    const dims s = dims_of(&d->problem->sizes);
    zero(d->earlier, s.ldx);
    if (is_wide(d->maps)) {
        retreat_interval(&d->maps->equations, k, d->lambda, d->earlier, through);
    } else {
        const double *stage = d->condensed.stages + (ptrdiff_t)k * s.width * s.ldx;
        for (int j = 0; j < s.nu; ++j) through[j] = dot(stage + (s.nx + j) * s.ldx, d->lambda, s.ldx);
        for (int c = 0; c < s.nx; ++c) d->earlier[c] = dot(stage + c * s.ldx, d->lambda, s.ldx);
    }
    copy(d->lambda, d->earlier, s.ldx);
}

/* Gradient and limits of the QP, now that measurement and reference are known. */
static WITHIN void set_up_qp(dense *d, const stage_maps *m, const stage_known *known, stage_step *step) {
    const rumo_problem *p = d->problem;
    const dims s = dims_of(&p->sizes);
    const condensed *h = &d->condensed;
    const rumo_numbers *numbers = &p->numbers;
    qp *q = &d->p.q;
    const double *last = last_known(&s, known), *u = m->guess_values;
    /* What happens if the inputs stay with the guess from the first free one on. */
    for (int r = 0; r < s.nx; ++r) step->dx[r] = known->x[r] - m->guess_x[r];
    for (int i = 0; i < s.d * s.nu; ++i) step->du[i] = known->decided[i] - m->guess_u[i];
    for (int k = s.d; !unblocked(&s) && k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j)
            step->du[k * s.nu + j] = blocked_input(&s, &h->held, last, u, k, j) - m->guess_u[k * s.nu + j];
    zero(d->p.gradient, s.ld);
    for (int k = 0; k < s.N; ++k) {
        double *dx = step->dx + (ptrdiff_t)(k + 1) * s.ldx;
        const double *du = k < s.d || !unblocked(&s) ? step->du + k * s.nu : NULL;
        advance_stage(d, k, dx - s.ldx, du, dx);
        for (int r = 0; r < s.nc; ++r) {
            const int i = k * s.nc + r;
            d->constraints[i] =
                linearised(m, p->G_first, r, &m->D, &m->E, k, dx, du, numbers->constraint_limits[i]);
            q->upper[q->first_soft + i] = d->imposed_now[i] ? -d->constraints[i] : INFINITY;
        }
        if (k < s.d) continue;
        for (int r = 0; r < s.ny; ++r) {
            const int i = k * s.ny + r;
            const double error =
                linearised(m, p->y_first, r, &m->Cx, &m->Cu, k, dx, du, 0.0) - known->reference[(k + 1) * s.ny + r];
            axpy(d->p.gradient, h->root_weights[i] * error, h->outputs + (ptrdiff_t)i * s.ld,
                 padded(inputs_at(&s, &h->held, k)));
        }
    }
    for (int i = 0; i < s.n; ++i) {
        const int j = i % s.nu;
        const double scale = numbers->input_scales[j], move = u[i] - (i < s.nu ? last[j] : u[i - s.nu]);
        const double slope = 2.0 * numbers->move_weights[i] * move * scale;
        d->p.gradient[i] += slope;
        if (i >= s.nu) d->p.gradient[i - s.nu] -= slope;
        q->lower[i] = (d->limits.lower[i] - u[i]) / scale;
        q->upper[i] = (d->limits.upper[i] - u[i]) / scale;
        if (!d->p.band) continue;
        q->lower[s.n + i] = (numbers->block_lower[i] - move) / scale;
        q->upper[s.n + i] = (numbers->block_upper[i] - move) / scale;
    }
    watch_members(q);
}

/* Cost of v and of its violation of soft rows; *violation is the largest of hard ones, in units of the ranges. */
RARE static double merit(const dense *d, const double *v, double *violation) {
    const matrix_program *p = &d->p;
    const qp *q = &p->q;
    double cost = 0.0;
    *violation = 0.0;
    for (int i = 0; i < q->n; ++i) {
        double sum = 0.5 * p->hessian[(ptrdiff_t)i * q->ld + i] * v[i];
        for (int j = i + 1; j < q->n; ++j) sum += p->hessian[(ptrdiff_t)i * q->ld + j] * v[j];
        cost += v[i] * (sum + d->p.gradient[i]);
    }
    for (int r = q->first_soft; r < q->rows; ++r) {
        const int i = r - q->first_soft;
        const double over = dot(p->matrix + (ptrdiff_t)i * q->ld, v, p->extent[i]) - q->upper[r];
        if (!(over > 0.0)) continue;
        if (isinf(q->l1[r])) *violation = fmax(*violation, over * q->weight[r]);
        else cost += over * (q->l1[r] + q->l2[r] * over);
    }
    return cost;
}

/* When the budget has run out: the better of where the solver stands and the guess, both made admissible. */
RARE static void choose_best(dense *d) {
    const dims *s = &d->s;
    double beyond, beyond_guess;
    copy(d->best, d->p.v, d->s.ld);
    zero(d->other, d->s.ld);
    double *const candidates[] = {d->best, d->other};
    for (int i = 0; i < 2; ++i)
        clip_free_inputs(s, &d->problem->numbers, &d->limits, d->maps->guess_values, last_known(s, d->known), d->inputs,
                         candidates[i]);
    const double cost = merit(d, d->best, &beyond), cost_guess = merit(d, d->other, &beyond_guess);
    copy(d->p.v, is_worse(beyond, cost, beyond_guess, cost_guess) ? d->other : d->best, d->s.ld);
    update_values(&d->p);
}

/* Inputs and states at v. */
static void dense_advance(dense *d) {
    const dims s = dims_of(&d->problem->sizes);
    const condensed *h = &d->condensed;
    const double *scale = d->problem->numbers.input_scales, *v = d->p.v;
    stage_step *step = d->step;
    for (int i = 0; unblocked(&s) && i < s.n; ++i) step->du[s.d * s.nu + i] = scale[i % s.nu] * v[i];
    for (int k = s.d; !unblocked(&s) && k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j)
            step->du[k * s.nu + j] = d->du_known[k * s.nu + j] + scale[j] * blocked_input(&s, &h->held, d->zeros, v, k, j);
    for (int k = s.d; k < s.N; ++k) {
        double *dx = step->dx + (ptrdiff_t)(k + 1) * s.ldx;
        advance_stage(d, k, dx - s.ldx, step->du + k * s.nu, dx);
    }
}

/* The slope of the Lagrangian by one sweep forward and one back along the stages: the condensed Hessian may have lost what
 * decides. */
static double dense_slope(qp *q, double *rest) {
    dense *const d = (dense *)q;
    const dims s = dims_of(&d->problem->sizes);
    const rumo_numbers *numbers = &d->problem->numbers;
    const stage_maps *m = d->maps;
    const double *u = m->guess_values, *last = last_known(&s, d->known), *v = d->p.v;
    double *restrict slope = d->p.sum, *restrict force_along = d->largest_force, worst = 0.0;
    const double *forces = q->forces + q->first_soft;
    dense_advance(d);
    zero(slope, s.ld);
    gather_forces(q, 1);
    for (int i = 0; i < q->count; ++i)
        if (q->member[i] < q->first_soft) add_row(&d->p, q->member[i], q->mu[i], slope);
    zero(force_along, s.nu);
    for (int i = 0; i < s.n; ++i) force_along[i % s.nu] = larger(force_along[i % s.nu], fabs(slope[i]));
    for (int i = 0; i < s.n; ++i) {
        const double scale = numbers->input_scales[i % s.nu];
        const double move = u[i] + scale * v[i] - (i < s.nu ? last[i] : u[i - s.nu] + scale * v[i - s.nu]);
        const double more = v[i] - (i < s.nu ? 0.0 : v[i - s.nu]);
        const double force = 2.0 * numbers->move_weights[i] * move * scale + 2.0 * d->damping * more;
        slope[i] += force;
        if (i >= s.nu) slope[i - s.nu] -= force;
        const double least = 1e-6 * d->p.hessian[(ptrdiff_t)i * s.ld + i];
        force_along[i % s.nu] = larger(force_along[i % s.nu], larger(fabs(force), least));
    }
    zero(d->lambda, s.ldx);
    for (int k = s.N - 1; k >= s.d; --k) {
        const double *dx = d->step->dx + (ptrdiff_t)(k + 1) * s.ldx, *du = d->step->du + k * s.nu;
        double *direct = d->du_slope, *through = d->du_through;
        zero(direct, s.nu);
        for (int r = 0; r < s.ny; ++r) {
            const int i = k * s.ny + r;
            const double wanted = d->known->reference[i + s.ny];
            const double error = linearised(m, d->problem->y_first, r, &m->Cx, &m->Cu, k, dx, du, wanted);
            add_gradient(m, &m->Cx, &m->Cu, k, r, 2.0 * numbers->output_weights[i] * error, d->lambda, direct);
        }
        for (int r = 0; r < s.nc; ++r)
            if (forces[k * s.nc + r] != 0.0) add_gradient(m, &m->D, &m->E, k, r, forces[k * s.nc + r], d->lambda, direct);
        retreat_stage(d, k, through);
        for (int j = 0; j < s.nu; ++j) {
            const double force = (through[j] + direct[j]) * numbers->input_scales[j];
            const double parts = larger(fabs(through[j]), fabs(direct[j])) * numbers->input_scales[j];
            force_along[j] = larger(force_along[j], parts);
            act(&s, &d->condensed.held, k, j, force, slope);
        }
    }
    zero(rest, s.ld);
    add_transformed(&d->p, slope, s.n, rest);
    for (int i = 0; i < s.n; ++i) worst = larger(worst, fabs(slope[i]) / force_along[i % s.nu]);
    return worst;
}

static const qp_space dense_space = {.start = matrix_start,         .evaluate = matrix_evaluate, .correct = matrix_correct,
                                     .transform = matrix_transform, .slope = dense_slope,        .size_of = matrix_size_of,
                                     .condition = NULL,             .solve = NULL,               .combine = NULL,
                                     .project = NULL};

/* Constraints at v, and the states that lead there. */
static WITHIN void dense_expand(dense *d) {
    const dims s = dims_of(&d->problem->sizes);
    const qp *q = &d->p.q;
    dense_advance(d);
    for (int i = 0; i < s.N * s.nc; ++i)
        d->step->constraints[i] = d->constraints[i] + (i < s.d * s.nc ? 0.0 : q->value[q->first_soft + i]);
}

/* Rows of the quadratic program as limits of stages. */
RARE static void name_conflicts(const dense *d) {
    const dims *s = &d->s;
    const qp *q = &d->p.q;
    for (int i = 0; i < q->conflicts; ++i) {
        const int row = q->conflict[i], input = row < q->n ? row : row - q->n, path = row - q->first_soft;
        d->conflict[i] = path >= 0 ? (rumo_conflict){RUMO_PATH_CONSTRAINT, path / s->nc + 1, path % s->nc}
                                   : (rumo_conflict){row < q->n ? RUMO_INPUT_BOUND : RUMO_MOVE_BOUND,
                                                     first_stage(s, &d->condensed.held, input / s->nu) + 1, input % s->nu};
    }
}

static rumo_status dense_solve(void *self, const stage_maps *m, const stage_known *known, const budget *limits,
                               stage_step *step) {
    dense *const d = (dense *)self;
    const dims s = dims_of(&d->problem->sizes);
    qp *const q = &d->p.q;
    d->maps = m;
    d->known = known;
    d->step = step;
    set_up_qp(d, m, known, step);
    copy(d->du_known, step->du, s.N * s.nu);
    const rumo_status status = solve_qp(q, limits);
    step->iterations = q->iterations;
    step->conflicts = q->conflicts;
    step->conflict = d->conflict;
    if (q->conflicts) name_conflicts(d);
    if (status > RUMO_BUDGET_EXCEEDED) return status;
    if (status == RUMO_BUDGET_EXCEEDED) choose_best(d);
    step->size = largest_size(d->p.v, s.ld);
    step->kkt_residual = status == RUMO_OPTIMAL ? q->kkt_residual : NAN; /* else v is not the solver's */
    dense_expand(d);
    return status;
}

#endif
