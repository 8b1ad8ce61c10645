/* The real-time iteration: prepare, then feedback, once per sample. */

/* A guess farther from the dynamics than this share of what the inputs can do has strayed. */
#define STRAYED 0.03

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
    c->linearize_seconds = NAN;
    if (c->has_guess) {
        c->has_guess = linearize(c, !c->resting);
        c->linearize_seconds = c->linearized_at - start;
    }
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
    plan->linearize_seconds = c->linearize_seconds;
    plan->feedback_seconds = seconds_now() - start;
}

static void step(rumo_controller *c, const double *x, const double *reference, rumo_plan *plan) {
    if (!c->has_guess && all_finite(x, c->s.nx)) start_guess(c, x);
    if (!c->prepared) prepare(c);
    feedback(c, x, reference, plan);
}
