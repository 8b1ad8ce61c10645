/* Inputs held over blocks of intervals, and the free inputs that stand for them. */
#ifndef RUMO_BLOCKS_H
#define RUMO_BLOCKS_H

#include "rumo_core.h"

#include "base/dims.h"

static inline int block_at(const dims *s, const rumo_blocking *held, int k) {
    return unblocked(s) ? k - s->d : held->block[k];
}

static inline double share_at(const dims *s, const rumo_blocking *held, int k) {
    return unblocked(s) ? 1.0 : held->share[k];
}

/* Free inputs that act on stage k. */
static inline int inputs_at(const dims *s, const rumo_blocking *held, int k) {
    return k < s->d ? 0 : (block_at(s, held, k) + 1) * s->nu;
}

/* First stage on which a block acts. */
static inline int first_stage(const dims *s, const rumo_blocking *held, int block) {
    int k = s->d + block;
    while (!unblocked(s) && held->block[k] < block) ++k;
    return k;
}

/* Inputs are seldom held: what has to be done then is kept away from what is usual. */
RARE static void act_on_blocks(const dims *s, const rumo_blocking *held, int k, int j, double value, double *row) {
    const int own = held->block[k] * s->nu + j;
    row[own] += held->share[k] * value;
    if (own >= s->nu) row[own - s->nu] += (1.0 - held->share[k]) * value;
}

/* Add what input j of stage k, over its range, does to a row over v. */
static inline void act(const dims *s, const rumo_blocking *held, int k, int j, double value, double *row) {
    if (unblocked(s)) row[(k - s->d) * s->nu + j] += value;
    else act_on_blocks(s, held, k, j, value, row);
}

/* Input j of stage k, given the values of blocks and what comes before the first of them. */
static inline double blocked_input(const dims *s, const rumo_blocking *held, const double *before,
                                   const double *values, int k, int j) {
    const int own = block_at(s, held, k) * s->nu + j;
    const double share = share_at(s, held, k);
    return share < 1.0 ? share * values[own] + (1.0 - share) * (own < s->nu ? before[j] : values[own - s->nu])
                       : values[own];
}

#endif
