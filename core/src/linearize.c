/* From a guess to a quadratic program that lacks only the measurement. */

/* A constraint that all inputs' ranges move by less than this share of its scale is not imposed. */
#define NO_INFLUENCE 1e-10

static const double *last_decided(const rumo_controller *c) {
    return c->applied + (c->s.d > 1 ? c->s.d - 1 : 0) * c->s.nu;
}

/* A guess of a state at rest, with the last input decided. */
static void start_guess(rumo_controller *c, const double *x) {
    const dims *s = &c->s;
    const double *last = last_decided(c);
    for (int k = 0; k <= s->N; ++k) copy(c->guess_x + k * s->nx, x, s->nx);
    for (int i = 0; i < s->N * s->nu; ++i)
        c->guess_u[i] = clip(last[i % s->nu], c->problem.input_lower[i % s->nu], c->problem.input_upper[i % s->nu]);
    guess_inner(c, x);
    c->has_guess = c->resting = 1;
    c->last_step = NAN;
    c->prepared = c->balanced = 0;
    clear_members(&c->q);
}

/* Input j of stage k, given the values of blocks and what comes before the first of them. */
static inline double blocked_input(const dims *s, const rumo_blocking *held, const double *before,
                                   const double *values, int k, int j) {
    const int own = block_at(s, held, k) * s->nu + j;
    const double share = share_at(s, held, k);
    return share < 1.0 ? share * values[own] + (1.0 - share) * (own < s->nu ? before[j] : values[own - s->nu])
                       : values[own];
}

/* Where inputs are held over blocks, hold those of the guess as well. */
static void hold_guess(rumo_controller *c) {
    const dims *s = &c->s;
    if (unblocked(s)) return;
    zero(c->guess_values, s->n);
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu; ++j)
            c->guess_values[block_at(s, &c->c.held, k) * s->nu + j] += c->c.held.part[k] * c->guess_u[k * s->nu + j];
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu; ++j)
            c->guess_u[k * s->nu + j] = blocked_input(s, &c->c.held, last_decided(c), c->guess_values, k, j);
}

/* The guess, number k in lane k. */
static void load_guess(rumo_controller *c) {
    const dims s = c->s;
    const int stride = s.lanes + LANES;
    for (int k = 0; k < stride; ++k) {
        const double *x = c->guess_x + (k < s.N ? k : s.N) * s.nx;
        for (int r = 0; r < s.nx; ++r) c->x_lanes[r * stride + k] = x[r];
    }
    to_lanes(c->guess_u, s.nu, s.nu, s.N, s.lanes, c->u_lanes);
}

/* Linearise all stages at the guess: model, constraints and derivatives, and the unknowns eliminated. */
APART static int linearize_stages(rumo_controller *c) {
    const dims s = dims_of(&c->problem.sizes);
    const rumo_problem *p = &c->problem;
    hold_guess(c);
    load_guess(c);
    for (int j = 0; j < s.m; ++j) {
        const guess_lanes in = at_substep(c, j);
        double *result = results_of(c, j);
        double *inside = c->terms + (ptrdiff_t)p->defect * s.lanes;
        if (j + 1 == s.m) {
            evaluate(&p->tape, &in, s.lanes, c->registers, c->terms);
            if (!all_finite(c->terms, p->sizes.slots * s.lanes)) return 0;
        } else {
            evaluate_inner(&p->inner_tape, &in, s.lanes, c->registers, c->terms);
            if (!all_finite(inside, (p->Cx.first - p->defect) * s.lanes)) return 0;
        }
        if (s.explicit_scheme && j + 1 < s.m) {
            copy(c->on_the_way, inside, s.nx * s.lanes);
            zero(inside, s.nx * s.lanes); /* it is where the next substep begins */
        }
        if (!c->balanced) {
            balance(&p->elimination, &p->M, c->terms, s.lanes, s.nw, c->block_of, c->unit);
            c->balanced = 1;
        }
        eliminate(&p->elimination, c->unit, c->terms, s.lanes, c->work, result);
        if (!all_finite(result, p->elimination.entries * s.lanes)) return 0;
        if (s.m == 1) break;
        if (j == 0) {
            start_composition(&p->composition, result, s.lanes, c->maps);
            continue;
        }
        compose(&p->composition, result, c->maps, s.lanes, c->other_maps);
        double *const composed = c->other_maps;
        c->other_maps = c->maps;
        c->maps = composed;
    }
    return s.m == 1 || all_finite(c->maps, p->composition.entries * s.lanes);
}

/* How far the guess is from satisfying the dynamics, over the reach of the inputs; but not where it is extrapolated. */
static double straying(const rumo_controller *c) {
    const dims *s = &c->s;
    double worst = 0.0;
    for (int r = 0; r < s->nx; ++r) {
        const int e = c->map.start[r + 1] - 1; /* the last entry of a row is c, if it has one */
        if (e < c->map.start[r] || c->map.column[e] != s->width - 1 || !(c->c.reach[r] > 0.0)) continue;
        double largest = 0.0;
        for (int k = 0; k + 1 < s->N; ++k) {
            const double size = fabs(c->maps[(ptrdiff_t)e * s->lanes + k]);
            largest = size > largest ? size : largest;
        }
        worst = fmax(worst, largest / c->c.reach[r]);
    }
    return worst;
}

/* Linearise, eliminate, condense, factor, and take over the working set of the step before, `shift` stages on. */
static int linearize(rumo_controller *c, int shift) {
    const dims s = dims_of(&c->problem.sizes);
    const double *scales = c->problem.input_scales;
    const int usable = linearize_stages(c);
    c->linearized_at = seconds_now();
    if (!usable) return 0;
    spread(&s, &c->map, c->map_row, c->maps, c->c.stages);
    respond(&s, &c->map, c->end_of_A, c->maps, scales, gate_stages(&s), &c->c);
    c->straying = straying(c);
    for (int k = s.d; k < s.N; ++k) {
        const int length = padded(inputs_at(&s, &c->c.held, k));
        for (int i = k * s.ny; i < (k + 1) * s.ny; ++i)
            measure(&s, &c->c, c->terms, k, i - k * s.ny, &c->Cx, &c->Cu, c->c.root_weights[i], scales,
                    c->c.outputs + (ptrdiff_t)i * s.ld);
        for (int i = k * s.nc; i < (k + 1) * s.nc; ++i) {
            double *row = c->c.rows + (ptrdiff_t)i * s.ld;
            measure(&s, &c->c, c->terms, k, i - k * s.nc, &c->D, &c->E, 1.0, scales, row);
            const double norm = sqrt(dot(row, row, length));
            c->imposed_now[i] = c->problem.imposed[i] && norm > NO_INFLUENCE * c->problem.constraint_scales[i - k * s.nc];
            c->q.weight[c->q.dense + i] = c->imposed_now[i] ? 1.0 / norm : 0.0;
        }
    }
    add_up_hessian(&s, c->problem.move_weights, scales, &c->c);
    if (!factorize(s.n, s.ld, c->c.hessian, c->c.factor, c->c.inverse, c->c.transpose)) return 0;
    shift &= unblocked(&s) && c->problem.shift.same_rows;
    renew_members(&c->q, shift * s.nu, shift * s.nc, c->imposed_now);
    return 1;
}
