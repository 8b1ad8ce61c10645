/* Rows over zeta at the ends of stages: of outputs, (Cx, Cu), or of constraints, (D, E). */
#ifndef RUMO_NODE_ROWS_H
#define RUMO_NODE_ROWS_H

#include "solve/riccati/riccati.h"

RARE static void lay_out_node_rows(arena *a, const dims *s, int rows, int by_x, int by_u, node_rows *n) {
    const int of_v = by_u * (unblocked(s) ? 1 : 2);
    n->rows = rows;
    n->start = alloc_ints(a, rows + 1);
    n->entry = alloc_ints(a, by_x + of_v);
    n->value = (const double **)alloc(a, (size_t)(by_x + of_v) * sizeof *n->value);
    n->mixed = alloc_doubles(a, (ptrdiff_t)of_v * s->lanes);
}

/* Which entries there are. Those of states are terms of the stages; an input is a mixture of v and of the value before. */
RARE static void place_node_rows(const dims *s, const layout *p, const stage_maps *m, const sparse *of_x, const sparse *of_u,
                                 node_rows *n) {
    double *mixed = n->mixed;
    int count = 0;
    for (int i = 0; i < n->rows; ++i) {
        for (int e = of_x->start[i]; e < of_x->start[i + 1]; ++e) {
            n->entry[count] = of_x->column[e];
            n->value[count++] = m->terms + (ptrdiff_t)(of_x->first + e) * s->lanes;
        }
        for (int e = of_u->start[i]; e < of_u->start[i + 1]; ++e)
            for (int v = p->v; v <= p->before; v += s->nu) {
                n->entry[count] = v + of_u->column[e];
                n->value[count++] = mixed;
                mixed += s->lanes;
            }
        n->start[i + 1] = count;
    }
}

/* The entries of inputs, from their terms. */
static void mix_node_rows(const dims *s, const stage_maps *m, const sparse *of_u, const double *scales, node_rows *n) {
    const rumo_blocking *held = &m->problem->blocking;
    double *restrict mixed = n->mixed;
    for (int e = 0; e < of_u->start[n->rows]; ++e) {
        const double *restrict term = m->terms + (ptrdiff_t)(of_u->first + e) * s->lanes, scale = scales[of_u->column[e]];
        for (int k = 0; k < s->lanes; ++k) mixed[k] = scale * term[k];
        mixed += s->lanes;
        if (unblocked(s)) continue;
        for (int k = 0; k < s->N; ++k) {
            const double share = share_at(s, held, k);
            mixed[k] = (1.0 - share) * mixed[k - s->lanes];
            mixed[k - s->lanes] *= share;
        }
        mixed += s->lanes;
    }
}

/* (zeta,) += part of row i of stage k. */
static inline void add_node_row(const node_rows *n, int i, int k, double part, double *restrict row) {
    for (int e = n->start[i]; e < n->start[i + 1]; ++e) row[n->entry[e]] += part * n->value[e][k];
}

/* y += a x, lane by lane. */
static inline void add_lanes(double *restrict y, const double *restrict a, const double *restrict x, int lanes) {
    for (int k = 0; k < lanes; k += LANES)
        for (int l = 0; l < LANES; ++l) y[k + l] += a[k + l] * x[k + l];
}

/* y (lanes,) += row i times zeta (zeta, lanes). */
static inline void add_node_values(const node_rows *n, int i, const double *restrict zeta, int lanes, double *restrict y) {
    for (int e = n->start[i]; e < n->start[i + 1]; ++e)
        add_lanes(y, n->value[e], zeta + (ptrdiff_t)n->entry[e] * lanes, lanes);
}

/* slope (zeta, lanes) += force (lanes,) times row i. */
static inline void add_node_forces(const node_rows *n, int i, const double *restrict force, int lanes,
                                   double *restrict slope) {
    for (int e = n->start[i]; e < n->start[i + 1]; ++e)
        add_lanes(slope + (ptrdiff_t)n->entry[e] * lanes, n->value[e], force, lanes);
}

#endif
