/* All that a controller remembers. */
#ifndef RUMO_CONTROLLER_H
#define RUMO_CONTROLLER_H

#include "rumo_core.h"

#include "base/dims.h"
#include "guard/guard.h"
#include "solve/solver.h"
#include "stages/stages.h"

/* A guess that is set aside. */
typedef struct kept_guess {
    double *u, *x, *inner; /* (N, nu), (N + 1, nx), (ni, lanes) */
} kept_guess;

struct rumo_controller {
    dims s;
    rumo_problem problem;
    rumo_settings settings;
    stage_maps stages;       /* the guess, and the horizon linearised there */
    solver_memory solving;
    stage_step step;         /* from the guess, as solved for; its constraints are the plan's */
    rumo_guard guard;        /* what is applied, whatever happened, and whether there is a guess */

    double *numbers;         /* of the plan */
    double *inner;           /* (ni, lanes): its other unknowns of the intervals, see inner.c */
    double *guess_rest;      /* constraints, z, diagnostics of the iteration before, see attempt() */
    int prepared;
    int still;               /* whether the guess is a state at rest, which nobody has planned */
    int behind;              /* samples between what the solver keeps and the guess: 0 or 1 */
    kept_guess from;         /* that iterations of a sample begin with, or a step is cut from */
    kept_guess first;        /* that steps were cut from at first; or one set aside */
    double *way_inner;       /* (ni, lanes): scratch */
    double *values;          /* (nb, nu): of the plan's blocks */
    kept_guess stored;       /* the guess before iterations of its preparation, */
    int has_stored;          /* if there were any */
    double *last_reference;  /* (N + 1, ny): wanted at the sample before, */
    double *expected;        /* and the same one sample later */
    int has_reference;
    double *begins;          /* (ny,): where what is wanted began at the sample before */
    double last_step;        /* largest change of a free input in the iteration before, NaN if it is the sample's first */
    int wary;                /* whether the sample's first iteration is not enough, see step.c */
    double moved_later;      /* largest change of a free input in later iterations of the samples since one that was used */
    double *near_reach;      /* (nx,): over the stages of the gate, where the gate has to know */
    double straying;         /* of the last guess linearised about, see straying() */
    rumo_conflict *broken;   /* (N nc,): hard constraints that the last solution exceeds */
    double prepare_seconds, linearize_seconds, linearized_at;
    double end;              /* when the step has to be over, by the clock; infinite for whenever it is */
    int proposed;            /* whether the solver has come to a plan, as a solution or as what there is */
};

static inline double *plan_u(const rumo_controller *ctl) { return ctl->numbers; }
static inline double *plan_x(const rumo_controller *ctl) { return ctl->numbers + ctl->s.N * ctl->s.nu; }
static inline double *plan_constraints(const rumo_controller *ctl) { return plan_x(ctl) + (ctl->s.N + 1) * ctl->s.nx; }
static inline double *plan_z(const rumo_controller *ctl) { return plan_constraints(ctl) + ctl->s.N * ctl->s.nc; }
static inline double *plan_diagnostics(const rumo_controller *ctl) { return plan_z(ctl) + ctl->s.N * ctl->s.nz; }

/* Numbers of a plan, and those after u and x. */
static inline int rest_of_plan(const dims *s) { return s->N * (s->nc + s->nz) + RUMO_DIAGNOSTIC_COUNT; }
static inline int size_of_plan(const dims *s) { return s->N * s->nu + (s->N + 1) * s->nx + rest_of_plan(s); }

#endif
