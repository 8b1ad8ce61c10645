/* The structured solver's part once the measurement is known. */
#ifndef RUMO_RICCATI_SOLVE_C
#define RUMO_RICCATI_SOLVE_C

#include "solve/riccati/pins.c"

/* Simulate the stages that are decided, to zeta_d. */
static void simulate_decided(riccati *r, const stage_maps *m, const stage_known *known, stage_step *step) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const double *scales = r->problem->numbers.input_scales, *last = last_known(&s, known);
    for (int i = 0; i < s.nx; ++i) r->zeta[i] = known->x[i] - m->guess_x[i];
    for (int k = 0; k < s.d; ++k) {
        for (int j = 0; j < s.nu; ++j) {
            const int i = k * s.nu + j;
            step->du[i] = known->decided[i] - m->guess_u[i];
            r->input_slope[j] = step->du[i] / scales[j];
        }
        double *zeta = r->zeta + (ptrdiff_t)k * p.ld;
        forward_stage(r, &s, &p, k, zeta, r->input_slope, 1, zeta + p.ld);
    }
    for (int j = 0; j < s.nu; ++j) r->zeta[s.d * p.ld + p.v + j] = (last[j] - m->guess_last[j]) / scales[j];
}

/* With damping D, w (m + d)^2 + D d^2 is (w + D) (m w / (w + D) + d)^2 and a constant: a share of the guess's change m counts. */
static inline double share_of_move(const riccati *r, int k, int j) {
    if (r->damping == 0.0) return 1.0;
    const double curvature = r->move_curvature[k * r->s.nu + j];
    return (curvature - 2.0 * r->damping) / curvature;
}

/* Limits of all rows, as deviations from the guess. */
static void set_limits(riccati *r, const stage_maps *m) {
    const dims s = dims_of(&r->problem->sizes);
    const rumo_numbers *numbers = &r->problem->numbers;
    qp *q = &r->q;
    for (int j = 0; j < s.nu; ++j) {
        const double share = 1.0 / numbers->input_scales[j];
        double before = m->guess_last[j];
        for (int k = s.d; k < s.N; ++k) {
            if (!begins(&s, &r->problem->blocking, k)) continue;
            const int i = block_at(&s, &r->problem->blocking, k) * s.nu + j, row = j * s.lanes + k;
            const double u = m->guess_values[i], move = u - before;
            before = u;
            r->moves[row] = share * move * share_of_move(r, k, j);
            q->lower[row] = share * (r->limits.lower[i] - u);
            q->upper[row] = share * (r->limits.upper[i] - u);
            if (!r->limited) continue;
            q->lower[s.nu * s.lanes + row] = share * (numbers->block_lower[i] - move);
            q->upper[s.nu * s.lanes + row] = share * (numbers->block_upper[i] - move);
        }
    }
    for (int i = 0; i < s.nc; ++i)
        for (int k = s.d; k < s.N; ++k) {
            const double value = m->terms[(ptrdiff_t)(r->problem->G_first + i) * s.lanes + k];
            const int at = k * s.nc + i;
            q->upper[q->first_soft + i * s.lanes + k] =
                r->problem->imposed[at] ? numbers->constraint_limits[at] - value : INFINITY;
        }
    watch_members(q);
}

/* Cost along the states that v leads to, and of their violation of soft rows; *violation is the largest of hard ones, in units
 * of the ranges. */
static double cost_of(riccati *r, const double *v, double *violation) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const qp *q = &r->q;
    const stage_maps *m = r->maps;
    double cost = 0.0, *nothing = r->input_slope;
    for (int k = s.d; k < s.N; ++k) {
        const double *own = v + block_at(&s, &r->problem->blocking, k) * s.nu;
        zero(nothing, s.nu);
        double *zeta = r->zeta + (ptrdiff_t)k * p.ld;
        forward_stage(r, &s, &p, k, zeta, begins(&s, &r->problem->blocking, k) ? own : nothing, 1, zeta + p.ld);
    }
    riccati_values(r);
    for (int i = 0; i < s.ny; ++i) {
        zero(r->force, s.lanes);
        add_node_values(&r->outputs, i, r->zeta_lanes, s.lanes, r->force);
        for (int k = s.d; k < s.N; ++k) {
            const double y = m->terms[(ptrdiff_t)(r->problem->y_first + i) * s.lanes + k];
            const double error = r->force[k] + y - r->known->reference[(k + 1) * s.ny + i];
            cost += r->problem->numbers.output_weights[k * s.ny + i] * error * error;
        }
    }
    for (int j = 0; j < s.nu; ++j)
        for (int k = s.d; k < s.N; ++k) {
            const double change = r->moves[j * s.lanes + k] + r->change_lanes[j * s.lanes + k];
            cost += 0.5 * r->move_curvature[k * s.nu + j] * change * change;
        }
    *violation = 0.0;
    for (int row = q->first_soft; row < q->rows; ++row) {
        const double over = q->value[row] - q->upper[row];
        if (!(over > 0.0) || row % s.lanes >= s.N) continue;
        if (isinf(q->l1[row])) *violation = fmax(*violation, over * q->weight[row]);
        else cost += over * (q->l1[row] + q->l2[row] * over);
    }
    return cost;
}

