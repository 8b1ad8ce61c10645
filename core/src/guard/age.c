/* Readings that are old when they come: what they say of then is brought to now. */
#ifndef RUMO_AGE_C
#define RUMO_AGE_C

#include "guard/guard.h"

/* What is believed of the past is kept as the ways that plans went from sample to sample, back from the prediction of now. An
 * innovation of then is moved along by how much of it each of them keeps, and what is believed of the samples in between with
 * it: the next reading is compared with that, so that no innovation counts twice. */

/* Where the last of a state's ways is kept, k = 0, and those before. */
static inline int nth_way(const rumo_guard *g, int r, int k) {
    return (g->latest + g->oldest - k) % g->oldest * g->s.nx + r;
}

/* How many ways back a state was read, as far as they are known. */
static inline int ways_back(const rumo_guard *g, int r) {
    const int age = g->data.sensors.age[r];
    return age < g->known ? age : g->known;
}

/* What was believed of a state when it was read. */
static double believed(const rumo_guard *g, int r) {
    double x = g->next_x[r];
    for (int k = 0; k < ways_back(g, r); ++k) x -= g->ways[nth_way(g, r, k)];
    return x;
}

/* What an old reading of a state, as it was read, says of now. */
static double brought_to_now(rumo_guard *g, int r, double then) {
    double kept = g->late[r] = g->read[r] - then;
    for (int k = 0; k < ways_back(g, r); ++k) kept *= g->keeps[nth_way(g, r, k)];
    return g->next_x[r] + kept;
}

/* Old readings have been used, in a plan that begins with them: the ways before it were others. */
static void correct_ways(rumo_guard *g) {
    for (int r = 0; g->oldest && r < g->s.nx; ++r) {
        double wrong = isfinite(g->late[r]) ? g->late[r] : 0.0;
        for (int k = ways_back(g, r) - 1; k >= 0 && wrong != 0.0; --k) {
            const double kept = g->keeps[nth_way(g, r, k)] * wrong;
            g->ways[nth_way(g, r, k)] += kept - wrong;
            wrong = kept;
        }
        g->late[r] = 0.0;
    }
}

/* A plan is followed, or there is none any more. How much of a deviation it keeps is not known yet: all of it. */
static void follow_way(rumo_guard *g) {
    if (g->oldest == 0) return;
    g->latest = (g->latest + 1) % g->oldest;
    g->known = !g->has_next ? 0 : g->known < g->oldest ? g->known + 1 : g->oldest;
    for (int r = 0; g->has_next && r < g->s.nx; ++r) {
        g->ways[nth_way(g, r, 0)] = g->next_x[r] - g->x[r];
        g->keeps[nth_way(g, r, 0)] = 1.0;
    }
}

/* How much of a deviation a plan keeps until the next sample, where it makes `own` of it until the end of its first interval
 * and the sample is a share of that. */
static inline double kept_until(double share, double own) { return clip(1.0 + share * (own - 1.0), 0.0, 1.0); }

/* Which is known now, of the last plan. */
static inline void expect_old_reading(rumo_guard *g, int r, double own) {
    if (g->oldest && isfinite(own)) g->keeps[nth_way(g, r, 0)] = kept_until(g->monitor.share, own);
}

/* The last plan is not followed after all: the next one takes its place. */
RARE static void take_back_way(rumo_guard *g) {
    if (g->known == 0) return;
    g->latest = (g->latest + g->oldest - 1) % g->oldest;
    --g->known;
}

#endif
