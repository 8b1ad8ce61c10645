/* Memory of the dense solver: the condensed horizon, and the quadratic program in the free inputs. */
#ifndef RUMO_DENSE_H
#define RUMO_DENSE_H

#include "base/blocks.h"
#include "solve/active_set/rows.c"
#include "solve/dense/condense.c"
#include "solve/stage_solver.h"

typedef struct dense {
    dims s;
    const rumo_problem *problem;
    condensed condensed;
    int *imposed_now;                      /* (N nc,): constraints that are imposed and that inputs can influence */
    qp q;
    const double *free_lower, *free_upper; /* (nb, nu): limits of the free inputs; a view where there are no blocks */
    double *constraints;                   /* (N nc,): less their limits, if the inputs stay with the guess */
    double *gradient, *best, *other;       /* (ld,) */
    double *zeros;                         /* (nu,) */
    double *inputs;                        /* (nb, nu) */
    rumo_conflict *conflict;
} dense;

RARE static void dense_lay_out(arena *a, void *self, const rumo_problem *own, const rumo_problem *given) {
    dense *const d = (dense *)self;
    const dims s = d->s = dims_of(&given->sizes);
    const rumo_bounds *bounds = &own->numbers.bounds;
    d->problem = own;
    d->free_lower = unblocked(&s) ? bounds->input_lower + s.d * s.nu : alloc_doubles(a, s.n);
    d->free_upper = unblocked(&s) ? bounds->input_upper + s.d * s.nu : alloc_doubles(a, s.n);
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
    alloc_qp(a, &d->q, s.n, s.nu, s.N * s.nc);
    d->q.hessian = h->hessian;
    d->q.inverse = h->inverse;
    d->q.transpose = h->transpose;
    d->q.matrix = h->rows;
    d->imposed_now = alloc_ints(a, s.N * s.nc);
    d->constraints = alloc_doubles(a, s.N * s.nc);
    d->gradient = alloc_doubles(a, s.ld);
    d->best = alloc_doubles(a, s.ld);
    d->other = alloc_doubles(a, s.ld);
    d->zeros = alloc_doubles(a, s.nu);
    d->inputs = alloc_doubles(a, s.n);
    d->conflict = (rumo_conflict *)alloc(a, (size_t)d->q.capacity * sizeof *d->conflict);
    for (int i = 0; a->base && i < s.N * s.nc; ++i) d->q.extent[i] = padded(inputs_at(&s, &h->held, i / s.nc));
}

#endif
