/* A plan one sample later. */
#ifndef RUMO_SHIFT_C
#define RUMO_SHIFT_C

#include "guard/guard.h"

/* On the straight line between the states at two stages. */
static inline double between(const double *x, int nx, int signal, double node) {
    return (1.0 - node) * x[signal] + node * x[nx + signal];
}

/* Unknowns of the intervals from (N, ni) to lanes. */
static void inner_to_lanes(const dims *s, const double *rows, double *lanes) {
    for (int i = 0; i < s->ni; ++i)
        for (int k = 0; k < s->lanes; ++k) lanes[i * s->lanes + k] = rows[(k < s->N ? k : s->N - 1) * s->ni + i];
}

/* One sample later: values of states keep their distance from the straight line between the ends of their interval. */
static void shift_inner(const rumo_guard *g) {
    const dims *s = &g->s;
    const int rest = g->data.shift.same_rows ? s->N - 1 : 0; /* those before have the same ends */
    for (int i = 0; i < s->ni; ++i) {
        const double *from = g->inner + (ptrdiff_t)i * s->lanes, node = g->data.inner_nodes[i];
        double *to = g->next_inner + (ptrdiff_t)i * s->lanes;
        const int signal = g->data.inner_signals[i];
        copy(to, from + 1, rest);
        for (int k = rest; k < s->N; ++k) {
            const int j = g->data.shift.intervals[k];
            to[k] = from[j];
            if (signal >= s->nx) continue;
            const double moved = between(g->next_x + k * s->nx, s->nx, signal, node) +
                                 (from[j] - between(g->x + j * s->nx, s->nx, signal, node));
            if (isfinite(moved)) to[k] = moved;
        }
        for (int k = s->N; k < s->lanes; ++k) to[k] = to[s->N - 1];
    }
}

/* One sample later: the last input stays, the last state is extrapolated. */
static void shift_plan(rumo_guard *g) {
    const dims *s = &g->s;
    const rumo_shift *shift = &g->data.shift;
    const int rest = shift->same_rows ? s->N - 1 : 0; /* those before are copied */
    copy(g->next_u, g->u + s->nu, rest * s->nu);
    copy(g->next_x, g->x + s->nx, (rest ? s->N : 0) * s->nx);
    for (int k = rest; k < s->N; ++k) copy(g->next_u + k * s->nu, g->u + shift->intervals[k] * s->nu, s->nu);
    for (int k = rest ? s->N : 0; k <= s->N; ++k) {
        const double *begin = g->x + shift->stages[k] * s->nx, *end = begin + s->nx;
        for (int r = 0; r < s->nx; ++r) {
            const double x = begin[r] + shift->shares[k] * (end[r] - begin[r]);
            g->next_x[k * s->nx + r] = isfinite(x) ? x : end[r];
        }
    }
    shift_inner(g);
}

#endif
