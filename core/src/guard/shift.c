/* A plan one sample later. */
#ifndef RUMO_SHIFT_C
#define RUMO_SHIFT_C

#include "controller.h"

/* On the straight line between the states at two stages. */
static inline double between(const double *x, int nx, int signal, double node) {
    return (1.0 - node) * x[signal] + node * x[nx + signal];
}

/* One sample later: values of states keep their distance from the straight line between the ends of their interval. */
static void shift_inner(const rumo_controller *ctl) {
    const dims *s = &ctl->s;
    for (int i = 0; i < s->ni; ++i) {
        const double *from = ctl->inner + (ptrdiff_t)i * s->lanes, node = ctl->problem.inner_nodes[i];
        double *to = ctl->previous_inner + (ptrdiff_t)i * s->lanes;
        const int signal = ctl->problem.inner_signals[i];
        for (int k = 0; k < s->lanes; ++k) {
            const int here = k < s->N ? k : s->N - 1, j = ctl->problem.shift.intervals[here];
            to[k] = from[j];
            if (signal >= s->nx) continue;
            const double moved = between(ctl->previous_x + here * s->nx, s->nx, signal, node) +
                                 (from[j] - between(plan_x(ctl) + j * s->nx, s->nx, signal, node));
            if (isfinite(moved)) to[k] = moved;
        }
    }
}

/* One sample later: the last input stays, the last state is extrapolated. */
static void shift_plan(rumo_controller *ctl) {
    const dims *s = &ctl->s;
    const rumo_shift *shift = &ctl->problem.shift;
    const int rest = shift->same_rows ? s->N - 1 : 0; /* those before are copied */
    copy(ctl->previous_u, plan_u(ctl) + s->nu, rest * s->nu);
    copy(ctl->previous_x, plan_x(ctl) + s->nx, (rest ? s->N : 0) * s->nx);
    for (int k = rest; k < s->N; ++k) copy(ctl->previous_u + k * s->nu, plan_u(ctl) + shift->intervals[k] * s->nu, s->nu);
    for (int k = rest ? s->N : 0; k <= s->N; ++k) {
        const double *begin = plan_x(ctl) + shift->stages[k] * s->nx, *end = begin + s->nx;
        for (int r = 0; r < s->nx; ++r) {
            const double x = begin[r] + shift->shares[k] * (end[r] - begin[r]);
            ctl->previous_x[k * s->nx + r] = isfinite(x) ? x : end[r];
        }
    }
    shift_inner(ctl);
}

#endif
