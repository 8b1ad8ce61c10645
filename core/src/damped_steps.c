/* Steps damped so that each is worth it where its inputs lead: Levenberg's and Marquardt's method, with dynamics that hold.
 *
 * Where forces saturate, what cut steps add up to the dynamics do not follow: on the way from states that hold them to states
 * that the linearisation promises there may be none that is worth it, however short the way. Source: Nocedal and Wright (2006),
 * sections 4.1 and 10.3. */
#ifndef RUMO_DAMPED_STEPS_C
#define RUMO_DAMPED_STEPS_C

#include "merit.c"
#include "settled.c"
#include "stages/roll_out.c"

/* A step keeps its promise, or hardly, above and below these shares of it. */
#define PROMISE_KEPT 0.75
#define HARDLY_KEPT 0.25
/* Damping of what promised too much, over the one before, and of what kept its promise; the share of the first at which it goes. */
#define DAMPED_MORE 4.0
#define DAMPED_LESS 0.25
#define UNDAMPED 1e-3

/* Where the guess's inputs lead, and linearise there; 0 if that comes to nothing. */
static int roll_guess_out(rumo_controller *ctl) {
    return roll_out(&ctl->stages, last_decided(&ctl->guard), ctl->step.dx, ctl->step.du, ctl->way_inner, ctl->end);
}

/* Damping at which a step costs as much as it promises to be worth. */
static double damping_for(const rumo_controller *ctl, double less) {
    const dims *s = &ctl->s;
    const double *scales = ctl->problem.numbers.input_scales, *was = ctl->stages.guess_values;
    double squares = 0.0;
    values_of_blocks(&ctl->stages, plan_u(ctl), ctl->values);
    for (int i = 0; i < s->n; ++i) {
        const double before = i < s->nu ? 0.0 : ctl->values[i - s->nu] - was[i - s->nu];
        const double more = (ctl->values[i] - was[i] - before) / scales[i % s->nu];
        squares += more * more;
    }
    return squares > 0.0 && less > 0.0 ? less / squares : 0.0;
}

/* The next damping, after a step that was worth this share of what it promised; `first` is the least at once. */
static double damping_after(double damping, double first, double share) {
    if (!(share >= SHARE_HELD)) return damping > 0.0 ? DAMPED_MORE * damping : first;
    if (share < HARDLY_KEPT) return damping > 0.0 ? 2.0 * damping : 0.1 * first;
    if (share < PROMISE_KEPT) return damping;
    return damping > UNDAMPED * first ? DAMPED_LESS * damping : 0.0;
}

/* What it is worth where the guess's inputs lead; infinite if that comes to nothing. */
static double merit_of_way(rumo_controller *ctl, const double *reference, double price) {
    return roll_guess_out(ctl) ? priced(worth_of_guess(ctl, reference), price) : INFINITY;
}

/* Linearise where the inputs lead of the guess that was first, or of the one that is kept, whichever is worth more; 0 if both
 * come to nothing. */
static int choose_way(rumo_controller *ctl, const double *reference, double price) {
    take_up(ctl, &ctl->first);
    const double of_first = merit_of_way(ctl, reference, price);
    take_up(ctl, &ctl->from);
    const double merit = merit_of_way(ctl, reference, price);
    if (merit <= of_first) return merit < INFINITY;
    take_up(ctl, &ctl->first);
    return roll_guess_out(ctl);
}

/* Iterations with damped steps, from where inputs lead to where each step's do; SOLVER_FAILED if none does, else
 * UNTRUSTED if nothing settles, with where they have come to as the guess. */
RARE static rumo_status take_damped_steps(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan,
                                          int iterations, double price) {
    const stage_solver *solver = solver_of(&ctl->problem.sizes);
    double damping = 0.0, first = 0.0, before = NAN;
    int led_on = 0;
    if (!choose_way(ctl, reference, price) || make_ready(ctl) != RUMO_OPTIMAL) {
        take_up(ctl, &ctl->from);
        return RUMO_SOLVER_FAILED;
    }
    ctl->last_step = NAN;
    for (;;) {
        const rumo_status status = iterate_again(ctl, x, reference, plan);
        if (!is_solved(status)) break;
        ++iterations;
        if (damping == 0.0 && is_settled(ctl, iterations, before)) return status;
        keep_rest(ctl);
        if (is_last(ctl, iterations)) break;
        const promise made = promise_at(ctl, reference, &price);
        const double size = ctl->step.size;
        if (first == 0.0) first = damping_for(ctl, made.less);
        keep(ctl, &ctl->from);
        guess_plan(ctl);
        const double more = merit_of_way(ctl, reference, price) - made.merit;
        const double share = made.promises ? -more / made.less : more < INFINITY ? 1.0 : 0.0;
        const int held = share >= SHARE_HELD;
        led_on |= held;
        before = damping == 0.0 && held ? size : NAN;
        if (isnan(before)) ctl->last_step = NAN;
        damping = damping_after(damping, first, share);
        if (!held) take_up(ctl, &ctl->from);
        if (!held && (damping == 0.0 || !linearise(&ctl->stages, last_decided(&ctl->guard), ctl->end))) break;
        solver->damp(&ctl->solving, damping);
        if (make_ready(ctl) != RUMO_OPTIMAL) break;
    }
    solver->damp(&ctl->solving, 0.0);
    return led_on ? RUMO_UNTRUSTED : RUMO_SOLVER_FAILED;
}

#endif
