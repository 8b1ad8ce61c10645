/* A step that is safeguarded: where the first iteration is not to be trusted, others follow.
 *
 * At first full steps, while each is less than half the one before: Newton's method where it converges. Else from the guess
 * again, with steps cut so that each is worth it on the nonlinear problem (merit.c). */
#ifndef RUMO_SETTLE_C
#define RUMO_SETTLE_C

#include "guard/stray.c"
#include "iterate.c"
#include "merit.c"
#include "stages/roll_out.c"

/* Settled: what is left of the inputs' changes over their ranges or, where that is not known, the last change. */
#define SETTLED 0.01
#define SETTLED_STEP 1e-3
/* The share of what a step promises that it has to hold; how often it is cut; promises that are rounding, over the merit. */
#define SHARE_HELD 0.1
#define CUTS 12
#define NO_PROMISE 1e-12

/* Whether steps are taken as they come, and not judged. */
static inline int is_plain(const rumo_controller *ctl) { return isinf(ctl->settings.trusted_step); }

/* Whether no further iteration is needed, this one's step being full, and the one before `before` long, NaN if that is not
 * known. */
static inline int is_settled(const rumo_controller *ctl, int iterations, double before) {
    const double size = ctl->step.size;
    if (iterations < ctl->settings.sqp_iterations && !(change(ctl) < ctl->settings.sqp_tolerance)) return 0;
    if (!(ctl->straying < STRAYED)) return 0;
    if (iterations == 1 && ctl->wary) return 0;
    if (iterations == 1 && size <= ctl->settings.trusted_step) return 1;
    if (iterations > 1 && !(change(ctl) < STRAYED)) return 0; /* states may go on where all inputs are at bounds */
    return size <= SETTLED_STEP || error_left(before, size) <= SETTLED;
}

/* Whether there is to be no other, however things are. */
static int is_last(const rumo_controller *ctl, int iterations) {
    const rumo_settings *set = &ctl->settings;
    return (iterations >= set->sqp_iterations && iterations > set->settling_iterations) || is_over(ctl->end);
}

/* Keep the guess, for steps from there. */
static void keep_from(rumo_controller *ctl) { copy_guess(ctl, ctl->from_u, ctl->from_x, ctl->from_inner); }

static void set_from(rumo_controller *ctl) { set_guess(ctl, ctl->from_u, ctl->from_x, ctl->from_inner); }

/* What is known is not guessed. */
static void set_known(rumo_controller *ctl, const double *x) {
    copy(ctl->stages.guess_x, x, ctl->s.nx);
    copy(ctl->stages.guess_u, ctl->guard.applied, ctl->s.d * ctl->s.nu);
}

/* An iteration after the first of a sample. */
static rumo_status iterate_again(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan) {
    const rumo_status status = iterate(ctl, x, reference, plan);
    if (is_solved(status)) ctl->moved_later = larger(ctl->moved_later, ctl->step.size);
    return status;
}

/* The guess is a share of the way from the one that was kept to the plan. */
static void set_on_the_way(rumo_controller *ctl, double share) {
    const dims *s = &ctl->s;
    stage_maps *m = &ctl->stages;
    const double *u = plan_u(ctl), *x = plan_x(ctl);
    for (int i = 0; i < s->N * s->nu; ++i) m->guess_u[i] = ctl->from_u[i] + share * (u[i] - ctl->from_u[i]);
    for (int i = s->nx; i < (s->N + 1) * s->nx; ++i) m->guess_x[i] = ctl->from_x[i] + share * (x[i] - ctl->from_x[i]);
    for (int i = 0; i < s->ni * s->lanes; ++i)
        m->guess_inner[i] = ctl->from_inner[i] + share * (ctl->inner[i] - ctl->from_inner[i]);
}

/* Linearise where the plan's step is worth it, from the guess at which the stages are linearised; the share taken, 0 if there
 * is none. The guess that it is from is kept, and *price raised to what that needs. */
static double take_step(rumo_controller *ctl, const double *reference, double *price) {
    const worth now = worth_of_guess(ctl, reference), promised = promise_of_step(ctl, reference);
    *price = price_for(now, promised, *price);
    const double merit_now = priced(now, *price), less = merit_now - priced(promised, *price);
    const int promises = less > NO_PROMISE * fabs(merit_now);
    keep_from(ctl);
    double share = 1.0;
    for (int i = 0; i < CUTS && !is_over(ctl->end); ++i) {
        set_on_the_way(ctl, share);
        double more = INFINITY;
        if (linearise(&ctl->stages, last_decided(&ctl->guard), ctl->end)) {
            more = priced(worth_of_guess(ctl, reference), *price) - merit_now;
            if (!promises || more <= -SHARE_HELD * share * less) return share;
        }
        /* Where a parabola through both, with the slope that was promised, has its minimum. */
        const double best = 0.5 * share * share * less / (more + share * less);
        share = best > 0.3 * share ? smaller(best, 0.5 * share) : 0.3 * share;
    }
    set_from(ctl);
    return 0.0;
}

