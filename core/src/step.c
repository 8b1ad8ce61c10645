/* The real-time iteration: prepare, then feedback, once per sample. */
#ifndef RUMO_STEP_C
#define RUMO_STEP_C

#include "base/clock.h"
#include "controller.h"
#include "guard/follow.c"
#include "guard/gate.c"
#include "guard/stray.c"
#include "guard/turns.c"
#include "settle.c"

/* Put the guess aside, for another preparation of the same sample. */
static void store_guess(rumo_controller *ctl) {
    keep(ctl, &ctl->stored);
    ctl->has_stored = 1;
}

/* What was wanted at the last sample, one sample later; the end of it stays. */
static void expect_reference(rumo_controller *ctl) {
    const dims *s = &ctl->s;
    const rumo_shift *shift = &ctl->problem.shift;
    for (int k = 0; k <= s->N; ++k) {
        const double *begin = ctl->last_reference + shift->stages[k] * s->ny;
        const double share = smaller(shift->shares[k], 1.0);
        for (int r = 0; r < s->ny; ++r)
            ctl->expected[k * s->ny + r] = begin[r] + share * (begin[s->ny + r] - begin[r]);
    }
}

/* Iterate on the state that is expected at the next sample, and what was wanted at the last. */
static void advance_guess(rumo_controller *ctl) {
    if (!ctl->guard.has_guess || !ctl->has_reference) return;
    store_guess(ctl);
    expect_reference(ctl);
    for (int i = 0; ctl->guard.has_guess && i < ctl->settings.preparation_iterations; ++i) {
        rumo_plan ignored = {0};
        if (!is_solved(iterate(ctl, ctl->stages.guess_x, ctl->expected, &ignored))) return;
        const int done = change(ctl) < ctl->settings.sqp_tolerance;
        guess_plan(ctl);
        ctl->guard.has_guess = linearize(ctl) == RUMO_OPTIMAL;
        if (done) return;
    }
}

/* What the next sample depends on where some readings are old, without maps: the equations are solved for each state. */
RARE static void expect_without_maps(rumo_controller *ctl) {
    rumo_guard *g = &ctl->guard;
    double *before = ctl->near_reach, *without = ctl->step.dx, *after = without + ctl->s.ldx, *A;
    const int nx = ctl->s.nx;
    if (g->oldest == 0 || !begin_expecting(g)) return;
    g->monitor.expects = 0; /* nothing is monitored */
    A = dependence_of(g, 0);
    zero(before, nx);
    advance_interval(&ctl->stages.equations, 0, before, NULL, without);
    for (int j = 0; j < nx; ++j) {
        before[j] = 1.0;
        advance_interval(&ctl->stages.equations, 0, before, NULL, after);
        before[j] = 0.0;
        for (int r = 0; r < nx; ++r) A[r * nx + j] = after[r] - without[r];
    }
    expect_old_readings(g);
}

/* What the next readings depend on, as the last plan was linearised. Wide models have no maps to say so. */
static void expect_readings(rumo_controller *ctl) {
    rumo_guard *g = &ctl->guard;
    const stage_maps *m = &ctl->stages;
    if (is_wide(m)) {
        expect_without_maps(ctl);
        return;
    }
    if (!begin_expecting(g)) return;
    double *A = g->oldest ? dependence_of(g, 0) : NULL;
    if (A) zero(A, ctl->s.nx * ctl->s.nx);
    for (int r = 0; r < ctl->s.nx; ++r) {
        double own = 0.0, change = g->x[r] - g->next_x[r];
        for (int e = m->map.start[r]; e < m->end_of_A[r]; ++e) {
            const int j = m->map.column[e];
            const double entry = m->maps[(ptrdiff_t)e * ctl->s.lanes];
            change += entry * (g->next_x[j] - g->x[j]);
            if (j == r) own = entry;
            if (A) A[r * ctl->s.nx + j] = entry;
        }
        expect_reading(g, r, own, change);
    }
    if (A) expect_old_readings(g);
    g->monitor.fresh = 0;
}

