/* Back along the equations: slopes by the unknowns of a substep become slopes by what they depend on. */
#ifndef RUMO_ADJOINT_C
#define RUMO_ADJOINT_C

#include "stages/equations.c"

/* From slopes by the first unknowns, after (rows, ld), to mu = M'^-1 after; A0' mu goes to before (nx, ld), B' mu is added to
 * inputs (nu, ld). */
static WITHIN void retreat_some(const equations *q, int k, int substep, const double *after, int rows, double *before,
                                double *inputs, int ld, const int length) {
    const double *numbers = numbers_of(q, k, substep);
    const rumo_pattern *A0 = &q->problem->A0, *B = &q->problem->B;
    zero(q->local, q->problem->factor.unknowns * length);
    for (int r = 0; r < rows; ++r) copy(q->local + q->column[r] * length, after + r * ld, length);
    solve_equations(q, numbers, q->steady[k * q->s.m + substep], length, 1);
    for (int r = 0; r < q->s.nx; ++r) zero(before + r * ld, length);
    for (int e = 0; e < A0->count; ++e)
        add_product(before + A0->column[e] * ld, numbers + q->A0 + e, q->local + q->row[A0->row[e]] * length, 1, length);
    for (int e = 0; e < B->count; ++e)
        add_product(inputs + B->column[e] * ld, numbers + q->B + e, q->local + q->row[B->row[e]] * length, 1, length);
}

/* As many columns as a multiple of LANES. */
static OUTSIDE void retreat_columns(const equations *q, int k, int substep, const double *after, int rows,
                                    double *before, double *inputs, int ld, int columns) {
    for (int c = 0; c < columns; c += LANES)
        retreat_some(q, k, substep, after + c, rows, before + c, inputs + c, ld, LANES);
}

/* One column. */
static OUTSIDE void retreat(const equations *q, int k, int substep, const double *after, int rows, double *before,
                            double *inputs) {
    retreat_some(q, k, substep, after, rows, before, inputs, 1, 1);
}

#endif