/* The guess is the plan, with constraints as they are there. */
static void show_guess(rumo_controller *ctl) {
    const dims *s = &ctl->s;
    const rumo_problem *p = &ctl->problem;
    const stage_maps *m = &ctl->stages;
    recall_guess(ctl);
    (void)linearise(&ctl->stages, last_decided(&ctl->guard), INFINITY); /* it was there before */
    for (int k = 0; k < s->N; ++k)
        for (int r = 0; r < s->nc; ++r)
            plan_constraints(ctl)[k * s->nc + r] =
                m->terms[(ptrdiff_t)(p->G_first + r) * s->lanes + k] - p->numbers.constraint_limits[k * s->nc + r];
    show_algebraic(ctl);
    plan_diagnostics(ctl)[RUMO_COMMAND_ERROR] = plan_diagnostics(ctl)[RUMO_KKT_RESIDUAL] = NAN;
}

/* Iterations that are worth it, from a guess made ready. Where there is no way on from a guess, there may be one from the state
 * alone: SOLVER_FAILED, so that it is tried. */
RARE static rumo_status globalise(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan,
                                  int iterations) {
    double price = 0.0, before = NAN;
    ctl->last_step = NAN;
    rumo_status status = iterate_again(ctl, x, reference, plan);
    if (!is_solved(status)) return status;
    while (!is_settled(ctl, ++iterations, before)) {
        copy(ctl->guess_rest, plan_constraints(ctl), rest_of_plan(&ctl->s));
        const double share = is_last(ctl, iterations) ? 0.0 : take_step(ctl, reference, &price);
        before = share == 1.0 ? ctl->step.size : NAN;
        if (share < 1.0) ctl->last_step = NAN;
        if (share == 0.0 || make_ready(ctl) != RUMO_OPTIMAL || !is_solved(status = iterate_again(ctl, x, reference, plan))) {
            plan->conflicts = 0; /* those were of a step not taken */
            if (!is_last(ctl, iterations) && !ctl->still) return RUMO_SOLVER_FAILED;
            show_guess(ctl);
            return RUMO_UNTRUSTED;
        }
    }
    return status;
}

/* Iterations with full steps, the first of which has been made; UNTRUSTED if they come to nothing. */
static rumo_status take_full_steps(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan,
                                   rumo_status status, int *iterations) {
    double before = NAN;
    while (!is_settled(ctl, *iterations, before)) {
        const double size = ctl->step.size;
        const int converges = !(size >= CONVERGING * before) || size <= SETTLED_STEP;
        if (is_last(ctl, *iterations) || !converges) return RUMO_UNTRUSTED;
        before = size;
        guess_plan(ctl);
        if (linearize(ctl) != RUMO_OPTIMAL || !is_solved(status = iterate_again(ctl, x, reference, plan))) {
            recall_guess(ctl);
            plan->conflicts = 0; /* those were of a step not taken */
            return RUMO_UNTRUSTED;
        }
        ++*iterations;
    }
    return status;
}

/* After a first iteration that is not to be trusted. */
OUTSIDE static rumo_status settle(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan,
                                  rumo_status status) {
    int iterations = 1;
    if (is_last(ctl, iterations)) return RUMO_UNTRUSTED;
    keep_from(ctl);
    const rumo_status settled = take_full_steps(ctl, x, reference, plan, status, &iterations);
    if (settled != RUMO_UNTRUSTED || is_last(ctl, iterations)) return settled;
    set_from(ctl);
    set_known(ctl, x);
    const rumo_status usable = linearize(ctl);
    return usable == RUMO_OPTIMAL ? globalise(ctl, x, reference, plan, iterations) : usable;
}

/* Iterations as many as are wanted, with full steps, and not judged. */
static rumo_status repeat(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan,
                          rumo_status status) {
    for (int i = 1; i < ctl->settings.sqp_iterations && is_solved(status); ++i) {
        if (change(ctl) < ctl->settings.sqp_tolerance) break;
        guess_plan(ctl);
        if (linearize(ctl) != RUMO_OPTIMAL) break;
        const rumo_status better = iterate(ctl, x, reference, plan);
        if (!is_solved(better)) {
            recall_guess(ctl);
            plan->conflicts = 0; /* that was the other's */
            break;
        }
        status = better;
    }
    return status;
}

/* From a guess made ready. */
static inline rumo_status try_guess(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan) {
    const rumo_status status = iterate(ctl, x, reference, plan);
    if (is_plain(ctl)) return repeat(ctl, x, reference, plan, status);
    return !is_solved(status) || is_settled(ctl, 1, NAN) ? status : settle(ctl, x, reference, plan, status);
}

/* From the state alone: at rest there or, if that costs no more, where the last input leads. */
RARE static rumo_status try_start(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan) {
    ctl->proposed = plan->conflicts = 0;
    if (is_over(ctl->end)) return RUMO_BUDGET_EXCEEDED;
    start_guess(ctl, x);
    if (!is_plain(ctl)) set_known(ctl, x);
    rumo_status usable = linearize(ctl);
    if (!is_plain(ctl)) {
        keep_from(ctl);
        const double cost = usable == RUMO_OPTIMAL ? worth_of_guess(ctl, reference).cost : INFINITY;
        if (roll_out(&ctl->stages, last_decided(&ctl->guard), ctl->step.dx, ctl->step.du, ctl->inner, ctl->end) &&
            worth_of_guess(ctl, reference).cost <= cost) {
            usable = make_ready(ctl);
        } else {
            set_from(ctl);
            usable = linearize(ctl);
        }
    }
    return usable == RUMO_OPTIMAL ? try_guess(ctl, x, reference, plan) : usable;
}

#endif
