/* The real-time iteration: prepare, then feedback, once per sample. */

/* A guess farther from the dynamics than this share of what the inputs can do has strayed. */
#define STRAYED 0.03
/* A constraint that all inputs' ranges move by less than this share of its scale is not imposed. */
#define NO_INFLUENCE 1e-10
/* A constraint counts as violated above this share of its scale. */
#define SLACK_TOLERANCE 1e-6

/* Steps below this share of the inputs' ranges are rounding. */
#define NO_STEP 1e-12

static void start_guess(rumo_controller *c, const double *x) {
    const dims *s = &c->s;
    const double *last = c->applied + (s->d > 1 ? s->d - 1 : 0) * s->nu;
    for (int k = 0; k <= s->N; ++k) copy(c->guess_x + k * s->nx, x, s->nx);
    for (int i = 0; i < s->N * s->nu; ++i)
        c->guess_u[i] = clip(last[i % s->nu], c->problem.input_lower[i % s->nu], c->problem.input_upper[i % s->nu]);
    guess_inner(c, x);
    c->has_guess = c->resting = 1;
    c->last_step = NAN;
    c->prepared = c->balanced = 0;
    clear_members(&c->q);
}

static const double *last_decided(const rumo_controller *c) {
    return c->applied + (c->s.d > 1 ? c->s.d - 1 : 0) * c->s.nu;
}

