/* Inputs within bounds and move bounds. */
#ifndef RUMO_ADMISSIBLE_H
#define RUMO_ADMISSIBLE_H

#include "base/lanes.h"

/* The inputs nearest to u (count, nu) that respect bounds (count, nu) and move bounds, one after the other; move
 * bounds of the next lie `next` numbers on. */
static void make_admissible(int nu, const double *before, const double *lower, const double *upper, const double *move_lower,
                            const double *move_upper, int next, double *u, int count) {
    for (int k = 0; k < count; ++k, lower += nu, upper += nu, move_lower += next, move_upper += next) {
        for (int j = 0; j < nu; ++j) {
            const double wanted = u[k * nu + j], move = wanted - before[j];
            /* An admissible input stays what it is; a move may be as large as numbers get. */
            const double reached = move < move_lower[j]   ? before[j] + move_lower[j]
                                   : move > move_upper[j] ? before[j] + move_upper[j]
                                                          : wanted;
            u[k * nu + j] = clip(reached, lower[j], upper[j]);
        }
        before = u + k * nu;
    }
}

#endif
