/* The right-hand side (f, g) and its Jacobian, by tapes that compute up to eight points at once. */
#ifndef RUMO_RIGHT_SIDE_C
#define RUMO_RIGHT_SIDE_C

#include "integrate/integrator.h"
#include "stages/tape.c"

static inline guess_lanes arguments_of(const rumo_integrator *q) {
    const double *const x = q->y_lanes, *const z = x + (ptrdiff_t)q->nx * LANES;
    return (guess_lanes){{x, x, q->u_lanes, q->p_lanes, z}, {LANES, LANES, LANES, LANES, LANES}};
}

/* Of the stages: rates of stage i in lane i of the first n terms. Whether they are finite. */
static int rates_of_stages(rumo_integrator *q) {
    const double *const Z1 = q->Z, *const Z2 = Z1 + q->ld, *const Z3 = Z2 + q->ld;
    for (int i = 0; i < q->n; ++i) {
        double *const lanes = q->y_lanes + (ptrdiff_t)i * LANES;
        const double y3 = q->y[i] + Z3[i];
        lanes[0] = q->y[i] + Z1[i];
        lanes[1] = q->y[i] + Z2[i];
        for (int l = 2; l < LANES; ++l) lanes[l] = y3;
    }
    const guess_lanes in = arguments_of(q);
    ++q->work.rates;
    return q->code.rates(&q->system.rates, &in, LANES, q->registers, q->terms);
}

static void to_all_lanes(const double *x, int count, double *lanes) {
    for (int i = 0; i < count; ++i)
        for (int l = 0; l < LANES; ++l) lanes[(ptrdiff_t)i * LANES + l] = x[i];
}

/* At one point y (n,), into `rate`. Whether they are finite. */
static int rates_at(rumo_integrator *q, const double *y, double *rate) {
    to_all_lanes(y, q->n, q->y_lanes);
    const guess_lanes in = arguments_of(q);
    ++q->work.rates;
    const int finite = q->code.rates(&q->system.rates, &in, LANES, q->registers, q->terms);
    for (int i = 0; i < q->n; ++i) rate[i] = q->terms[(ptrdiff_t)i * LANES];
    return finite;
}

/* With more states than the root of this in loops, Jacobians are not looked at in each step, but after jumps: that takes longer
 * than a step. */
#define LOOK_AT 1024

/* The same with the Jacobian, into q->rate and q->J. */
static int jacobian_at(rumo_integrator *q, const double *y) {
    const rumo_pattern *const J = &q->system.J;
    to_all_lanes(y, q->n, q->y_lanes);
    copy(q->looked, y, q->n);
    const guess_lanes in = arguments_of(q);
    ++q->work.jacobians;
    const int finite = q->code.jacobian(&q->system.jacobian, &in, LANES, q->registers, q->terms);
    for (int i = 0; i < q->n; ++i) q->rate[i] = q->terms[(ptrdiff_t)i * LANES];
    int changed = 0;
    for (int e = 0; e < J->count; ++e) {
        const double value = q->terms[(ptrdiff_t)(J->first + e) * LANES];
        changed |= !(q->J[e] == value);
        q->J[e] = value;
    }
    if (changed) q->factored = 0.0;
    const int due = q->jumped || (q->work.steps - q->seen + 1) * LOOK_AT >= (long long)q->loops * q->loops;
    if (changed && due) q->longest = q->exact = 0;
    q->jumped = q->unlooked = 0;
    return q->has_jacobian = q->fresh = finite && all_finite(q->J, J->count);
}

/* The same where the step begins. */
static int jacobian_at_start(rumo_integrator *q) { return jacobian_at(q, q->y); }

#endif
