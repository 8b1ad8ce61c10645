/* How far a linearised guess is from satisfying the dynamics. */
#ifndef RUMO_DEFECTS_C
#define RUMO_DEFECTS_C

#include "stages/stages.h"

/* Newton's corrections of state r at the ends of all intervals (lanes,), NULL if they are none. */
static inline const double *defects_of(const stage_maps *m, int r) {
    if (is_wide(m)) return m->correction + (ptrdiff_t)r * m->s.lanes;
    const int e = m->map.start[r + 1] - 1; /* the last entry of a row is c, if it has one */
    return e >= m->map.start[r] && m->map.column[e] == m->s.width - 1 ? m->maps + (ptrdiff_t)e * m->s.lanes : NULL;
}

/* The largest size of a number of any interval but the last. */
static double largest_before_last(const double *lanes, int N) {
    const int whole = (N - 1) / LANES * LANES;
    double largest = largest_size(lanes, whole);
    for (int k = whole; k + 1 < N; ++k) largest = larger(largest, fabs(lanes[k]));
    return largest;
}

/* How far the guess is from satisfying the dynamics, over the reach of the inputs; but not where it is extrapolated. */
static double straying(const stage_maps *m) {
    double worst = 0.0;
    for (int r = 0; r < m->s.nx; ++r) {
        const double *c = defects_of(m, r);
        if (c && m->reach[r] > 0.0) worst = larger(worst, largest_before_last(c, m->s.N) / m->reach[r]);
    }
    return worst;
}

/* The state and algebraic variables dx (ldx,) at the end of interval k, after `before` (nx,) and the guess's inputs. */
static void advance_guess_stage(const stage_maps *m, int k, const double *before, double *dx) {
    const dims *s = &m->s;
    if (is_wide(m)) {
        advance_interval(&m->equations, k, before, NULL, dx);
        return;
    }
    for (int r = 0; r < s->rows; ++r) {
        dx[r] = 0.0;
        for (int e = m->map.start[r]; e < m->map.start[r + 1]; ++e) {
            const int column = m->map.column[e];
            const double factor = column < s->nx ? before[column] : column == s->width - 1 ? 1.0 : 0.0;
            if (factor != 0.0) dx[r] += factor * m->maps[(ptrdiff_t)e * s->lanes + k];
        }
    }
}

#endif
