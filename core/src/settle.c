/* A step that is safeguarded: where the first iteration is not to be trusted, others follow.
 *
 * At first full steps, while each is less than half the one before: Newton's method where it converges. Else from the guess
 * again, with steps cut so that each is worth it on the nonlinear problem (merit.c). Where none is, or what settles is worse
 * than what the guess's inputs lead to, from there, with steps damped so that each is worth it where its own inputs lead. */
#ifndef RUMO_SETTLE_C
#define RUMO_SETTLE_C

#include "cut_steps.c"
#include "damped_steps.c"
#include "settled.c"

/* What is known is not guessed. */
static void set_known(rumo_controller *ctl, const double *x) {
    copy(ctl->stages.guess_x, x, ctl->s.nx);
    copy(ctl->stages.guess_u, ctl->guard.applied, ctl->s.d * ctl->s.nu);
}

/* The guess is the plan, with constraints as they are there. */
static void show_guess(rumo_controller *ctl) {
    const dims *s = &ctl->s;
    recall_guess(ctl);
    (void)linearise(&ctl->stages, last_decided(&ctl->guard), INFINITY); /* it was there before */
    for (int k = 0; k < s->N; ++k)
        for (int r = 0; r < s->nc; ++r) plan_constraints(ctl)[k * s->nc + r] = constraint_at(ctl, k, r);
    show_algebraic(ctl);
    plan_diagnostics(ctl)[RUMO_COMMAND_ERROR] = plan_diagnostics(ctl)[RUMO_KKT_RESIDUAL] = NAN;
}

/* Whether the guess's free inputs are within bounds and move bounds, and hard constraints hold there. */
static int is_admissible(const rumo_controller *ctl) {
    const dims *s = &ctl->s;
    const stage_maps *m = &ctl->stages;
    const rumo_problem *p = &ctl->problem;
    const rumo_numbers *numbers = &p->numbers;
    int within = 1;
    for (int i = s->d * s->nu; i < s->N * s->nu; ++i) {
        const double room = RUMO_SLACK_TOLERANCE * numbers->input_scales[i % s->nu];
        const double u = m->guess_u[i];
        within &= u >= numbers->bounds.input_lower[i] - room && u <= numbers->bounds.input_upper[i] + room;
    }
    for (int i = 0; i < s->n; ++i) {
        const double room = RUMO_SLACK_TOLERANCE * numbers->input_scales[i % s->nu];
        const double move = move_at(ctl, m->guess_values, i);
        within &= move >= numbers->block_lower[i] - room && move <= numbers->block_upper[i] + room;
    }
    for (int i = 0; i < s->N * s->nc; ++i) {
        const int r = i % s->nc, hard = p->imposed[i] && isinf(numbers->l1[r]);
        within &= !(hard && constraint_at(ctl, i / s->nc, r) > RUMO_SLACK_TOLERANCE * numbers->constraint_scales[r]);
    }
    return within;
}

/* What changes of the inputs may cost that settle for nothing. */
static double cost_of_nothing(const rumo_controller *ctl) {
    const dims *s = &ctl->s;
    double sum = 0.0;
    for (int i = 0; i < s->n; ++i) {
        const double step = SETTLED_STEP * ctl->problem.numbers.input_scales[i % s->nu];
        sum += ctl->problem.numbers.move_weights[i] * step * step;
    }
    return sum;
}

/* Whether what has settled is worse than where the inputs lead of the guess that iterations began with, and that cost this
 * much. What is linearised stays so, set aside meanwhile. */
static int is_worse_than_way(rumo_controller *ctl, const double *x, const double *reference, const kept_guess *begun,
                             double cost, const kept_guess *aside) {
    const double now = promise_of_step(ctl, reference).cost - cost_of_nothing(ctl);
    if (!(now > WORSE * cost)) return 0;
    keep(ctl, aside);
    take_up(ctl, begun);
    set_known(ctl, x);
    const int comparable = roll_guess_out(ctl) && is_admissible(ctl);
    const int worse = comparable && now > WORSE * worth_of_guess(ctl, reference).cost;
    take_up(ctl, aside);
    (void)linearise(&ctl->stages, last_decided(&ctl->guard), INFINITY); /* it was there before */
    return worse;
}

/* Iterations that are worth it, from a guess made ready. Where there is no way on from a guess, there may be one from the state
 * alone: SOLVER_FAILED, so that it is tried. */
RARE static rumo_status globalise(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan,
                                  int iterations) {
    keep(ctl, &ctl->first);
    double price = 0.0;
    const double cost = worth_of_guess(ctl, reference).cost;
    rumo_status status = take_cut_steps(ctl, x, reference, plan, &iterations, &price);
    if (is_solved(status) && is_worse_than_way(ctl, x, reference, &ctl->first, cost, &ctl->from)) {
        keep_rest(ctl);
        status = RUMO_UNTRUSTED;
    }
    if (status != RUMO_UNTRUSTED) return status;
    keep(ctl, &ctl->from);
    if (!is_last(ctl, iterations)) status = take_damped_steps(ctl, x, reference, plan, iterations, price);
    plan->conflicts = 0; /* those were of a step not taken */
    if (status == RUMO_SOLVER_FAILED && !is_last(ctl, iterations) && !ctl->still) return RUMO_SOLVER_FAILED;
    if (!is_solved(status)) show_guess(ctl);
    return is_solved(status) ? status : RUMO_UNTRUSTED;
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
    keep(ctl, &ctl->from);
    const double cost = worth_of_guess(ctl, reference).cost;
    rumo_status settled = take_full_steps(ctl, x, reference, plan, status, &iterations);
    if (is_solved(settled) && is_worse_than_way(ctl, x, reference, &ctl->from, cost, &ctl->first)) settled = RUMO_UNTRUSTED;
    if (settled != RUMO_UNTRUSTED || is_last(ctl, iterations)) return settled;
    take_up(ctl, &ctl->from);
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
        keep(ctl, &ctl->from);
        const double cost = usable == RUMO_OPTIMAL ? worth_of_guess(ctl, reference).cost : INFINITY;
        if (roll_guess_out(ctl) && worth_of_guess(ctl, reference).cost <= cost) {
            usable = make_ready(ctl);
        } else {
            take_up(ctl, &ctl->from);
            usable = linearize(ctl);
        }
    }
    return usable == RUMO_OPTIMAL ? try_guess(ctl, x, reference, plan) : usable;
}

#endif