/* Input j of stage k, given the values of blocks and what comes before the first of them. */
static inline double blocked_input(const dims *s, const rumo_blocking *held, const double *before, const double *values, int k, int j) {
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
    if (!linearize_stages(c)) return 0;
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

static inline double entry(const rumo_controller *c, const sparse *matrix, int e, int k) {
    return c->terms[(ptrdiff_t)(matrix->first + e) * c->s.lanes + k];
}

/* An output or constraint of stage k at (dx, du), as linearised. */
static inline double linearised(const rumo_controller *c, int value, int r, const sparse *of_x, const sparse *of_u, int k,
                                const double *dx, const double *du) {
    double y = c->terms[(ptrdiff_t)(value + r) * c->s.lanes + k];
    for (int e = of_x->start[r]; e < of_x->start[r + 1]; ++e) y += entry(c, of_x, e, k) * dx[of_x->column[e]];
    if (du)
        for (int e = of_u->start[r]; e < of_u->start[r + 1]; ++e) y += entry(c, of_u, e, k) * du[of_u->column[e]];
    return y;
}

/* Gradient and limits of the QP, now that measurement and reference are known. */
static void set_up_qp(rumo_controller *c, const double *x, const double *reference) {
    const dims s = dims_of(&c->problem.sizes);
    const rumo_problem *p = &c->problem;
    qp *q = &c->q;
    const double *last = last_decided(c), *u = c->guess_values;
    /* What happens if the inputs stay with the guess from the first free one on. */
    for (int r = 0; r < s.nx; ++r) c->dx[r] = x[r] - c->guess_x[r];
    for (int i = 0; i < s.d * s.nu; ++i) c->du[i] = c->applied[i] - c->guess_u[i];
    for (int k = s.d; !unblocked(&s) && k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j)
            c->du[k * s.nu + j] = blocked_input(&s, &c->c.held, last, u, k, j) - c->guess_u[k * s.nu + j];
    zero(c->gradient, s.ld);
    for (int k = 0; k < s.N; ++k) {
        double *dx = c->dx + (ptrdiff_t)(k + 1) * s.ldx;
        const double *du = k < s.d || !unblocked(&s) ? c->du + k * s.nu : NULL;
        advance(&s, c->c.stages + (ptrdiff_t)k * s.width * s.ldx, dx - s.ldx, du, dx);
        for (int r = 0; r < s.nc; ++r) {
            const int i = k * s.nc + r;
            c->constraints[i] = linearised(c, p->G, r, &c->D, &c->E, k, dx, du);
            q->upper[q->dense + i] = c->imposed_now[i] ? -c->constraints[i] : INFINITY;
        }
        if (k < s.d) continue;
        for (int r = 0; r < s.ny; ++r) {
            const int i = k * s.ny + r;
            const double error = linearised(c, p->y, r, &c->Cx, &c->Cu, k, dx, du) - reference[(k + 1) * s.ny + r];
            axpy(c->gradient, c->c.root_weights[i] * error, c->c.outputs + (ptrdiff_t)i * s.ld, padded(inputs_at(&s, &c->c.held, k)));
        }
    }
    for (int i = 0; i < s.n; ++i) {
        const int j = i % s.nu;
        const double scale = p->input_scales[j], move = u[i] - (i < s.nu ? last[j] : u[i - s.nu]);
        const double slope = 2.0 * p->move_weights[i] * move * scale;
        c->gradient[i] += slope;
        if (i >= s.nu) c->gradient[i - s.nu] -= slope;
        q->lower[i] = (p->input_lower[j] - u[i]) / scale;
        q->upper[i] = (p->input_upper[j] - u[i]) / scale;
        if (!q->band) continue;
        q->lower[s.n + i] = (p->block_lower[i] - move) / scale;
        q->upper[s.n + i] = (p->block_upper[i] - move) / scale;
    }
    watch_members(q);
}

/* Cost of v and of its violation of soft rows; *violation is the largest of hard ones, in units of the ranges. */
RARE static double merit(const rumo_controller *c, const double *v, double *violation) {
    const qp *q = &c->q;
    double cost = 0.0;
    *violation = 0.0;
    for (int i = 0; i < q->n; ++i) {
        double sum = 0.5 * q->hessian[(ptrdiff_t)i * q->ld + i] * v[i];
        for (int j = i + 1; j < q->n; ++j) sum += q->hessian[(ptrdiff_t)i * q->ld + j] * v[j];
        cost += v[i] * (sum + c->gradient[i]);
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
static void clip_deviations(const rumo_controller *c, double *v) {
    const dims *s = &c->s;
    double *u = plan_u(c) + s->d * s->nu;
    const double *guess = c->guess_values, *scale = c->problem.input_scales;
    for (int i = 0; i < s->n; ++i) u[i] = guess[i] + scale[i % s->nu] * v[i];
    make_admissible(c, last_decided(c), c->problem.block_lower, c->problem.block_upper, s->nu, u, s->nb);
    for (int i = 0; i < s->n; ++i) v[i] = (u[i] - guess[i]) / scale[i % s->nu];
}

/* When the budget has run out: the better of where the solver stands and the guess, both made admissible. */
RARE static void take_best(rumo_controller *c) {
    double beyond, beyond_guess;
    copy(c->best, c->q.v, c->s.ld);
    zero(c->other, c->s.ld);
    clip_deviations(c, c->best);
    clip_deviations(c, c->other);
    const double cost = merit(c, c->best, &beyond), cost_guess = merit(c, c->other, &beyond_guess);
    const int worse = fabs(beyond - beyond_guess) > SLACK_TOLERANCE ? beyond > beyond_guess : !(cost <= cost_guess);
    copy(c->q.v, worse ? c->other : c->best, c->s.ld);
    update_values(&c->q);
}

/* Inputs, states and constraints of the QP's solution; returns the status it deserves. */
static rumo_status expand(rumo_controller *c, const double *x, rumo_status status) {
    const dims s = dims_of(&c->problem.sizes);
    const double *scale = c->problem.input_scales;
    double *u = plan_u(c), *states = plan_x(c), *constraints = plan_constraints(c);
    for (int i = 0; unblocked(&s) && i < s.n; ++i) c->du[s.d * s.nu + i] = scale[i % s.nu] * c->q.v[i];
    for (int k = s.d; !unblocked(&s) && k < s.N; ++k)
        for (int j = 0; j < s.nu; ++j)
            c->du[k * s.nu + j] += scale[j] * blocked_input(&s, &c->c.held, c->zeros, c->q.v, k, j);
    for (int i = 0; i < s.N * s.nu; ++i) u[i] = c->guess_u[i] + c->du[i];
    copy(states, x, s.nx);
    int violated = 0;
    for (int k = 0; k < s.N; ++k) {
        double *dx = c->dx + (ptrdiff_t)(k + 1) * s.ldx;
        if (k >= s.d)
            advance(&s, c->c.stages + (ptrdiff_t)k * s.width * s.ldx, dx - s.ldx, c->du + k * s.nu, dx);
        for (int r = 0; r < s.nx; ++r) states[(k + 1) * s.nx + r] = c->guess_x[(k + 1) * s.nx + r] + dx[r];
        for (int r = 0; r < s.nc; ++r) {
            const int i = k * s.nc + r;
            constraints[i] = c->constraints[i] + (k < s.d ? 0.0 : c->q.value[c->q.dense + i]);
            violated |= constraints[i] > SLACK_TOLERANCE * c->problem.constraint_scales[r] && c->problem.imposed[i];
        }
    }
    expand_inner(c);
    if (!all_finite(c->numbers, s.N * s.nu + (s.N + 1) * s.nx + s.N * s.nc)) return RUMO_SOLVER_FAILED;
    if (!all_finite(c->inner, s.ni * s.lanes)) return RUMO_SOLVER_FAILED;
    return status == RUMO_OPTIMAL && violated ? RUMO_SOFT_VIOLATED : status;
}

/* How far the iteration has come, cheaply: U v is known, and H v = U'(U v). */
static void diagnose(rumo_controller *c, rumo_status status) {
    const dims s = dims_of(&c->problem.sizes);
    double *d = plan_diagnostics(c), largest = 0.0;
    for (int i = 0; i < s.n; ++i) largest = larger(largest, fabs(c->q.v[i]));
    d[RUMO_INTEGRATOR_RESIDUAL] = c->straying;
    d[RUMO_STEP] = largest;
    d[RUMO_CONTRACTION] = c->last_step > NO_STEP ? largest / c->last_step : NAN;
    d[RUMO_KKT_RESIDUAL] = NAN;
    c->last_step = largest;
    if (status == RUMO_BUDGET_EXCEEDED) return; /* v is not the solver's */
    double *slope = c->other;
    zero(slope, s.ld);
    for (int i = 0; i < s.n; ++i) {
        const int start = i / LANES * LANES;
        axpy(slope + start, c->q.w[i], c->c.factor + (ptrdiff_t)i * s.ld + start, s.ld - start);
    }
    largest = 0.0;
    for (int i = 0; i < s.n; ++i) largest = larger(largest, fabs(slope[i]));
    d[RUMO_KKT_RESIDUAL] = largest;
}

/* One QP about a prepared guess; SOLVER_FAILED leaves no plan. */
static rumo_status iterate(rumo_controller *c, const double *x, const double *reference, rumo_plan *plan) {
    const qp_limits limits = {c->settings.qp_iterations, c->settings.qp_tolerance, c->settings.qp_seconds};
    set_up_qp(c, x, reference);
    const rumo_status status = solve_qp(&c->q, c->gradient, &limits);
    plan->iterations += c->q.iterations;
    plan->conflicts = c->q.conflicts;
    if (status == RUMO_SOLVER_FAILED) return status;
    if (status == RUMO_BUDGET_EXCEEDED) take_best(c);
    diagnose(c, status);
    return expand(c, x, status);
}

static int is_solved(rumo_status status) { return status == RUMO_OPTIMAL || status == RUMO_SOFT_VIOLATED; }

/* Largest change of an input over its range, or of a state over the reach of the inputs, from guess to plan. */
static double change(const rumo_controller *c) {
    const dims *s = &c->s;
    double largest = 0.0;
    for (int i = 0; i < s->N * s->nu; ++i)
        largest = fmax(largest, fabs(plan_u(c)[i] - c->guess_u[i]) / c->problem.input_scales[i % s->nu]);
    for (int i = 0; i < (s->N + 1) * s->nx; ++i)
        if (c->c.reach[i % s->nx] > 0.0)
            largest = fmax(largest, fabs(plan_x(c)[i] - c->guess_x[i]) / c->c.reach[i % s->nx]);
    return largest;
}

/* Linearise about the plan next. */
static void guess_plan(rumo_controller *c) {
    const dims *s = &c->s;
    copy(c->guess_u, plan_u(c), s->N * s->nu);
    copy(c->guess_x, plan_x(c), (s->N + 1) * s->nx);
    copy(c->guess_rest, plan_constraints(c), rest_of_plan(s));
    copy(c->guess_inner, c->inner, s->ni * s->lanes);
}

/* Iterate on the state that is expected at the next sample, and what was wanted at the last. */
static void advance_guess(rumo_controller *c) {
    for (int i = 0; c->has_guess && c->has_reference && i < c->settings.preparation_iterations; ++i) {
        rumo_plan ignored = {0};
        if (!is_solved(iterate(c, c->guess_x, c->last_reference, &ignored))) return;
        const int done = change(c) < c->settings.sqp_tolerance;
        guess_plan(c);
        c->has_guess = linearize(c, 0);
        if (done) return;
    }
}

static void prepare(rumo_controller *c) {
    const double start = seconds_now();
    if (c->has_guess) c->has_guess = linearize(c, !c->resting);
    if (c->has_guess) {
        /* A plan made from a wild measurement would keep misleading its successors. */
        const int strayed = !(c->straying < STRAYED);
        c->has_guess = !(c->settled && strayed && !c->resting);
        c->settled = !strayed;
    }
    if (c->settings.preparation_iterations > 0) advance_guess(c);
    c->prepared = 1;
    c->prepare_seconds = seconds_now() - start;
}

/* Keep what is wanted, one sample later; the end of it stays. */
static void keep_reference(rumo_controller *c, const double *reference) {
    const dims *s = &c->s;
    const rumo_shift *shift = &c->problem.shift;
    for (int k = 0; k <= s->N; ++k) {
        const double *begin = reference + shift->stages[k] * s->ny;
        const double share = smaller(shift->shares[k], 1.0);
        for (int r = 0; r < s->ny; ++r)
            c->last_reference[k * s->ny + r] = begin[r] + share * (begin[s->ny + r] - begin[r]);
    }
    c->has_reference = 1;
}

static rumo_status attempt(rumo_controller *c, const double *x, const double *reference, rumo_plan *plan) {
    const dims *s = &c->s;
    if (!all_finite(x, s->nx)) return RUMO_BAD_MEASUREMENT;
    if (!all_finite(reference, (s->N + 1) * s->ny)) return RUMO_BAD_REFERENCE;
    if (c->settings.preparation_iterations > 0) keep_reference(c, reference);
    if (!plausible(c, x)) return RUMO_BAD_MEASUREMENT;
    if (!c->has_guess) {
        start_guess(c, x);
        if (!linearize(c, 0)) return RUMO_SOLVER_FAILED;
    }
    rumo_status status = iterate(c, x, reference, plan);
    for (int i = 1; i < c->settings.sqp_iterations && is_solved(status); ++i) {
        if (change(c) < c->settings.sqp_tolerance) break;
        guess_plan(c);
        if (!linearize(c, 0)) break;
        const rumo_status better = iterate(c, x, reference, plan);
        if (!is_solved(better)) {
            /* Keep what the iteration before found: it is the guess. */
            copy(plan_u(c), c->guess_u, s->N * s->nu);
            copy(plan_x(c), c->guess_x, (s->N + 1) * s->nx);
            copy(plan_constraints(c), c->guess_rest, rest_of_plan(s));
            copy(c->inner, c->guess_inner, s->ni * s->lanes);
            break;
        }
        status = better;
    }
    return status;
}

static void feedback(rumo_controller *c, const double *x, const double *reference, rumo_plan *plan) {
    if (!c->prepared) prepare(c);
    const double start = seconds_now();
    plan->numbers = c->numbers;
    plan->count = size_of_plan(&c->s);
    plan->iterations = plan->conflicts = 0;
    plan->conflict = c->q.conflict;
    const rumo_status status = attempt(c, x, reference, plan);
    follow(c, status != RUMO_BAD_MEASUREMENT && status != RUMO_BAD_REFERENCE && status != RUMO_SOLVER_FAILED, status, plan);
    plan->prepare_seconds = c->prepare_seconds;
    plan->feedback_seconds = seconds_now() - start;
}

static void step(rumo_controller *c, const double *x, const double *reference, rumo_plan *plan) {
    if (!c->has_guess && all_finite(x, c->s.nx)) start_guess(c, x);
    if (!c->prepared) prepare(c);
    feedback(c, x, reference, plan);
}
