/* Guesses that have strayed from the dynamics. */
#ifndef RUMO_STRAY_C
#define RUMO_STRAY_C

#include "guard/guard.h"

/* A guess farther from the dynamics than this share of what the inputs can do has strayed. */
#define STRAYED 0.03

/* Whether a guess is kept that strays so far; a plan made from a wild measurement would keep misleading its successors.
 * After a guess at rest it takes some samples until guesses satisfy the dynamics, and these may stray. */
static int keep_guess(rumo_guard *g, double straying) {
    const int strayed = !(straying < STRAYED);
    g->has_guess = !(g->settled && strayed && !g->resting);
    g->settles = !strayed; /* for good once the sample is over: it may be prepared again */
    return g->has_guess;
}

#endif
