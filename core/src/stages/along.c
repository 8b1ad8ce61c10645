/* Along linear stages: from one to the next, and what outputs and constraints are there, as linearised. */
#ifndef RUMO_ALONG_C
#define RUMO_ALONG_C

#include "stages/stages.h"

static inline double entry(const stage_maps *m, const sparse *matrix, int e, int k) {
    return m->terms[(ptrdiff_t)(matrix->first + e) * m->s.lanes + k];
}

/* An output or constraint of stage k at (dx, du), as linearised, less what is wanted or allowed. */
static inline double linearised(const stage_maps *m, int value, int r, const sparse *of_x, const sparse *of_u, int k,
                                const double *dx, const double *du, double less) {
    double y = m->terms[(ptrdiff_t)(value + r) * m->s.lanes + k] - less;
    for (int e = of_x->start[r]; e < of_x->start[r + 1]; ++e) y += entry(m, of_x, e, k) * dx[of_x->column[e]];
    if (du)
        for (int e = of_u->start[r]; e < of_u->start[r + 1]; ++e) y += entry(m, of_u, e, k) * du[of_u->column[e]];
    return y;
}

/* The gradient of a linearised output or constraint of stage k by (dx, du), times a force. */
static inline void add_gradient(const stage_maps *m, const sparse *of_x, const sparse *of_u, int k, int r, double force,
                                double *restrict by_x, double *restrict by_u) {
    for (int e = of_x->start[r]; e < of_x->start[r + 1]; ++e) by_x[of_x->column[e]] += force * entry(m, of_x, e, k);
    for (int e = of_u->start[r]; e < of_u->start[r + 1]; ++e) by_u[of_u->column[e]] += force * entry(m, of_u, e, k);
}

#endif
