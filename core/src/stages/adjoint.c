/* Back along the equations: slopes by the unknowns of a substep become slopes by what they depend on. */
#ifndef RUMO_ADJOINT_C
#define RUMO_ADJOINT_C

#include "stages/equations.c"

/* From slopes by the first unknowns, after (rows,), to mu = M'^-1 after; A0' mu goes to before (nx,), which may be after, B' mu
 * is added to inputs (nu,). */
static OUTSIDE void retreat(const equations *q, int k, int substep, const double *after, int rows, double *before,
                            double *inputs) {
    const double *numbers = numbers_of(q, k, substep);
    const rumo_pattern *A0 = &q->problem->A0, *B = &q->problem->B;
    zero(q->local, q->problem->factor.unknowns);
    for (int r = 0; r < rows; ++r) q->local[q->column[r]] = after[r];
    solve_equations(q, numbers, q->steady[k * q->s.m + substep], 1, 1);
    zero(before, q->s.nx);
    for (int e = 0; e < A0->count; ++e) before[A0->column[e]] += numbers[q->A0 + e] * q->local[q->row[A0->row[e]]];
    for (int e = 0; e < B->count; ++e) inputs[B->column[e]] += numbers[q->B + e] * q->local[q->row[B->row[e]]];
}

/* All substeps of an interval: from slopes by the variables at its end, after (rows,), to those by the state at its beginning,
 * before (nx,), and by its inputs (nu,). */
static void retreat_interval(const equations *q, int k, const double *after, double *before, double *inputs) {
    zero(inputs, q->s.nu);
    for (int j = q->s.m - 1; j >= 0; --j) {
        const int last = j == q->s.m - 1;
        retreat(q, k, j, last ? after : before, last ? q->s.rows : q->s.nx, before, inputs);
    }
}

#endif