static void prepare_in_time(rumo_controller *ctl) {
    const double start = seconds_now();
    expect_readings(ctl);
    ctl->linearize_seconds = NAN;
    if (ctl->guard.has_guess) {
        if (ctl->has_stored) take_up(ctl, &ctl->stored);
        ctl->guard.has_guess = linearize(ctl) == RUMO_OPTIMAL && (!is_plain(ctl) || keep_guess(&ctl->guard, ctl->straying));
        ctl->linearize_seconds = ctl->linearized_at - start;
    }
    if (ctl->settings.preparation_iterations > 0) advance_guess(ctl);
    ctl->prepared = 1;
    ctl->prepare_seconds = seconds_now() - start;
}

/* Whether something is wanted wherever that has a weight. */
RARE static int is_usable(const rumo_controller *ctl, const double *reference) {
    const int ny = ctl->s.ny;
    const double *weights = ctl->problem.numbers.output_weights;
    for (int i = 0; i < ctl->s.N * ny; ++i)
        if (!isfinite(reference[ny + i]) && weights[i] != 0.0) return 0;
    return 1;
}

/* What is wanted, where there is no number that of the stage after. */
RARE static void fill_reference(rumo_controller *ctl, const double *reference) {
    const int ny = ctl->s.ny, count = (ctl->s.N + 1) * ny;
    double *kept = ctl->last_reference;
    for (int i = count - 1; i >= 0; --i)
        kept[i] = isfinite(reference[i]) ? reference[i] : i + ny < count ? kept[i + ny] : 0.0;
}

/* What is wanted of angles goes on from where it began before, or from the measurement, without jumps of a full turn. */
static void unwind_reference(rumo_controller *ctl, const double *x) {
    const int ny = ctl->s.ny;
    for (int r = 0; r < ny; ++r) {
        const int state = ctl->problem.output_states[r];
        if (state < 0) continue;
        double before = ctl->has_reference ? ctl->begins[r] : isfinite(x[state]) ? x[state] : ctl->last_reference[r];
        for (int k = 0; k <= ctl->s.N; ++k) {
            double *wanted = ctl->last_reference + k * ny + r;
            before = *wanted = next_to(*wanted, ctl->problem.sensors.turn[state], before);
        }
        ctl->begins[r] = ctl->last_reference[r];
    }
}

/* What is wanted can be expected at the next sample too, whatever the measurement x is worth. */
static int keep_reference(rumo_controller *ctl, const double *reference, const double *x) {
    const int count = (ctl->s.N + 1) * ctl->s.ny;
    if (all_finite(reference, count)) copy(ctl->last_reference, reference, count);
    else if (is_usable(ctl, reference)) fill_reference(ctl, reference);
    else return 0;
    unwind_reference(ctl, x);
    return ctl->has_reference = 1;
}

static rumo_status attempt(rumo_controller *ctl, const double *measured, const double *given, rumo_plan *plan) {
    const dims *s = &ctl->s;
    double *x = unwound(&ctl->guard, measured);
    const rumo_status finite = finite_sample(&ctl->guard, keep_reference(ctl, given, x));
    if (finite != RUMO_OPTIMAL) return finite;
    const double *reference = ctl->last_reference;
    const int near = is_near(&ctl->guard, x);
    if (!near) solver_of(&ctl->problem.sizes)->reach(&ctl->solving, gate_stages(s), ctl->near_reach);
    if (!plausible(&ctl->guard, x, near ? NULL : ctl->near_reach)) return RUMO_BAD_MEASUREMENT;
    bring_to_now(&ctl->guard, x);
    ctl->wary = ctl->guard.surprised || ctl->moved_later > SETTLED;
    ctl->moved_later = 0.0;
    ctl->last_step = NAN; /* a step at another sample says nothing of this one's iterations */
    const int guessed = ctl->guard.has_guess && (!ctl->still || is_plain(ctl) || is_over(ctl->end));
    const rumo_status status = guessed ? try_guess(ctl, x, reference, plan) : try_start(ctl, x, reference, plan);
    if (!guessed || is_plain(ctl) || status <= RUMO_BUDGET_EXCEEDED || is_over(ctl->end)) return status;
    return try_start(ctl, x, reference, plan);
}

