/* Steps cut so that each is worth it on the nonlinear problem: a line search on the merit, states and inputs alike. */
#ifndef RUMO_CUT_STEPS_C
#define RUMO_CUT_STEPS_C

#include "merit.c"
#include "settled.c"

/* How often a step is cut, and the share of all iterations after which no other is. */
#define CUTS 12
#define CUT_ITERATIONS 0.75

/* The guess is a share of the way from the one that was kept to the plan. */
static void set_on_the_way(rumo_controller *ctl, double share) {
    const dims *s = &ctl->s;
    stage_maps *m = &ctl->stages;
    const double *u = plan_u(ctl), *x = plan_x(ctl);
    for (int i = 0; i < s->N * s->nu; ++i) m->guess_u[i] = ctl->from.u[i] + share * (u[i] - ctl->from.u[i]);
    for (int i = s->nx; i < (s->N + 1) * s->nx; ++i) m->guess_x[i] = ctl->from.x[i] + share * (x[i] - ctl->from.x[i]);
    for (int i = 0; i < s->ni * s->lanes; ++i)
        m->guess_inner[i] = ctl->from.inner[i] + share * (ctl->inner[i] - ctl->from.inner[i]);
}

/* Linearise where the plan's step is worth it, from the guess at which the stages are linearised; the share taken, 0 if there
 * is none. The guess that it is from is kept, and *price raised to what that needs. */
static double take_step(rumo_controller *ctl, const double *reference, double *price) {
    const promise made = promise_at(ctl, reference, price);
    keep(ctl, &ctl->from);
    double share = 1.0;
    for (int i = 0; i < CUTS && !is_over(ctl->end); ++i) {
        set_on_the_way(ctl, share);
        double more = INFINITY;
        if (linearise(&ctl->stages, last_decided(&ctl->guard), ctl->end)) {
            more = priced(worth_of_guess(ctl, reference), *price) - made.merit;
            if (!made.promises || more <= -SHARE_HELD * share * made.less) return share;
        }
        /* Where a parabola through both, with the slope that was promised, has its minimum. */
        const double best = 0.5 * share * share * made.less / (more + share * made.less);
        share = best > 0.3 * share ? smaller(best, 0.5 * share) : 0.3 * share;
    }
    take_up(ctl, &ctl->from);
    return 0.0;
}

/* Whether iterations that are left are for damped steps: the last step was cut to this share, and is not a short one. */
static int is_time_to_damp(const rumo_controller *ctl, int iterations, double share) {
    const double most = larger(ctl->settings.settling_iterations, ctl->settings.sqp_iterations);
    return share < 1.0 && ctl->step.size > SETTLED_STEP && iterations > CUT_ITERATIONS * most;
}

/* Iterations with cut steps, from a guess made ready; UNTRUSTED if they come to nothing, with where they have come to as the
 * guess. */
RARE static rumo_status take_cut_steps(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan,
                                       int *iterations, double *price) {
    double before = NAN, share = 1.0;
    ctl->last_step = NAN;
    rumo_status status = iterate_again(ctl, x, reference, plan);
    if (!is_solved(status)) return status;
    while (!is_settled(ctl, ++*iterations, before)) {
        keep_rest(ctl);
        const int enough = is_last(ctl, *iterations) || is_time_to_damp(ctl, *iterations, share);
        share = enough ? 0.0 : take_step(ctl, reference, price);
        before = share == 1.0 ? ctl->step.size : NAN;
        if (share < 1.0) ctl->last_step = NAN;
        if (share == 0.0 || make_ready(ctl) != RUMO_OPTIMAL || !is_solved(status = iterate_again(ctl, x, reference, plan)))
            return RUMO_UNTRUSTED;
    }
    return status;
}

#endif
