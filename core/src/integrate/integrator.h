/* All that an integrator remembers. */
#ifndef RUMO_INTEGRATOR_H
#define RUMO_INTEGRATOR_H

#include "base/system.h"

#include "rumo_core.h"

#include "base/lanes.h"
#include "integrate/radau.h"
#include "stages/sparse_factor.c"

enum { ON_VARIABLES = 1, ON_INPUTS = 2, ON_PARAMETERS = 4 };

/* Vectors of variables (x, z) are padded to ld; three of them, of stages or of T^-1 times them, lie one after the other. */
struct rumo_integrator {
    rumo_system system;
    rumo_right_side code;       /* of its tapes, or what runs them */
    int n, nx, nz, ld;
    double relative, *absolute; /* tolerances of the estimate of errors; (n,) */
    double iterated;            /* what Newton's method may leave, in units of these tolerances */

    double *y, *start;          /* (ld,): variables where the step begins; and where advance() began */
    double *u, *p;              /* what is held */
    double *rate, *weights;     /* (ld,): f and g there; 1 / tolerance of each variable */
    double *Z, *W, *right;      /* (3, ld): y of the stages minus that where the step begins; T^-1 Z; and what W lacks */
    double *error;              /* (ld,) */
    double *polynomial;         /* (3, ld): the last step's solution, as divided differences from its end */
    double *y_lanes, *u_lanes, *p_lanes; /* (n, LANES), (nu, LANES), (np, LANES) */
    double *registers, *terms;           /* (slots, LANES) */
    double *J;                  /* (nonzeros,) */
    double *inverse;            /* (3, n, ld): of a dense system, real one and complex one, transposed; */
    int *pivots;                /* (n,) */
    const block_pattern *blocks; /* or the sparse one */
    int *diagonal;              /* (inner nonzeros,): whether it is on that of a state */
    double *entries, *local;    /* (entries, 3), (n, 3) */

    int depends;                /* on what the Jacobian does, see below */
    int loops, *loop, *place;   /* see integrate/growth.c; (n,), (nonzeros,) */
    double phase;               /* by which growing modes may turn or grow in a step [rad] */
    double *modes, *lower, *balance; /* (n, n) twice; (n,): what balances the Jacobian */
    double longest;             /* step in which they do; 0 where that is not known of the Jacobian, */
    int exact;                  /* or where it is not exact one that is shorter */
    long long seen;             /* steps before that was found out */
    double *looked;             /* (n,): y of the Jacobian */
    int unlooked, jumped;       /* steps since it was found; whether inputs have jumped since */

    int moving;                 /* whether y is where the last step ended: polynomial and step are of use */
    int predicts;               /* whether there is a polynomial */
    int has_jacobian, fresh;    /* and whether it is of y */
    double factored;            /* step for which the systems are factored; 0 for none */
    double step, last, before;  /* to be tried next; accepted last, and the error then, for the control of steps */
    double beginning;           /* first step that suited after the last jump */
    double contraction;         /* of Newton's method */
    double quality;             /* factor by which the last correction bounds what is left */
    rumo_work work;
};

#endif
