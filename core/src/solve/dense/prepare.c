/* The dense solver's part that needs no measurement. */
#ifndef RUMO_PREPARE_C
#define RUMO_PREPARE_C

#include "solve/active_set/working_set.c"
#include "solve/dense/dense.h"
#include "stages/along.c"

/* A constraint that all inputs' ranges move by less than this share of its scale is not imposed. */
#define NO_INFLUENCE 1e-10

/* Limits of the free inputs: where they are held over intervals, all limits of these. */
RARE static void limit_free_inputs(const dims *s, const rumo_blocking *held, const rumo_bounds *bounds, double *lower,
                                   double *upper) {
    for (int i = 0; i < s->n; ++i) {
        lower[i] = -INFINITY;
        upper[i] = INFINITY;
    }
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu; ++j) {
            const int own = block_at(s, held, k) * s->nu + j, i = k * s->nu + j;
            /* An input on the way from one block's value to the next is within limits if both are. */
            const int first = share_at(s, held, k) < 1.0 && own >= s->nu ? own - s->nu : own;
            for (int member = first; member <= own; member += s->nu) {
                lower[member] = fmax(lower[member], bounds->input_lower[i]);
                upper[member] = fmin(upper[member], bounds->input_upper[i]);
            }
        }
}

/* What the solver keeps in another form. */
RARE static void dense_renumber(void *self) {
    dense *const d = (dense *)self;
    const dims *s = &d->s;
    const rumo_numbers *p = &d->problem->numbers;
    qp *q = &d->q;
    int limited = 0;
    for (int j = 0; j < s->nu; ++j) limited |= isfinite(p->bounds.move_lower[j]) || isfinite(p->bounds.move_upper[j]);
    limit_increments(q, limited ? s->nu : 0);
    for (int i = 0; i < s->N * s->nc; ++i) {
        q->l1[q->dense + i] = p->l1[i % s->nc];
        q->l2[q->dense + i] = p->l2[i % s->nc];
    }
    for (int i = 0; i < s->N * s->ny; ++i) d->condensed.root_weights[i] = sqrt(2.0 * p->output_weights[i]);
    if (!unblocked(s))
        limit_free_inputs(s, &d->problem->blocking, &p->bounds, (double *)d->free_lower, (double *)d->free_upper);
}

static void dense_forget(void *self) { clear_members(&((dense *)self)->q); }

/* Condense, factor, and take over the working set of the step before, `shift` stages on. */
OUTSIDE static int dense_prepare(void *self, stage_maps *m, int shift) {
    dense *const d = (dense *)self;
    const rumo_problem *p = d->problem;
    const dims s = dims_of(&p->sizes);
    const double *scales = p->numbers.input_scales;
    condensed *const h = &d->condensed;
    if (is_wide(m)) {
        respond_widely(&m->equations, scales, h);
    } else {
        spread(&s, &m->map, m->map_row, m->maps, h->stages);
        respond(&s, &m->map, m->end_of_A, m->maps, scales, h);
    }
    reach_of(&s, h, s.N, m->reach);
    if (gate_stages(&s) < s.N) reach_of(&s, h, gate_stages(&s), m->near_reach);
    else copy(m->near_reach, m->reach, s.nx);
    for (int k = s.d; k < s.N; ++k) {
        const int length = padded(inputs_at(&s, &h->held, k));
        for (int i = k * s.ny; i < (k + 1) * s.ny; ++i)
            measure(&s, h, m->terms, k, i - k * s.ny, &m->Cx, &m->Cu, h->root_weights[i], scales,
                    h->outputs + (ptrdiff_t)i * s.ld);
        for (int i = k * s.nc; i < (k + 1) * s.nc; ++i) {
            double *row = h->rows + (ptrdiff_t)i * s.ld;
            measure(&s, h, m->terms, k, i - k * s.nc, &m->D, &m->E, 1.0, scales, row);
            const double norm = sqrt(dot(row, row, length));
            d->imposed_now[i] = p->imposed[i] && norm > NO_INFLUENCE * p->numbers.constraint_scales[i - k * s.nc];
            d->q.weight[d->q.dense + i] = d->imposed_now[i] ? 1.0 / norm : 0.0;
        }
    }
    add_up_hessian(&s, p->numbers.move_weights, scales, h);
    if (!factorize(s.n, s.ld, h->hessian, h->factor, h->inverse, h->transpose)) return 0;
    shift &= unblocked(&s) && p->shift.same_rows;
    renew_members(&d->q, shift * s.nu, shift * s.nc, d->imposed_now);
    return 1;
}

#endif
