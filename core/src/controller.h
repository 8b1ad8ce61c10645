/* All that a controller remembers. */
#ifndef RUMO_CONTROLLER_H
#define RUMO_CONTROLLER_H

#include "rumo_core.h"

#include "base/dims.h"
#include "guard/guard.h"
#include "stages/sparse.h"
#include "solve/active_set/rows.c"
#include "solve/dense/condense.c"

struct rumo_controller {
    dims s;
    rumo_problem problem;
    rumo_settings settings;

    rumo_guard guard;                   /* what is applied, whatever happened, and whether there is a guess */
    int prepared;
    double *guess_x, *guess_u;          /* (N + 1, nx), (N, nu): where the next step linearises */
    double *guess_values;               /* (nb, nu): of its blocks; the end of guess_u where there are none */
    const double *free_lower, *free_upper; /* (nb, nu): limits of the free inputs; a view where there are no blocks */
    double *guess_rest;                 /* constraints, z, diagnostics of the iteration before, see attempt() */
    double *last_reference;             /* (N + 1, ny): wanted at the sample before, one sample on */
    int has_reference;
    double *numbers;                    /* of the plan */
    double *inner, *guess_inner;        /* (ni, lanes): other unknowns of the intervals, see inner.c */

    double *x_lanes, *u_lanes, *p_lanes, *registers, *terms, *work; /* see tape.c, eliminate.c */
    double *results;                    /* (m, entries, lanes): maps of the substeps; of the last one if explicit */
    double *maps, *other_maps;          /* (entries, lanes): of the intervals, see compose.c; results if m = 1 */
    double *on_the_way;                 /* (nx, lanes): state that an explicit scheme has come to */
    double *zeros;                      /* (lanes,) or (nu,), whichever is longer */
    double *dx_lanes, *du_lanes;        /* (nx, lanes), (nu, lanes): see expand_inner() */
    double *unit;                       /* (nw,): in which pivots compare */
    int balanced, *block_of;
    sparse map, of_unknowns, Cx, Cu, D, E; /* rows of the intervals' maps and of the substeps' */
    const int *map_row;
    int *end_of_A;                      /* (rows,): where the entries of A end in each row of a map */
    condensed condensed;
    int *imposed_now;                   /* (N nc,) */
    qp q;
    double *dx;                         /* (N + 1, ldx) */
    double *du;                         /* (N, nu) */
    double *constraints;                /* (N nc,): path constraints if the inputs stay with the guess */
    double *gradient, *best, *other;    /* (ld,) */
    double last_step;                   /* largest |v| of the iteration before, NaN if there was none */
    double straying;                    /* of the last guess linearised about, see straying() */
    int settled;                        /* whether guesses have satisfied the dynamics since the last one at rest */
    double prepare_seconds, linearize_seconds, linearized_at;
};

static inline double *plan_u(const rumo_controller *ctl) { return ctl->numbers; }
static inline double *plan_x(const rumo_controller *ctl) { return ctl->numbers + ctl->s.N * ctl->s.nu; }
static inline double *plan_constraints(const rumo_controller *ctl) { return plan_x(ctl) + (ctl->s.N + 1) * ctl->s.nx; }
static inline double *plan_z(const rumo_controller *ctl) { return plan_constraints(ctl) + ctl->s.N * ctl->s.nc; }
static inline double *plan_diagnostics(const rumo_controller *ctl) { return plan_z(ctl) + ctl->s.N * ctl->s.nz; }

/* Numbers of a plan, and those after u and x. */
static inline int rest_of_plan(const dims *s) { return s->N * (s->nc + s->nz) + RUMO_DIAGNOSTIC_COUNT; }
static inline int size_of_plan(const dims *s) { return s->N * s->nu + (s->N + 1) * s->nx + rest_of_plan(s); }

static inline double *results_of(const rumo_controller *ctl, int substep) {
    return ctl->results + (ctl->s.explicit_scheme ? 0 : (ptrdiff_t)substep * ctl->problem.elimination.entries * ctl->s.lanes);
}

#endif
