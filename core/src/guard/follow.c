/* What is applied whatever happened: the plan, else the one before, shifted, else the safe input. */
#ifndef RUMO_FOLLOW_C
#define RUMO_FOLLOW_C

#include "controller.h"
#include "guard/shift.c"
#include "stages/inner.c"

/* The inputs nearest to u (count, nu) that respect bounds (count, nu) and move bounds, one after the other; move
 * bounds of the next lie `next` numbers on. */
static void make_admissible(int nu, const double *before, const double *lower, const double *upper, const double *move_lower,
                            const double *move_upper, int next, double *u, int count) {
    for (int k = 0; k < count; ++k, lower += nu, upper += nu, move_lower += next, move_upper += next) {
        for (int j = 0; j < nu; ++j) {
            const double wanted = u[k * nu + j], move = wanted - before[j];
            /* An admissible input stays what it is; a move may be as large as numbers get. */
            const double reached = move < move_lower[j]   ? before[j] + move_lower[j]
                                   : move > move_upper[j] ? before[j] + move_upper[j]
                                                          : wanted;
            u[k * nu + j] = clip(reached, lower[j], upper[j]);
        }
        before = u + k * nu;
    }
}

/* Complete the plan: `solved` says whether numbers hold a solution. Then shift it into the next guess. */
static void follow(rumo_controller *ctl, int solved, rumo_status status, rumo_plan *plan) {
    const dims *s = &ctl->s;
    const int N = s->N, d = s->d, nx = s->nx, nu = s->nu, decided = decided_inputs(s);
    const rumo_bounds *bounds = &ctl->problem.numbers.bounds;
    double *u = plan_u(ctl), *x = plan_x(ctl), *last = ctl->applied + (decided - 1) * nu;
    plan->cause = status;
    if (solved) {
        ctl->inputs_left = N - d - 1;
    } else {
        for (int i = 0; i < rest_of_plan(s); ++i) plan_constraints(ctl)[i] = NAN;
        ctl->last_step = NAN;
        if (ctl->has_previous && ctl->inputs_left > 0) {
            copy(u, ctl->previous_u, N * nu);
            copy(x, ctl->previous_x, (N + 1) * nx);
            adopt_inner(ctl, ctl->previous_inner);
            --ctl->inputs_left;
        } else {
            for (int i = 0; i < N * nu; ++i) u[i] = bounds->safe_input[i % nu];
            for (int i = 0; i < (N + 1) * nx; ++i) x[i] = NAN;
            status = RUMO_PLAN_EXHAUSTED;
        }
    }
    copy(u, ctl->applied, d * nu);
    make_admissible(nu, last, bounds->input_lower + d * nu, bounds->input_upper + d * nu, bounds->move_lower, bounds->move_upper, 0,
                    u + d * nu, N - d);
    const double *command = u + d * nu;
    memmove(ctl->applied, ctl->applied + nu, (size_t)((decided - 1) * nu) * sizeof(double));
    copy(last, command, nu);

    plan->status = status;
    ++ctl->counts[status];
    ctl->has_previous = status != RUMO_PLAN_EXHAUSTED;
    if (ctl->has_previous) {
        shift_plan(ctl);
        copy(ctl->guess_u, ctl->previous_u, N * nu);
        copy(ctl->guess_x, ctl->previous_x, (N + 1) * nx);
        copy(ctl->guess_inner, ctl->previous_inner, s->ni * s->lanes);
    }
    /* A guess from which the solver came to nothing is not kept: the next measurement gives a new one, at rest. If that
     * fails too, the shifted plan is the better guess, until there is a solution. */
    const int fruitless = !solved && (plan->cause == RUMO_SOLVER_FAILED || plan->cause == RUMO_BUDGET_EXCEEDED);
    ctl->blameless = !solved && (ctl->blameless || (fruitless && ctl->resting));
    ctl->has_guess = ctl->has_previous && (!fruitless || ctl->blameless);
    ctl->resting = ctl->prepared = 0;
}

#endif
