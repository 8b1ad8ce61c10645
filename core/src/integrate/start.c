/* Where an integration begins: algebraic variables that fulfil their equations, and a first step. */
#ifndef RUMO_START_C
#define RUMO_START_C

#include "integrate/stages.c"

#define MOST_ROOT_STEPS 50

/* Newton's method for z, with steps halved until the next correction, by the same Jacobian, is shorter (Deuflhard, 2004).
 * Leaves the Jacobian of where it ends, and the rates. Whether there is a root. */
static int find_algebraic(rumo_integrator *q) {
    double *const correction = q->right, *const kept = q->error;
    int near = 0;
    for (int k = 0; k < MOST_ROOT_STEPS; ++k) {
        if (!jacobian_at_start(q)) return 0;
        if (near) return 1;
        if (!factor_for_root(q)) return 0;
        copy(correction, q->rate, q->n);
        zero(correction, q->nx);
        solve_real(q, correction);
        zero(correction, q->nx);
        const double size = size_of(q, correction, 1);
        if (!(size < INFINITY)) return 0;
        copy(kept, q->y, q->n);
        copy(q->W, correction, q->ld);
        double share = 1.0, next;
        for (;; share *= 0.5) {
            if (share < 1e-3) return 0;
            for (int i = q->nx; i < q->n; ++i) q->y[i] = kept[i] + share * q->W[i];
            if (!rates_at(q, q->y, q->right)) continue;
            zero(q->right, q->nx);
            solve_real(q, q->right);
            zero(q->right, q->nx);
            next = size_of(q, q->right, 1);
            if (next <= (1.0 - 0.5 * share) * size || next <= q->iterated) break;
        }
        near = share == 1.0 && next <= q->iterated;
    }
    return 0;
}

/* A step over which the states move little, as far as the rates tell. */
static double first_step(const rumo_integrator *q, double duration) {
    const double speed = size_of(q, q->rate, 1), most = pow(q->relative, 0.25) / q->relative;
    return speed * duration > most ? most / speed : duration;
}

#endif
