/* One iteration: the quadratic program completed, solved, and expanded to a plan. */

/* A constraint counts as violated above this share of its scale. */
#define SLACK_TOLERANCE 1e-6
/* Steps below this share of the inputs' ranges are rounding. */
#define NO_STEP 1e-12

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

/* How far the iteration has come. At the solution g + H v + A' mu = 0: the slope at the guess is known without H. */
static void diagnose(rumo_controller *c, rumo_status status) {
    const dims s = dims_of(&c->problem.sizes);
    const qp *q = &c->q;
    double *d = plan_diagnostics(c), *slope = c->other;
    const double size = largest_size(q->v, s.ld);
    d[RUMO_INTEGRATOR_RESIDUAL] = c->straying;
    d[RUMO_STEP] = size;
    d[RUMO_CONTRACTION] = c->last_step > NO_STEP ? size / c->last_step : NAN;
    d[RUMO_KKT_RESIDUAL] = NAN;
    c->last_step = size;
    if (status == RUMO_BUDGET_EXCEEDED) return; /* v is not the solver's */
    copy(slope, c->gradient, s.ld);
    for (int i = 0; i < q->count; ++i) add_row(q, q->member[i], q->mu[i], slope);
    if (q->saturated) add_saturated(q, slope);
    d[RUMO_KKT_RESIDUAL] = largest_size(slope, s.ld);
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
