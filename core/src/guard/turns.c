/* Angles: full turns are no difference. */
#ifndef RUMO_TURNS_C
#define RUMO_TURNS_C

#include "guard/age.c"
#include "guard/guard.h"

/* Angles beyond so many turns have lost the digits that say where they point. */
#define TOO_MANY_TURNS 1e9

/* The same angle, as near to another number as can be; where turn is 0 it is no angle. */
static inline double next_to(double angle, double turn, double to) {
    const double apart = angle - to;
    if (!(fabs(apart) > 0.5 * turn) || turn == 0.0) return angle;
    if (larger(fabs(angle), fabs(to)) > TOO_MANY_TURNS * turn) return angle;
    return angle - turn * floor(apart / turn + 0.5);
}

/* A reading of angle r, next to what is predicted of it. A plan that is not to be trusted, and what is left of it, may lead to
 * any number of turns, of which what is wanted would know nothing: a reading far from that is next to the last one used. */
static inline double counted(const rumo_guard *g, int r, double angle, double to) {
    const double turn = g->data.sensors.turn[r];
    const int far = g->has_next && g->astray && fabs(angle - to) > 0.5 * turn;
    return next_to(angle, turn, far ? g->used[r] : to);
}

/* The measurement as it is judged: old readings with the ways since, each by itself, and with its angles next to what is
 * predicted or, without a plan, to the last plausible sample. */
static double *unwound(rumo_guard *g, const double *x) {
    const double *to = g->has_next ? g->next_x : g->has_last ? g->last_x : x, *turn = g->data.sensors.turn;
    const int nx = g->s.nx;
    if (g->oldest == 0) {
        for (int r = 0; r < nx; ++r) g->taken[r] = counted(g, r, x[r], to[r]);
        return g->taken;
    }
    for (int r = 0; r < nx; ++r) {
        const int is_late = ways_back(g, r) > 0; /* then there is a plan */
        const double then = is_late ? believed(g, r) : to[r];
        g->read[r] = is_late ? next_to(x[r], turn[r], then) : counted(g, r, x[r], then);
        g->late[r] = is_late ? g->read[r] - then : 0.0;
        g->taken[r] = is_late ? g->next_x[r] + g->late[r] : g->read[r];
    }
    return g->taken;
}

#endif
