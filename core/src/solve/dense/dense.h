/* Memory of the dense solver: the condensed horizon, and the quadratic program in the free inputs. */
#ifndef RUMO_DENSE_H
#define RUMO_DENSE_H

#include "base/blocks.h"
#include "solve/active_set/matrix.c"
#include "solve/dense/condense.c"
#include "solve/free_inputs.h"
#include "solve/stage_solver.h"

typedef struct dense {
    matrix_program p;
    dims s;
    const rumo_problem *problem;
    condensed condensed;
    double damping;                        /* of changes of the inputs: see stage_solver.h */
    int shift;                             /* stages by which the working set is taken over */
    int *imposed_now;                      /* (N nc,): constraints that are imposed and that inputs can influence */
    free_limits limits;
    double *constraints;                   /* (N nc,): less their limits, if the inputs stay with the guess */
    double *best, *other;                  /* (ld,) */
    double *zeros;                         /* (nu,) */
    double *inputs;                        /* (nb, nu) */
    double *du_known;                      /* (N, nu): of du, what is there at v = 0 */
    double *du_slope, *du_through;         /* (nu,): slopes by du of a stage, its own and those of later ones */
    double *largest_force;                 /* (nu,): along an input, over the horizon */
    double *lambda, *earlier;              /* (ldx,): the dynamics' multipliers at a stage, and at the one before */
    /* What is being solved. */
    const stage_maps *maps;
    const stage_known *known;
    stage_step *step;
    rumo_conflict *conflict;
} dense;

static const qp_space dense_space;

RARE static void dense_lay_out(arena *a, void *self, const rumo_problem *own, const rumo_problem *given) {
    dense *const d = (dense *)self;
    const dims s = d->s = dims_of(&given->sizes);
    const rumo_bounds *bounds = &own->numbers.bounds;
    d->problem = own;
    d->limits = lay_out_limits(a, &s, bounds);
    condensed *const h = &d->condensed;
    h->held = own->blocking;
    const int wide = given->elimination.blocks == 0;
    h->stages = alloc_doubles(a, wide ? 0 : (ptrdiff_t)s.N * s.width * s.ldx);
    h->right = alloc_doubles(a, wide ? s.nw * s.ld : 0);
    h->response = alloc_doubles(a, (ptrdiff_t)s.N * s.rows * s.ld);
    h->outputs = alloc_doubles(a, (ptrdiff_t)s.N * s.ny * s.ld);
    h->rows = alloc_doubles(a, (ptrdiff_t)s.N * s.nc * s.ld);
    h->root_weights = alloc_doubles(a, s.N * s.ny);
    double **const squares[] = {&h->hessian, &h->factor, &h->inverse, &h->transpose};
    for (size_t i = 0; i < sizeof squares / sizeof *squares; ++i) *squares[i] = alloc_doubles(a, (ptrdiff_t)s.n * s.ld);
    alloc_matrix_program(a, &d->p, &dense_space, s.n, s.nu, s.N * s.nc);
    d->p.hessian = h->hessian;
    d->p.inverse = h->inverse;
    d->p.transpose = h->transpose;
    d->p.matrix = h->rows;
    d->imposed_now = alloc_ints(a, s.N * s.nc);
    d->constraints = alloc_doubles(a, s.N * s.nc);
    d->best = alloc_doubles(a, s.ld);
    d->other = alloc_doubles(a, s.ld);
    d->zeros = alloc_doubles(a, s.nu);
    d->inputs = alloc_doubles(a, s.n);
    d->du_known = alloc_doubles(a, s.N * s.nu);
    d->du_slope = alloc_doubles(a, s.nu);
    d->largest_force = alloc_doubles(a, s.nu);
    d->du_through = alloc_doubles(a, s.nu);
    d->lambda = alloc_doubles(a, s.ldx);
    d->earlier = alloc_doubles(a, s.ldx);
    d->conflict = (rumo_conflict *)alloc(a, (size_t)d->p.q.capacity * sizeof *d->conflict);
    for (int i = 0; a->base && i < s.N * s.nc; ++i) d->p.extent[i] = padded(inputs_at(&s, &h->held, i / s.nc));
}

#endif
