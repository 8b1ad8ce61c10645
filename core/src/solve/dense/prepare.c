/* The dense solver's part that needs no measurement. */
#ifndef RUMO_PREPARE_C
#define RUMO_PREPARE_C

#include "solve/active_set/working_set.c"
#include "solve/dense/dense.h"
#include "solve/influence.h"
#include "stages/along.c"

/* What the solver keeps in another form. */
RARE static void dense_renumber(void *self) {
    dense *const d = (dense *)self;
    const dims *s = &d->s;
    const rumo_numbers *p = &d->problem->numbers;
    qp *q = &d->p.q;
    limit_increments(&d->p, limits_moves(s, &p->bounds) ? s->nu : 0);
    for (int i = 0; i < s->N * s->nc; ++i) {
        q->l1[q->first_soft + i] = p->l1[i % s->nc];
        q->l2[q->first_soft + i] = p->l2[i % s->nc];
    }
    for (int i = 0; i < s->N * s->ny; ++i) d->condensed.root_weights[i] = sqrt(2.0 * p->output_weights[i]);
    limit_free_inputs(s, &d->problem->blocking, &p->bounds, &d->limits);
}

static void dense_forget(void *self) { clear_members(&((dense *)self)->p.q); }

RARE static void dense_damp(void *self, double damping) { ((dense *)self)->damping = damping; }

/* The row that a member is after the horizon has been prepared again, `shift` stages on. */
static int dense_becomes(const qp *q, int row) {
    const dense *d = (const dense *)q;
    const int nu = d->shift * d->s.nu, nc = d->shift * d->s.nc;
    if (row < q->n) return row >= nu ? row - nu : -1;
    if (row < q->first_soft) return row >= q->n + nu ? row - nu : -1;
    const int path = row - q->first_soft - nc;
    return path >= 0 && d->imposed_now[path] ? row - nc : -1;
}

/* Condense, factor, and take over the working set of the step before, `shift` stages on. */
OUTSIDE static int dense_prepare(void *self, const stage_maps *m, int shift, double end) {
    dense *const d = (dense *)self;
    const rumo_problem *p = d->problem;
    const dims s = dims_of(&p->sizes);
    const double *scales = p->numbers.input_scales;
    condensed *const h = &d->condensed;
    if (is_wide(m)) {
        respond_widely(&m->equations, scales, end, h);
    } else {
        spread(&s, &m->map, m->map_row, m->maps, h->stages);
        respond(&s, &m->map, m->end_of_A, m->maps, scales, end, h);
    }
    d->p.q.end = end;
    for (int k = s.d; k < s.N; ++k) {
        if (is_over(end)) return 0;
        const int length = padded(inputs_at(&s, &h->held, k));
        for (int i = k * s.ny; i < (k + 1) * s.ny; ++i)
            measure(&s, h, m->terms, k, i - k * s.ny, &m->Cx, &m->Cu, h->root_weights[i], scales,
                    h->outputs + (ptrdiff_t)i * s.ld);
        for (int i = k * s.nc; i < (k + 1) * s.nc; ++i) {
            double *row = h->rows + (ptrdiff_t)i * s.ld;
            measure(&s, h, m->terms, k, i - k * s.nc, &m->D, &m->E, 1.0, scales, row);
            const double norm = sqrt(dot(row, row, length));
            d->imposed_now[i] = p->imposed[i] && norm > NO_INFLUENCE * p->numbers.constraint_scales[i - k * s.nc];
            d->p.q.weight[d->p.q.first_soft + i] =
                d->imposed_now[i] ? 1.0 / unit_of_row(norm, p->numbers.constraint_scales[i - k * s.nc]) : 0.0;
        }
    }
    add_up_hessian(&s, p->numbers.move_weights, scales, d->damping, end, h);
    const double share = factorize(s.n, s.ld, h->hessian, h->factor, h->inverse, h->transpose, end);
    if (share == 0.0) return 0;
    set_fine(&d->p.q, share, longest_row(s.n, s.ld, h->transpose));
    d->p.q.span = 0.0;
    for (int i = 0; i < s.n; ++i) d->p.q.span += h->hessian[(ptrdiff_t)i * s.ld + i];
    d->shift = shift && unblocked(&s) && p->shift.same_rows;
    renew_members(&d->p.q, dense_becomes);
    return !is_over(end);
}

static void dense_reach(void *self, int stages, double *reach) {
    const dense *d = (const dense *)self;
    const dims s = dims_of(&d->problem->sizes);
    reach_of(&s, &d->condensed, stages, reach);
}

#endif
