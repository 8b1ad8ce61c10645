/* The stages of a step, by simplified Newton iterations. Source: Hairer and Wanner (1996), section IV.8. */
#ifndef RUMO_STAGES_OF_RADAU_C
#define RUMO_STAGES_OF_RADAU_C

#include "integrate/linear_system.c"
#include "integrate/right_side.c"

/* Corrections until a step is given up; where it cannot be shorter, there are more. */
#define MOST_CORRECTIONS 7
#define MOST_OF_FIXED 50

/* W = T^-1 Z and Z = T W. */
static void transform(const rumo_integrator *q) {
    const double *const Z1 = q->Z, *const Z2 = Z1 + q->ld, *const Z3 = Z2 + q->ld;
    double *const W1 = q->W, *const W2 = W1 + q->ld, *const W3 = W2 + q->ld;
    for (int i = 0; i < q->ld; ++i) {
        W1[i] = RADAU_TI11 * Z1[i] + RADAU_TI12 * Z2[i] + RADAU_TI13 * Z3[i];
        W2[i] = RADAU_TI21 * Z1[i] + RADAU_TI22 * Z2[i] + RADAU_TI23 * Z3[i];
        W3[i] = RADAU_TI31 * Z1[i] + RADAU_TI32 * Z2[i] + RADAU_TI33 * Z3[i];
    }
}

static void transform_back(const rumo_integrator *q) {
    double *const Z1 = q->Z, *const Z2 = Z1 + q->ld, *const Z3 = Z2 + q->ld;
    const double *const W1 = q->W, *const W2 = W1 + q->ld, *const W3 = W2 + q->ld;
    for (int i = 0; i < q->ld; ++i) {
        Z1[i] = RADAU_T11 * W1[i] + RADAU_T12 * W2[i] + RADAU_T13 * W3[i];
        Z2[i] = RADAU_T21 * W1[i] + RADAU_T22 * W2[i] + RADAU_T23 * W3[i];
        Z3[i] = W1[i] + W2[i];
    }
}

/* What the stage equations lack: T^-1 F - Lambda / h M W, with F in the lanes of the terms. */
static void residual_of_stages(const rumo_integrator *q, double h) {
    const double gamma = RADAU_GAMMA / h, alpha = RADAU_ALPHA / h, beta = RADAU_BETA / h;
    const double *const W1 = q->W, *const W2 = W1 + q->ld, *const W3 = W2 + q->ld;
    double *const right1 = q->right, *const right2 = right1 + q->ld, *const right3 = right2 + q->ld;
    for (int i = 0; i < q->n; ++i) {
        const double *const F = q->terms + (ptrdiff_t)i * LANES;
        right1[i] = RADAU_TI11 * F[0] + RADAU_TI12 * F[1] + RADAU_TI13 * F[2];
        right2[i] = RADAU_TI21 * F[0] + RADAU_TI22 * F[1] + RADAU_TI23 * F[2];
        right3[i] = RADAU_TI31 * F[0] + RADAU_TI32 * F[1] + RADAU_TI33 * F[2];
    }
    for (int i = 0; i < q->nx; ++i) {
        right1[i] -= gamma * W1[i];
        right2[i] -= alpha * W2[i] - beta * W3[i];
        right3[i] -= beta * W2[i] + alpha * W3[i];
    }
}

/* Root mean square of vectors (count, ld) in units of the tolerances. */
static double size_of(const rumo_integrator *q, const double *x, int count) {
    double lanes[LANES] = {0.0};
    for (int k = 0; k < count; ++k)
        for (int j = 0; j < q->ld; j += LANES)
            for (int l = 0; l < LANES; ++l) {
                const double share = x[k * q->ld + j + l] * q->weights[j + l];
                lanes[l] += share * share;
            }
    return sqrt(sum_of_lanes(lanes) / (q->n * count));
}

/* From a guess W of the stages to the stages Z; how many corrections it took, or 0 where they do not lead there. What is to
 * be tried in place of the step is then *shorter times it. */
static int solve_stages(rumo_integrator *q, double h, double *shorter) {
    const int most = q->system.fixed_steps ? MOST_OF_FIXED : MOST_CORRECTIONS;
    double before = 0.0, ratio = 0.0;
    *shorter = 0.5;
    q->quality = pow(larger(q->quality, 1e-16), 0.8);
    q->contraction = 0.0;
    for (int k = 1; k <= most; ++k) {
        if (!rates_of_stages(q)) return 0;
        residual_of_stages(q, h);
        solve_all(q, q->right);
        const double correction = size_of(q, q->right, STAGES);
        if (!(correction < INFINITY)) return 0;
        if (k > 1) {
            const double now = correction / before;
            q->contraction = k == 2 ? now : sqrt(now * ratio);
            ratio = now;
            if (!(q->contraction < 0.99)) return 0;
            q->quality = q->contraction / (1.0 - q->contraction);
            const double left = q->quality * correction * pow(q->contraction, most - k) / q->iterated;
            if (left >= 1.0) {
                *shorter = 0.8 * pow(clip(left, 1e-4, 20.0), -1.0 / (4 + most - k));
                return 0;
            }
        }
        before = larger(correction, 1e-300);
        for (int i = 0; i < STAGES * q->ld; ++i) q->W[i] += q->right[i];
        transform_back(q);
        if (q->quality * correction <= q->iterated) return k;
    }
    return 0;
}

#endif
