/* Readings that are old when they come: what they say of then is brought to now. */
#ifndef RUMO_AGE_C
#define RUMO_AGE_C

#include "guard/guard.h"

/* What is believed of the past is kept as the ways that plans went from sample to sample, back from the prediction of now,
 * with how each sample depends on the one before. Where a belief was wrong, those after it were too: from the oldest reading
 * on the error is carried to now, and what is believed of the samples in between is corrected by it. The next reading is
 * compared with that, so that no innovation counts twice. */

/* Where the last of the ways is kept, k = 0, and those before. */
static inline int nth_way(const rumo_guard *g, int k) { return (g->latest + g->oldest + 1 - k) % (g->oldest + 1); }

/* How the sample at the end of a way depends on that at its beginning, (nx, nx). */
static inline double *dependence_of(const rumo_guard *g, int k) {
    return g->dependences + (ptrdiff_t)nth_way(g, k) * g->s.nx * g->s.nx;
}

/* How many ways back a state was read, as far as they are known. */
static inline int ways_back(const rumo_guard *g, int r) {
    const int age = g->data.sensors.age[r];
    return age < g->known ? age : g->known;
}

/* What was believed of a state when it was read. */
static double believed(const rumo_guard *g, int r) {
    double x = g->next_x[r];
    for (int k = 0; k < ways_back(g, r); ++k) x -= g->ways[nth_way(g, k) * g->s.nx + r];
    return x;
}

/* Carry what was believed wrongly from the oldest sample known to now, `wrong` (nx,), and correct ways by it. A state that was
 * read is as far off as the reading says, whatever is carried, and not at all where that reading has been used before. */
static void carry(rumo_guard *g, int correct) {
    const int nx = g->s.nx;
    double *wrong = g->wrong, *after = wrong + nx;
    zero(wrong, nx);
    for (int k = g->known - 1; k >= 0; --k) {
        const int way = nth_way(g, k) * nx;
        const double *A = dependence_of(g, k);
        for (int r = 0; r < nx; ++r) {
            if (ways_back(g, r) == k + 1 && isfinite(g->late[r])) wrong[r] = g->late[r];
            else if (g->was_read[way + r]) wrong[r] = 0.0;
            if (correct && k + 1 < g->known) g->ways[nth_way(g, k + 1) * nx + r] += wrong[r];
            if (correct) g->ways[way + r] -= wrong[r];
        }
        for (int r = 0; r < nx; ++r) {
            after[r] = 0.0;
            for (int j = 0; j < nx; ++j) after[r] += A[r * nx + j] * wrong[j];
        }
        copy(wrong, after, nx);
    }
    for (int r = 0; correct && g->known && r < nx; ++r) g->ways[nth_way(g, 0) * nx + r] += wrong[r];
}

/* The readings x (nx,) that are old, or held back, become what all others say of now. */
static void bring_to_now(rumo_guard *g, double *x) {
    if (g->oldest == 0 || g->known == 0) return;
    carry(g, 0);
    for (int r = 0; r < g->s.nx; ++r)
        if (g->data.sensors.age[r] || !isfinite(g->late[r])) x[r] = g->next_x[r] + g->wrong[r];
}

/* Old readings have been used, in a plan that begins with them: the ways before it were others. */
static void correct_ways(rumo_guard *g) {
    if (g->oldest == 0) return;
    carry(g, 1);
    for (int r = 0; r < g->s.nx; ++r) {
        if (!isfinite(g->late[r])) continue;
        if (ways_back(g, r)) g->was_read[nth_way(g, ways_back(g, r) - 1) * g->s.nx + r] = 1;
        g->late[r] = 0.0;
    }
}

/* A plan is followed, or there is none any more: of the sample that it begins with, if it is a solution, some states were
 * read. How the next sample depends on it is not known yet: it moves along. */
static void follow_way(rumo_guard *g, int solved) {
    const int nx = g->s.nx;
    if (g->oldest == 0) return;
    g->latest = (g->latest + 1) % (g->oldest + 1);
    g->was_known = g->known;
    g->known = !g->has_next ? 0 : g->known < g->oldest ? g->known + 1 : g->oldest;
    if (!g->has_next) return;
    double *A = dependence_of(g, 0);
    zero(A, nx * nx);
    for (int r = 0; r < nx; ++r) {
        A[r * nx + r] = 1.0;
        g->ways[g->latest * nx + r] = g->next_x[r] - g->x[r];
        g->was_read[g->latest * nx + r] = solved && g->data.sensors.age[r] == 0 && isfinite(g->late[r]);
    }
}

/* The last way's dependence has become that of the first interval, of which the next sample is a share. */
static void expect_old_readings(rumo_guard *g) {
    const int nx = g->s.nx;
    double *A = dependence_of(g, 0);
    const int usable = all_finite(A, nx * nx);
    for (int i = 0; i < nx * nx; ++i) {
        const double same = i % (nx + 1) == 0;
        A[i] = usable ? same + g->monitor.share * (A[i] - same) : same;
    }
}

/* The last plan is not followed after all: the next one takes its place. */
RARE static void take_back_way(rumo_guard *g) {
    if (g->oldest == 0) return;
    g->latest = (g->latest + g->oldest) % (g->oldest + 1);
    g->known = g->was_known;
}

#endif
