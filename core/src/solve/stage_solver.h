/* The seam between linearised stages and whatever finds the step from the guess. */
#ifndef RUMO_STAGE_SOLVER_H
#define RUMO_STAGE_SOLVER_H

#include "base/system.h"

#include "rumo_core.h"

#include "base/arena.h"
#include "stages/stages.h"

/* What is known only when the measurement is. */
typedef struct stage_known {
    const double *x;         /* (nx,) */
    const double *decided;   /* (max(d, 1), nu): inputs decided before, oldest first */
    const double *reference; /* (N + 1, ny) */
} stage_known;

/* What a solution may take, and how exactly limits have to hold, in units of the inputs' ranges. */
typedef struct budget {
    int iterations;
    double tolerance, seconds;
} budget;

/* From the guess to the solution; the arrays are the caller's. */
typedef struct stage_step {
    double *dx;                    /* (N + 1, ldx): states, then algebraic variables at the end of an interval */
    double *du;                    /* (N, nu) */
    double *constraints;           /* (N, nc): path constraints less their limits, as linearised */
    double size;                   /* largest change of a free input, over its range */
    double kkt_residual;           /* largest slope of the Lagrangian at the guess, over the ranges; NaN where not known */
    int iterations;
    int conflicts;                 /* limits that cannot hold together, if there is no solution */
    const rumo_conflict *conflict; /* the solver's */
} stage_step;

/* A method. Its memory is the caller's, and what it lays out in the arena. */
typedef struct stage_solver {
    /* `given` is the problem as it came, `own` the copy that stays; without memory, to measure. */
    void (*lay_out)(arena *, void *, const rumo_problem *own, const rumo_problem *given);
    void (*renumber)(void *); /* the problem's numbers are others */
    void (*forget)(void *);   /* nothing of former solutions helps */
    /* All that needs no measurement, with what is kept of former solutions `shift` stages on; 0 if there is no solution.
     * The stages' reach is filled in: a dense solver has it in its responses, a sweep of its own takes a fifth of a step. */
    int (*prepare)(void *, stage_maps *, int shift);
    /* SOLVER_FAILED leaves no step. */
    rumo_status (*solve)(void *, const stage_maps *, const stage_known *, const budget *, stage_step *);
} stage_solver;

#endif
