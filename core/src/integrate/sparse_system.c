/* The linear systems of a step with sparse matrices: LU factors in an order found beforehand, of the real one and the complex
 * one at once. An entry is (real matrix, real and imaginary part of the complex one), and so are right-hand sides. */
#ifndef RUMO_SPARSE_SYSTEM_C
#define RUMO_SPARSE_SYSTEM_C

#include "integrate/integrator.h"

/* y -= a x, of both. */
static WITHIN void subtract_triple(double *restrict y, const double *restrict a, const double *restrict x) {
    y[0] -= a[0] * x[0];
    y[1] -= a[1] * x[1] - a[2] * x[2];
    y[2] -= a[1] * x[2] + a[2] * x[1];
}

static WITHIN void multiply_triple(double *restrict y, const double *restrict a) {
    const double re = y[1];
    y[0] *= a[0];
    y[1] = a[1] * re - a[2] * y[2];
    y[2] = a[1] * y[2] + a[2] * re;
}

/* As factor_block(), for triples; 0 where a pivot is 0 or not finite. */
static int factor_triples(const block_pattern *b, double *entries) {
    const int *target = b->target;
    double *lower = entries + b->size * 3, *upper = lower + b->fill * 3;
    for (int p = 0; p < b->size; ++p) {
        const int count = b->below[p];
        double *const pivot = entries + p * 3;
        const double size = pivot[1] * pivot[1] + pivot[2] * pivot[2];
        if (!(fabs(pivot[0]) > 0.0 && size > 0.0 && size < INFINITY)) return 0;
        pivot[0] = 1.0 / pivot[0];
        pivot[1] /= size;
        pivot[2] /= -size;
        for (int i = 0; i < count; ++i) {
            multiply_triple(lower + i * 3, pivot);
            for (int j = 0; j < count; ++j) subtract_triple(entries + *target++ * 3, lower + i * 3, upper + j * 3);
        }
        lower += count * 3;
        upper += count * 3;
    }
    return 1;
}

/* As solve_factored(), for triples. */
static void solve_triples(const block_pattern *b, const double *entries, double *right) {
    const double *lower = entries + b->size * 3, *upper = lower + 2 * b->fill * 3;
    const int *later = b->later;
    for (int p = 0; p < b->size; ++p)
        for (int i = 0; i < b->below[p]; ++i, lower += 3) subtract_triple(right + *later++ * 3, lower, right + p * 3);
    for (int p = b->size - 1; p >= 0; --p) {
        for (int i = 0; i < b->below[p]; ++i) {
            upper -= 3;
            subtract_triple(right + p * 3, upper, right + *--later * 3);
        }
        multiply_triple(right + p * 3, entries + p * 3);
    }
}

/* See factor_dense(). */
static int factor_sparse(rumo_integrator *q, double a, double c, double d) {
    const rumo_factor *const f = &q->system.factor;
    const int first = q->system.J.first, *const inside = f->nonzero + 3 * f->outer;
    const block_pattern *const end = q->blocks + f->blocks;
    zero(q->entries, 3 * end->entry);
    for (int e = 0; e < f->inner; ++e) {
        double *const entry = q->entries + 3 * f->entry[e];
        const double value = q->J[inside[3 * e] - first];
        entry[0] = (q->diagonal[e] ? a : 0.0) - value;
        entry[1] = (q->diagonal[e] ? c : 0.0) - value;
        entry[2] = q->diagonal[e] ? d : 0.0;
    }
    for (const block_pattern *b = q->blocks; b < end; ++b)
        if (!factor_triples(b, q->entries + 3 * b->entry)) return 0;
    return 1;
}

/* right (3, ld) becomes the solutions: of the real system, real and imaginary parts of that of the complex one. */
static void solve_sparse(rumo_integrator *q, double *right) {
    const rumo_factor *const f = &q->system.factor;
    const int first = q->system.J.first;
    double *const local = q->local;
    for (int i = 0; i < q->n; ++i)
        for (int l = 0; l < 3; ++l) local[3 * i + l] = right[l * q->ld + f->equation[i]];
    for (int b = 0; b < f->blocks; ++b) {
        const block_pattern *const block = q->blocks + b;
        for (int e = block[0].outside; e < block[1].outside; ++e) {
            const int *const at = f->nonzero + 3 * e;
            for (int l = 0; l < 3; ++l) local[3 * at[1] + l] += q->J[at[0] - first] * local[3 * at[2] + l];
        }
        solve_triples(block, q->entries + 3 * block->entry, local + 3 * block->first);
    }
    for (int i = 0; i < q->n; ++i)
        for (int l = 0; l < 3; ++l) right[l * q->ld + f->unknown[i]] = local[3 * i + l];
}

#endif
