/* The seam between linearised stages and whatever finds the step from the guess.
 *
 * There are two, dense condensing and Riccati sweeps, and a problem's sizes say which: solver.h. Another one is a file that
 * defines `solver`, a stage_solver, and `solver_memory`, the type of its memory; it may use base/, stages/ and active_set/, not
 * guard/. A build takes it by RUMO_SOLVER, the name of that file, in Python by kernel.tailored(description, solver). Calls
 * through a constant cost nothing.
 *
 * What every solver owes: inputs of the delay are `decided`, those after it obey bounds and move bounds, and hold over blocks
 * (base/blocks.h). Constraints are imposed where the problem says so, but not where no input moves them. Soft ones give
 * way at the prices l1 and l2; where hard ones cannot hold, there is no step. Arithmetic alone: no allocation, no state
 * outside of its memory.
 */
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
    double tolerance, end; /* when it has to be there, by the clock; infinite for whenever it is */
} budget;

/* From the guess to the solution; the arrays are the caller's. */
typedef struct stage_step {
    double *dx;                    /* (N + 1, ldx): states, then algebraic variables at the end of an interval */
    double *du;                    /* (N, nu) */
    double *constraints;           /* (N, nc): path constraints less their limits, as linearised */
    double size;                   /* largest change of a free input, over its range */
    double kkt_residual;           /* of the optimality conditions, stage by stage; NaN where not known */
    int iterations;
    int conflicts;                 /* limits that cannot hold together, if there is no solution */
    const rumo_conflict *conflict; /* the solver's */
} stage_step;

/* A method. Its memory is the caller's, a solver_memory and what it lays out in the arena. */
typedef struct stage_solver {
    /* Once. `given` is the problem as it came, `own` the copy that stays; without memory, to measure. */
    void (*lay_out)(arena *, void *, const rumo_problem *own, const rumo_problem *given);
    void (*renumber)(void *); /* the problem's numbers are others, or known for the first time */
    void (*forget)(void *);   /* nothing of former solutions helps */
    /* Whatever is prepared next: by how much inputs change from block to block, over their ranges, costs so many times the
     * square of what that differs by from the guess, on top of what it costs anyway. 0 again where it is nothing. */
    void (*damp)(void *, double);
    /* All that needs no measurement, with what is kept of former solutions `shift` samples on, 0 or 1; 0 if rounding leaves no
     * solution, or the clock has come to `end`. */
    int (*prepare)(void *, const stage_maps *, int shift, double end);
    /* Of what was prepared: how far the ranges of all free inputs together move each state (nx,) until the end of a stage. */
    void (*reach)(void *, int stages, double *);
    /* From the stages prepared last, once or several times: OPTIMAL; BUDGET_EXCEEDED with the best step so far, admissible
     * for bounds and move bounds; or ILL_CONDITIONED or SOLVER_FAILED, which leave no step. */
    rumo_status (*solve)(void *, const stage_maps *, const stage_known *, const budget *, stage_step *);
} stage_solver;

#endif
