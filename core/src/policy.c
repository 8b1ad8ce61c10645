/* What is applied whatever happened: the plan, else the one before, shifted, else the safe input. */

/* Stages over which the gate asks how far a state can go: over a long horizon, anywhere. */
#define GATE_STAGES 15
/* Repeated samples are suspicious only after so many that differed: some callers always pass the same. */
#define GATE_CHANGES 5
/* And only if the prediction has left them by more than this share of the gate's unit. */
#define GATE_MOTION 1e-3

static inline int gate_stages(const dims *s) { return s->N < s->d + GATE_STAGES ? s->N : s->d + GATE_STAGES; }

/* The inputs nearest to u (count, nu) that respect bounds and move bounds, one after the other; move bounds of the
 * next lie `next` numbers on. */
static void make_admissible(const rumo_controller *c, const double *before, const double *move_lower,
                            const double *move_upper, int next, double *u, int count) {
    const rumo_problem *p = &c->problem;
    const int nu = c->s.nu;
    for (int k = 0; k < count; ++k, move_lower += next, move_upper += next) {
        for (int j = 0; j < nu; ++j) {
            const double wanted = u[k * nu + j], move = wanted - before[j];
            /* An admissible input stays what it is; a move may be as large as numbers get. */
            const double reached = move < move_lower[j]   ? before[j] + move_lower[j]
                                   : move > move_upper[j] ? before[j] + move_upper[j]
                                                          : wanted;
            u[k * nu + j] = clip(reached, p->input_lower[j], p->input_upper[j]);
        }
        before = u + k * nu;
    }
}

/* Whether a measurement can be. Held back are samples outside a wide gate around the prediction, and samples that repeat
 * the one before in every state although the prediction has moved; both are believed when they go on for too long.
 *
 * The gate's width is in units of how far the inputs can move a state over the next stages, plus how far the plan does.
 */
static int plausible(rumo_controller *c, const double *x) {
    const int nx = c->s.nx;
    const double width = c->settings.gate_width;
    if (isinf(width) || !c->has_previous) return 1;
    int expected = 1, agrees = c->implausible > 0, moved = 0;
    for (int r = 0; r < nx; ++r) {
        double span = 0.0;
        for (int k = 1; k <= gate_stages(&c->s); ++k)
            span = fmax(span, fabs(c->previous_x[k * nx + r] - c->previous_x[r]));
        const double unit = c->c.near_reach[r] + span, innovation = fabs(x[r] - c->previous_x[r]);
        if (c->c.near_reach[r] == 0.0) continue; /* nothing to compare with */
        expected &= innovation <= width * unit;
        agrees &= fabs(x[r] - c->suspect[r]) <= width * unit;
        moved |= innovation > GATE_MOTION * unit;
    }
    int *const count = expected ? &c->repeats : &c->implausible;
    if (expected) {
        c->implausible = 0;
        if (!c->has_last || memcmp(x, c->last_x, (size_t)nx * sizeof *x) != 0) {
            copy(c->last_x, x, nx);
            c->has_last = 1;
            c->repeats = 0;
            if (c->changes < GATE_CHANGES) ++c->changes;
            return 1;
        }
        if (!moved || c->changes < GATE_CHANGES) return 1;
        ++c->repeats;
    } else {
        copy(c->suspect, x, nx);
        c->implausible = agrees ? c->implausible + 1 : 1;
    }
    if (*count <= c->settings.gate_patience) return 0;
    *count = 0;
    if (expected) c->changes = 0;
    c->has_guess = 0; /* what was predicted is wrong */
    return 1;
}

/* One sample later: the last input stays, the last state is extrapolated. */
static void shift_plan(rumo_controller *c) {
    const dims *s = &c->s;
    const rumo_shift *shift = &c->problem.shift;
    const int rest = shift->same_rows ? s->N - 1 : 0; /* those before are copied */
    copy(c->previous_u, plan_u(c) + s->nu, rest * s->nu);
    copy(c->previous_x, plan_x(c) + s->nx, (rest ? s->N : 0) * s->nx);
    for (int k = rest; k < s->N; ++k) copy(c->previous_u + k * s->nu, plan_u(c) + shift->intervals[k] * s->nu, s->nu);
    for (int k = rest ? s->N : 0; k <= s->N; ++k) {
        const double *begin = plan_x(c) + shift->stages[k] * s->nx, *end = begin + s->nx;
        for (int r = 0; r < s->nx; ++r) {
            const double x = begin[r] + shift->shares[k] * (end[r] - begin[r]);
            c->previous_x[k * s->nx + r] = isfinite(x) ? x : end[r];
        }
    }
    shift_inner(c);
}

/* Complete the plan: `solved` says whether numbers hold a solution. Then shift it into the next guess. */
static void follow(rumo_controller *c, int solved, rumo_status status, rumo_plan *plan) {
    const dims *s = &c->s;
    const int N = s->N, d = s->d, nx = s->nx, nu = s->nu, decided = d > 1 ? d : 1;
    double *u = plan_u(c), *x = plan_x(c), *last = c->applied + (decided - 1) * nu;
    plan->cause = status;
    if (solved) {
        c->inputs_left = N - d - 1;
    } else {
        for (int i = 0; i < rest_of_plan(s); ++i) plan_constraints(c)[i] = NAN;
        c->last_step = NAN;
        if (c->has_previous && c->inputs_left > 0) {
            copy(u, c->previous_u, N * nu);
            copy(x, c->previous_x, (N + 1) * nx);
            take_inner(c, c->previous_inner);
            --c->inputs_left;
        } else {
            for (int i = 0; i < N * nu; ++i) u[i] = c->problem.safe_input[i % nu];
            for (int i = 0; i < (N + 1) * nx; ++i) x[i] = NAN;
            status = RUMO_PLAN_EXHAUSTED;
        }
    }
    copy(u, c->applied, d * nu);
    make_admissible(c, last, c->problem.move_lower, c->problem.move_upper, 0, u + d * nu, N - d);
    const double *command = u + d * nu;
    memmove(c->applied, c->applied + nu, (size_t)((decided - 1) * nu) * sizeof(double));
    copy(last, command, nu);

    plan->status = status;
    ++c->counts[status];
    c->has_previous = status != RUMO_PLAN_EXHAUSTED;
    if (c->has_previous) {
        shift_plan(c);
        copy(c->guess_u, c->previous_u, N * nu);
        copy(c->guess_x, c->previous_x, (N + 1) * nx);
        copy(c->guess_inner, c->previous_inner, s->ni * s->lanes);
    }
    /* A guess from which the solver came to nothing is not kept: the next measurement gives a new one, at rest. If that
     * fails too, the shifted plan is the better guess, until there is a solution. */
    const int fruitless = !solved && (plan->cause == RUMO_SOLVER_FAILED || plan->cause == RUMO_BUDGET_EXCEEDED);
    c->blameless = !solved && (c->blameless || (fruitless && c->resting));
    c->has_guess = c->has_previous && (!fruitless || c->blameless);
    c->resting = c->prepared = 0;
}
