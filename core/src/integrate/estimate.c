/* The error of a step, from an embedded formula of order 3, filtered so that stiff parts do not count. Source: Hairer and
 * Wanner (1996), section IV.8. */
#ifndef RUMO_ESTIMATE_C
#define RUMO_ESTIMATE_C

#include "integrate/stages.c"

/* In units of the tolerances, from the stages Z and the rates at the beginning. Where a step is refused by it, and may have
 * met a fast transient, `doubted`, it is filtered once more. */
static double estimated_error(rumo_integrator *q, double h, int doubted) {
    const double *const Z1 = q->Z, *const Z2 = Z1 + q->ld, *const Z3 = Z2 + q->ld;
    double *const of_stages = q->right + q->ld, *const error = q->error;
    for (int i = 0; i < q->n; ++i) {
        of_stages[i] = i < q->nx ? (RADAU_E1 * Z1[i] + RADAU_E2 * Z2[i] + RADAU_E3 * Z3[i]) / h : 0.0;
        q->right[i] = of_stages[i] + q->rate[i];
    }
    copy(error, of_stages, q->ld);
    solve_real(q, q->right);
    double size = size_of(q, q->right, 1);
    if (size < 1.0 || !doubted || !(size < INFINITY)) return larger(size, 1e-10);
    for (int i = 0; i < q->n; ++i) q->right[i] += q->y[i];
    if (!rates_at(q, q->right, q->right)) return INFINITY;
    for (int i = 0; i < q->n; ++i) q->right[i] += error[i];
    solve_real(q, q->right);
    size = size_of(q, q->right, 1);
    return larger(size, 1e-10);
}

#endif
