/* Along linear stages: from one to the next, and what outputs and constraints are there, as linearised. */
#ifndef RUMO_ALONG_C
#define RUMO_ALONG_C

#include "stages/stages.h"

/* The stages' maps (entries, lanes) to the columns of each stage. */
static void spread(const dims *s, const sparse *map, const int *row, const double *restrict maps, double *restrict stages) {
    for (int e = 0; e < map->start[s->rows]; ++e) {
        double *restrict place = stages + map->column[e] * s->ldx + row[e];
        const double *restrict values = maps + (ptrdiff_t)e * s->lanes;
        for (int k = 0; k < s->N; ++k) place[(ptrdiff_t)k * s->width * s->ldx] = values[k];
    }
}

/* dx of a stage from dx of the one before; du may be NULL for none. */
static inline void advance(const dims *s, const double *restrict stage, const double *restrict before,
                           const double *restrict du, double *restrict dx) {
    for (int r = 0; r < s->ldx; r += LANES) {
        double even[LANES], odd[LANES] = {0.0}; /* two sums, so that one need not wait for the other */
        const double *restrict column = stage + r;
        copy(even, stage + (ptrdiff_t)(s->width - 1) * s->ldx + r, LANES);
        int c = 0;
        for (; c + 1 < s->nx; c += 2, column += 2 * s->ldx) {
            for (int l = 0; l < LANES; ++l) even[l] += before[c] * column[l];
            for (int l = 0; l < LANES; ++l) odd[l] += before[c + 1] * column[s->ldx + l];
        }
        if (c < s->nx) {
            for (int l = 0; l < LANES; ++l) even[l] += before[c] * column[l];
            column += s->ldx;
        }
        for (int j = 0; du && j < s->nu; ++j, column += s->ldx)
            for (int l = 0; l < LANES; ++l) odd[l] += du[j] * column[l];
        for (int l = 0; l < LANES; ++l) dx[r + l] = even[l] + odd[l];
    }
}

/* The same of stage k, whether there are maps, as columns in `stages`, or equations to be solved. */
static inline void advance_stage(const stage_maps *m, const dims *s, const double *stages, int k, const double *before,
                                 const double *du, double *dx) {
    if (is_wide(m)) advance_interval(&m->equations, k, before, du, dx);
    else advance(s, stages + (ptrdiff_t)k * s->width * s->ldx, before, du, dx);
}

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

#endif