/* What is applied, and the guess that comes of it. */
static void conclude(rumo_controller *ctl, rumo_status cause, rumo_plan *plan) {
    const dims *s = &ctl->s;
    const rumo_guard *g = &ctl->guard;
    const int solved = ctl->proposed && cause <= RUMO_BUDGET_EXCEEDED;
    if (!solved) {
        for (int i = 0; i < rest_of_plan(s); ++i) plan_constraints(ctl)[i] = NAN;
        ctl->last_step = NAN;
    }
    plan->cause = cause;
    plan->status = follow(&ctl->guard, solved, cause);
    if (!solved && g->has_next) show_algebraic(ctl);
    if (g->has_next) set_guess(ctl, g->next_u, g->next_x, g->next_inner);
    ctl->prepared = ctl->has_stored = ctl->still = 0;
    ctl->behind = 1;
}

static const double *taken_measurement(const rumo_controller *ctl) { return ctl->guard.taken; }

static const double *wanted_beginnings(const rumo_controller *ctl) { return ctl->begins; }

/* A plan found elsewhere in place of the last step's: what the solver keeps belongs to that one. */
RARE static rumo_status adopt(rumo_controller *ctl, const double *u, const double *x, const double *inner, rumo_status status) {
    const dims *s = &ctl->s;
    const rumo_guard *g = &ctl->guard;
    take_back(&ctl->guard);
    copy(plan_u(ctl), u, s->N * s->nu);
    copy(plan_x(ctl), x, (s->N + 1) * s->nx);
    inner_to_lanes(s, inner, ctl->inner);
    const rumo_status followed = follow(&ctl->guard, 1, status);
    /* The next readings depend on it as on this plan, not as on what was linearised for the other. */
    set_guess(ctl, plan_u(ctl), plan_x(ctl), ctl->inner);
    if (!linearise(&ctl->stages, last_decided(g), INFINITY)) ctl->guard.monitor.due = 0;
    set_guess(ctl, g->next_u, g->next_x, g->next_inner);
    ctl->prepared = ctl->has_stored = ctl->still = ctl->behind = 0;
    ctl->last_step = NAN;
    solver_of(&ctl->problem.sizes)->forget(&ctl->solving);
    return followed;
}

static double end_of_step(const rumo_controller *ctl) {
    const double seconds = ctl->settings.seconds;
    return seconds < INFINITY ? seconds_now() + seconds : INFINITY;
}

/* Whenever the preparation is over, since no one waits for it. */
static void prepare(rumo_controller *ctl) {
    ctl->end = INFINITY;
    prepare_in_time(ctl);
}

/* Complete a step, for which there is a budget of time. */
static void complete(rumo_controller *ctl, const double *x, const double *reference, int was_prepared, rumo_plan *plan) {
    const double start = seconds_now();
    ctl->proposed = 0;
    plan->numbers = ctl->numbers;
    plan->count = size_of_plan(&ctl->s);
    plan->iterations = plan->conflicts = 0;
    plan->conflict = NULL;
    const rumo_status status = attempt(ctl, x, reference, plan);
    conclude(ctl, status, plan);
    plan->health = ctl->guard.health;
    plan->symptoms = ctl->guard.symptoms;
    plan->prepare_seconds = ctl->prepare_seconds;
    plan->linearize_seconds = ctl->linearize_seconds;
    plan->feedback_seconds = seconds_now() - start;
    plan->waited_seconds = plan->feedback_seconds + (was_prepared ? 0.0 : plan->prepare_seconds);
}

static void feedback(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan) {
    const int was_prepared = ctl->prepared;
    ctl->end = end_of_step(ctl);
    if (!was_prepared) prepare_in_time(ctl);
    complete(ctl, x, reference, was_prepared, plan);
}

static void step(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan) {
    ctl->end = end_of_step(ctl);
    if (!ctl->guard.has_guess && all_finite(x, ctl->s.nx)) start_guess(ctl, unwound(&ctl->guard, x));
    const int was_prepared = ctl->prepared;
    if (!was_prepared) prepare_in_time(ctl);
    complete(ctl, x, reference, was_prepared, plan);
}

#endif