/* When the budget has run out: the better of where the solver stands and the guess, both made admissible. */
RARE static void take_best(riccati *r, const stage_known *known) {
    const dims s = dims_of(&r->problem->sizes);
    double beyond, beyond_guess;
    for (int k = s.d; k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j)
            r->best[block_at(&s, &r->problem->blocking, k) * s.nu + j] = r->q.value[j * s.lanes + k];
    zero(r->other, s.n);
    double *const candidates[] = {r->best, r->other};
    for (int i = 0; i < 2; ++i)
        clip_free_inputs(&s, &r->problem->numbers, &r->limits, r->maps->guess_values, last_known(&s, known), r->inputs,
                         candidates[i]);
    const double cost_guess = cost_of(r, r->other, &beyond_guess), cost = cost_of(r, r->best, &beyond);
    if (is_worse(beyond, cost, beyond_guess, cost_guess)) cost_of(r, r->other, &beyond_guess);
}

/* From zeta to deviations of inputs and states, and constraints there. */
static void riccati_expand(const riccati *r, stage_step *step) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const stage_maps *m = r->maps;
    const qp *q = &r->q;
    for (int k = 0; k <= s.N; ++k) copy(step->dx + (ptrdiff_t)k * s.ldx, r->zeta + (ptrdiff_t)k * p.ld, s.rows);
    for (int k = s.d; k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j) {
            const double *zeta = r->zeta + (ptrdiff_t)(k + 1) * p.ld, share = share_at(&s, &r->problem->blocking, k);
            const double mixed = unblocked(&s) ? zeta[p.v + j] : share * zeta[p.v + j] + (1.0 - share) * zeta[p.before + j];
            step->du[k * s.nu + j] = r->problem->numbers.input_scales[j] * mixed;
        }
    const double *restrict limits = r->problem->numbers.constraint_limits, *restrict change = q->value + q->first_soft;
    for (int k = 0; k < s.d; ++k)
        for (int i = 0; i < s.nc; ++i)
            step->constraints[k * s.nc + i] =
                linearised(m, r->problem->G_first, i, &m->D, &m->E, k, step->dx + (ptrdiff_t)(k + 1) * s.ldx,
                           step->du + k * s.nu, limits[k * s.nc + i]);
    double *restrict values = q->forces;
    for (int i = 0; i < s.nc * s.lanes; ++i) values[i] = m->terms[(ptrdiff_t)r->problem->G_first * s.lanes + i] + change[i];
    turn(values + s.d, s.lanes, s.nc, s.N - s.d, step->constraints + s.d * s.nc, s.nc);
    for (int i = s.d * s.nc; i < s.N * s.nc; ++i) step->constraints[i] -= limits[i];
}

/* Rows of the program as limits of stages. */
RARE static void riccati_name_conflicts(const riccati *r) {
    for (int i = 0; i < r->q.conflicts; ++i) {
        const stage_limit of = limited_by(r, r->q.conflict[i]);
        r->conflict[i] = (rumo_conflict){of.kind, of.k + 1, of.index};
    }
}

static rumo_status riccati_solve(void *self, const stage_maps *m, const stage_known *known, const budget *limits,
                                 stage_step *step) {
    riccati *const r = (riccati *)self;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    qp *const q = &r->q;
    r->maps = m;
    r->known = known;
    simulate_decided(r, m, known, step);
    set_limits(r, m);
    for (int i = 0; q->kept && i < q->count; ++i) {
        const int place = q->place[i];
        q->base[place] = r->gamma[place] + dot(r->pi + (ptrdiff_t)place * p.ld, r->zeta + s.d * p.ld, p.ld);
    }
    step->iterations = 0;
    rumo_status status = try_solving(r, limits, &step->iterations);
    if (status > RUMO_BUDGET_EXCEEDED && !q->conflicts) status = solve_otherwise(r, limits, &step->iterations);
    step->conflicts = q->conflicts;
    step->conflict = r->conflict;
    if (q->conflicts) riccati_name_conflicts(r);
    if (status > RUMO_BUDGET_EXCEEDED) return status;
    if (status == RUMO_BUDGET_EXCEEDED) take_best(r, known);
    step->size = 0.0;
    for (int i = 0; i < s.nu * s.lanes; ++i) step->size = larger(step->size, fabs(q->value[i]));
    step->kkt_residual = status == RUMO_OPTIMAL ? q->kkt_residual : NAN; /* else it is not the solver's */
    riccati_expand(r, step);
    return status;
}

#endif
