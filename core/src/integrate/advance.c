/* From one state to another, step by step. Source: Hairer and Wanner (1996), section IV.8; Gustafsson (1994) for the control
 * of steps. */
#ifndef RUMO_ADVANCE_C
#define RUMO_ADVANCE_C

#include "integrate/estimate.c"
#include "integrate/extrapolate.c"
#include "integrate/integrator.c"
#include "integrate/start.c"

/* Steps until an integration is given up, and the shortest, over what is to be integrated. */
#define MOST_TRIES 20000
#define SHORTEST 1e-13
/* A Jacobian is kept while Newton's method contracts as fast, and the systems while a step would grow by less. */
#define FAST 1e-3
#define SLIGHTLY 1.2
/* Of what an error would allow, and how much steps may grow and shrink from one to the next. */
#define SAFETY 0.9
#define GROWTH 8.0
#define SHRINKAGE 0.2

static void set_weights(rumo_integrator *q) {
    for (int i = 0; i < q->n; ++i) q->weights[i] = 1.0 / (q->absolute[i] + q->relative * fabs(q->y[i]));
}

/* Takes over what is held; whether it is other than before. */
static int hold(const double *values, int count, double *held, double *lanes) {
    if (memcmp(held, values, (size_t)count * sizeof *held) == 0) return 0;
    copy(held, values, count);
    to_all_lanes(values, count, lanes);
    return 1;
}

/* The next step's length, of what is left: two equal ones in place of one and a short rest. */
static double fitting(const rumo_integrator *q, double left) {
    const double step = q->step;
    if (step >= 0.9999 * left) return left;
    return step > 0.5 * left ? 0.5 * left : step;
}

/* By how much the next step may be longer after an error and so many corrections. */
static double growth(double error, int corrections) {
    const double careful = SAFETY * (1.0 + 2.0 * MOST_CORRECTIONS) / (corrections + 2.0 * MOST_CORRECTIONS);
    return clip(smaller(SAFETY, careful) * pow(error, -0.25), SHRINKAGE, GROWTH);
}

/* The same where the step before says how errors change. */
static double predicted_growth(const rumo_integrator *q, double h, double error) {
    const double change = q->last / h * pow(error * error / q->before, 0.25) / SAFETY;
    return clip(1.0 / change, SHRINKAGE, GROWTH);
}

static rumo_ending integrate(rumo_integrator *q, double duration, int jumped) {
    const int fixed = q->system.fixed_steps;
    double left = duration;
    int refused = 0, steps = 0, first = jumped;
    if (fixed) q->step = duration / fixed;
    while (left > 0.0) {
        const double h = fixed ? duration / fixed : fitting(q, left);
        double shorter;
        if (steps == (fixed ? fixed : MOST_TRIES)) return fixed ? RUMO_ARRIVED : RUMO_TOO_MANY;
        if (!(h > SHORTEST * duration)) return RUMO_TOO_SHORT;
        if (!q->has_jacobian && !jacobian_at_start(q)) return RUMO_NO_VALUE;
        guess_stages(q, h);
        const int corrections = factor_for_step(q, h) ? solve_stages(q, h, &shorter) : 0;
        if (!corrections) {
            if (!q->fresh) q->has_jacobian = 0;
            else if (fixed) return RUMO_TOO_SHORT;
            else q->step = (q->factored > 0.0 ? shorter : 0.5) * h;
            q->predicts = q->predicts && !q->fresh;
            ++q->work.rejected;
            if (++steps == MOST_TRIES) return RUMO_TOO_MANY;
            refused = 1;
            continue;
        }
        const double error = fixed ? 0.5 : estimated_error(q, h, first || refused);
        double grown = growth(error, corrections);
        if (!(error < 1.0)) {
            q->step = (first && !(error < INFINITY) ? 0.1 : grown) * h;
            if (!q->fresh) q->has_jacobian = 0;
            ++q->work.rejected;
            if (++steps == MOST_TRIES) return RUMO_TOO_MANY;
            refused = 1;
            continue;
        }
        ++steps;
        ++q->work.steps;
        if (q->last > 0.0 && !first) grown = smaller(grown, predicted_growth(q, h, error));
        if (first) q->beginning = grown * h;
        keep_polynomial(q);
        for (int i = 0; i < q->n; ++i) q->y[i] += q->Z[2 * q->ld + i];
        if (!all_finite(q->y, q->n)) return RUMO_NO_VALUE;
        left = h >= left ? 0.0 : left - h;
        q->last = h;
        q->before = larger(error, 1e-2);
        q->fresh = 0;
        set_weights(q);
        const double next = refused ? smaller(grown, 1.0) : grown;
        const int keeps = q->contraction <= FAST;
        if (!keeps) q->has_jacobian = 0;
        const double wanted = keeps && next >= 1.0 && next <= SLIGHTLY ? h : next * h;
        if (!fixed) q->step = h < q->step ? larger(wanted, q->step) : wanted; /* it was cut to what was left */
        refused = first = 0;
        if (left > 0.0 && !(q->has_jacobian ? rates_at(q, q->y, q->rate) : jacobian_at_start(q))) return RUMO_NO_VALUE;
    }
    return RUMO_ARRIVED;
}

static rumo_ending advance_integrator(rumo_integrator *q, const double *x, const double *u, const double *p, double duration,
                                      double *end) {
    const rumo_sizes *const s = &q->system.sizes;
    if (!all_finite(x, q->nx) || !all_finite(u, s->inputs) || !all_finite(p, s->parameters)) return RUMO_NO_VALUE;
    if (!(duration > 0.0 && duration < INFINITY)) return RUMO_NO_VALUE;
    int jumped = hold(u, s->inputs, q->u, q->u_lanes);
    jumped = hold(p, s->parameters, q->p, q->p_lanes) || jumped;
    if (!q->moving || memcmp(q->y, x, (size_t)q->nx * sizeof *x) != 0) {
        q->moving = q->predicts = q->has_jacobian = 0;
        q->factored = q->step = q->last = q->beginning = 0.0;
        q->quality = 1.0;
        jumped = 1;
        copy(q->y, x, q->nx);
    }
    copy(q->start, q->y, q->n);
    set_weights(q);
    rumo_ending ending = RUMO_ARRIVED;
    if (q->nz > 0 && jumped) ending = find_algebraic(q) ? RUMO_ARRIVED : RUMO_NO_ROOT;
    else if (!rates_at(q, q->y, q->rate)) ending = RUMO_NO_VALUE;
    if (ending == RUMO_ARRIVED) {
        if (q->step == 0.0) q->step = first_step(q, duration);
        else if (jumped && q->beginning > 0.0) q->step = smaller(q->beginning, q->step);
        ending = integrate(q, duration, jumped);
    }
    q->moving = ending == RUMO_ARRIVED;
    if (q->moving) copy(end, q->y, q->nx);
    else copy(q->y, q->start, q->n);
    return ending;
}

static const double *algebraic_variables(const rumo_integrator *q) { return q->y + q->nx; }

static void seek_algebraic(rumo_integrator *q, const double *z) {
    copy(q->y + q->nx, z, q->nz);
    q->moving = 0;
}

static const rumo_work *integrator_work(const rumo_integrator *q) { return &q->work; }

#endif
