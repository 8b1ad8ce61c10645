/* The stage solver of a problem. */
#ifndef RUMO_SOLVER_H
#define RUMO_SOLVER_H

#ifdef RUMO_SOLVER /* this build's own */
#include RUMO_SOLVER

static inline const stage_solver *solver_of(const rumo_sizes *sizes) {
    (void)sizes;
    return &solver;
}
#else
#include "solve/dense/dense.c"
#include "solve/riccati/riccati.c"

typedef union solver_memory {
    dense condensing;
    riccati sweeping;
} solver_memory;

static inline const stage_solver *solver_of(const rumo_sizes *sizes) {
    return dims_of(sizes).condensing ? &dense_solver : &riccati_solver;
}
#endif

#endif
