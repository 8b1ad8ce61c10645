/* The solution of the last step as a polynomial, and where it leads. */
#ifndef RUMO_EXTRAPOLATE_C
#define RUMO_EXTRAPOLATE_C

#include "integrate/stages.c"

/* Divided differences from the end of the step. */
static void keep_polynomial(rumo_integrator *q) {
    const double *const Z1 = q->Z, *const Z2 = Z1 + q->ld, *const Z3 = Z2 + q->ld;
    double *const first = q->polynomial, *const second = first + q->ld, *const third = second + q->ld;
    for (int i = 0; i < q->n; ++i) {
        const double middle = (Z1[i] - Z2[i]) / (RADAU_C1 - RADAU_C2);
        const double begin = (middle - Z1[i] / RADAU_C1) / RADAU_C2;
        first[i] = (Z2[i] - Z3[i]) / (RADAU_C2 - 1.0);
        second[i] = (middle - first[i]) / (RADAU_C1 - 1.0);
        third[i] = second[i] - begin;
    }
    q->predicts = 1;
}

/* A guess of the stages Z of the next step h, and W: zero where nothing is known. */
static void guess_stages(rumo_integrator *q, double h) {
    if (!q->predicts) {
        zero(q->Z, STAGES * q->ld);
        zero(q->W, STAGES * q->ld);
        return;
    }
    const double *const first = q->polynomial, *const second = first + q->ld, *const third = second + q->ld;
    const double ratio = h / q->last, nodes[STAGES] = {RADAU_C1 * ratio, RADAU_C2 * ratio, ratio};
    for (int k = 0; k < STAGES; ++k) {
        const double c = nodes[k];
        double *const Z = q->Z + k * q->ld;
        for (int i = 0; i < q->n; ++i)
            Z[i] = c * (first[i] + (c + 1.0 - RADAU_C2) * (second[i] + (c + 1.0 - RADAU_C1) * third[i]));
    }
    transform(q);
}

#endif
