/* What the inputs' ranges do to rows, so that rows compare: from the covariance of zeta if each input were noise, in closed
 * loop: along an unstable plant's own motion everything is out of all proportion. */
#ifndef RUMO_NORMS_C
#define RUMO_NORMS_C

#include "solve/influence.h"
#include "solve/riccati/factorise.c"

/* Samples over which the norms of the whole horizon are refreshed. */
#define NORM_SAMPLES 32

/* The covariance one stage on. */
static WITHIN void advance_covariance(riccati *r, const dims *s, const layout *p, int k) {
    const double *restrict columns = columns_of_stage(r, p, k), *restrict fresh = columns + p->moving * p->ld;
    double *restrict closed = r->closed, *restrict half = r->half;
    const int begin = begins(s, &r->problem->blocking, k);
    close_loop(r, k);
    /* C S C' with the columns of C */
    product(r->covariance, p->ld, 1, p->zeta, closed, p->ld, p->zeta, half, in_fours(p->zeta), nothing_else);
    product(closed, 1, p->ld, p->zeta, half, p->ld, p->zeta, r->covariance, in_fours(p->zeta), nothing_else);
    if (begin) product(fresh, 1, p->ld, p->zeta, fresh, p->ld, s->nu, r->covariance, in_fours(p->zeta), what_is_there);
}

/* Refresh the weights of constraints at the next `count` stages, round and round, or at fewer if there is no time for them. */
static void refresh_norms(riccati *r, int count) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const node_rows *n = &r->constraints;
    qp *q = &r->q;
    for (; count > 0; --count) {
        if (r->norms_at >= s.N || r->norms_at < s.d) {
            r->norms_at = s.d;
            zero(r->covariance, p.zeta * p.ld);
        }
        if (is_over(r->q.end)) break;
        const int k = r->norms_at++;
        advance_covariance(r, &s, &p, k);
        for (int i = 0; i < s.nc; ++i) {
            double square = 0.0;
            for (int a = n->start[i]; a < n->start[i + 1]; ++a) {
                const double *row = r->covariance + n->entry[a] * p.ld;
                double sum = 0.0;
                for (int b = n->start[i]; b < n->start[i + 1]; ++b) sum += row[n->entry[b]] * n->value[b][k];
                square += n->value[a][k] * sum;
            }
            const double norm = sqrt(larger(square, 0.0)), scale = r->problem->numbers.constraint_scales[i];
            q->weight[q->first_soft + i * s.lanes + k] = 1.0 / (norm > NO_INFLUENCE * scale ? unit_of_row(norm, scale) : scale);
        }
    }
}

#endif
