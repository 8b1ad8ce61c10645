/* What is applied whatever happened: the plan, else the one before, shifted, else the safe input. */
#ifndef RUMO_FOLLOW_C
#define RUMO_FOLLOW_C

#include "base/admissible.h"
#include "guard/age.c"
#include "guard/guard.h"
#include "guard/shift.c"

/* Complete the plan: `solved` says whether it is a solution, and the cause how far the solver got. Returns the status of
 * what is applied, and shifts the plan into what is followed next. */
static rumo_status follow(rumo_guard *g, int solved, rumo_status cause) {
    const dims *s = &g->s;
    const rumo_bounds *bounds = &g->data.bounds;
    const int N = s->N, d = s->d, nx = s->nx, nu = s->nu, decided = decided_inputs(s);
    double *u = g->u, *x = g->x, *last = g->applied + (decided - 1) * nu;
    rumo_status status = cause;
    copy(g->was_applied, g->applied, decided * nu);
    if (solved) {
        correct_ways(g);
        g->astray = cause == RUMO_UNTRUSTED;
        g->inputs_left = N - d - 1;
    } else if (g->has_next && g->inputs_left > 0) {
        copy(u, g->next_u, N * nu);
        copy(x, g->next_x, (N + 1) * nx);
        copy(g->inner, g->next_inner, s->ni * s->lanes);
        --g->inputs_left;
    } else {
        for (int i = 0; i < N * nu; ++i) u[i] = bounds->safe_input[i % nu];
        for (int i = 0; i < (N + 1) * nx; ++i) x[i] = NAN;
        for (int i = 0; i < s->ni * s->lanes; ++i) g->inner[i] = NAN;
        status = RUMO_PLAN_EXHAUSTED;
    }
    copy(u, g->applied, d * nu);
    make_admissible(nu, last, bounds->input_lower + d * nu, bounds->input_upper + d * nu, bounds->move_lower,
                    bounds->move_upper, 0, u + d * nu, N - d);
    const double *command = u + d * nu;
    memmove(g->applied, g->applied + nu, (size_t)((decided - 1) * nu) * sizeof(double));
    copy(last, command, nu);

    ++g->counts[g->followed = (int)status];
    g->has_next = status != RUMO_PLAN_EXHAUSTED;
    if (g->has_next) shift_plan(g);
    follow_way(g, solved);
    g->monitor.due = 1;
    for (int r = 0; g->has_next && r < nx; ++r) g->moved[r] = fabs(g->next_x[r] - x[r]);
    /* A guess from which the solver came to nothing is not kept: the next measurement gives a new one, at rest. If that
     * fails too, the shifted plan is the better guess, until there is a solution. One that had no time is not to blame. */
    const int fruitless = !solved && cause > RUMO_BUDGET_EXCEEDED && cause <= RUMO_SOLVER_FAILED;
    g->blameless = !solved && (g->blameless || (fruitless && g->resting));
    g->has_guess = g->has_next && (!fruitless || g->blameless);
    g->resting = 0;
    g->settled = g->settles;
    return status;
}

/* Undo what was applied at the last sample: another plan is to be followed at the same one. */
RARE static void take_back(rumo_guard *g) {
    if (g->followed < 0) return;
    --g->counts[g->followed];
    copy(g->applied, g->was_applied, decided_inputs(&g->s) * g->s.nu);
    take_back_way(g);
    g->followed = -1;
}

#endif
