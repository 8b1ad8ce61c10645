/* From one state to another, step by step. Source: Hairer and Wanner (1996), section IV.8; Gustafsson (1994) for the control
 * of steps. */
#ifndef RUMO_ADVANCE_C
#define RUMO_ADVANCE_C

#include "integrate/estimate.c"
#include "integrate/extrapolate.c"
#include "integrate/integrator.c"
#include "integrate/start.c"

/* Steps, refused ones among them, until an integration is given up; and the shortest, over the time that has passed. */
#define MOST_TRIES 100000
#define SHORTEST 1e-15
/* A Jacobian is kept while Newton's method contracts as fast, and the systems while a step would grow by less. */
#define FAST 1e-2
#define SLIGHTLY 1.2
/* Of what an error would allow, and how much steps may grow and shrink from one to the next. */
#define SAFETY 0.9
#define GROWTH 8.0
#define SHRINKAGE 0.2
/* Variables that moved by more than this, over their sizes and scales, may have made a mode grow that did not; so may steps that
 * errors did not limit, with less than this of what is allowed, one that is most of a sample, and many of others; and by how much
 * a step may then have been too long. */
#define MOVED_FAR 0.1
#define EASY 1e-4
#define MANY_STEPS 12
#define TOO_LONG 2.0

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

/* A step for what is left: two equal ones in place of one and a short rest. */
static double in_equal_parts(double step, double left) {
    if (step >= 0.9999 * left) return left;
    return step > 0.5 * left ? 0.5 * left : step;
}

/* The next step's length, of what is left. */
static double fitting(rumo_integrator *q, double left) {
    const double step = in_equal_parts(q->step, left), longest = longest_growing_step(q, step);
    return longest < step ? in_equal_parts(longest, left) : step;
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

/* A step h that is tried, and what came of it. */
typedef struct trial {
    double h, error, shorter; /* error in units of the tolerances; what to try instead, over h, without a solution */
    int corrections;          /* that the stages took; 0 without a solution */
    int first;                /* after a jump */
    int refused;              /* whether a longer one was refused before */
    int renewed;              /* whether the Jacobian is that of its end */
} trial;

static void try_step(rumo_integrator *q, trial *t) {
    t->error = INFINITY;
    t->renewed = 0;
    t->shorter = 0.5;
    guess_stages(q, t->h);
    t->corrections = factor_for_step(q, t->h) ? solve_stages(q, t->h, &t->shorter) : 0;
    if (t->corrections) t->error = q->system.fixed_steps ? 0.5 : estimated_error(q, t->h, t->first || t->refused);
}

/* With a Jacobian of where the step begins, or else a shorter one. */
static void refuse(rumo_integrator *q, trial *t) {
    ++q->work.rejected;
    t->refused = 1;
    if (t->corrections) q->step = growth(t->error, t->corrections) * t->h;
    else if (q->fresh) q->step = t->shorter * t->h;
    q->predicts = q->predicts && (t->corrections || !q->fresh);
    q->has_jacobian = q->fresh;
}

/* Whether a step leads to where modes grow that it cannot have followed. Leaves the Jacobian of its end where that may be far
 * from the one that there was. */
static int overlooks_growth(rumo_integrator *q, trial *t, double duration) {
    double *const end = q->error, far = 0.0;
    for (int i = 0; i < q->n; ++i) {
        end[i] = q->y[i] + q->Z[2 * q->ld + i];
        far = larger(far, fabs(end[i] - q->looked[i]) * q->relative / (q->absolute[i] + q->relative * fabs(q->looked[i])));
    }
    const int unlooked = ++q->unlooked, easy = t->error < EASY || 2.0 * t->h >= duration;
    const int due = far > MOVED_FAR || unlooked > MANY_STEPS || (easy && unlooked * LOOK_AT >= q->loops * q->loops);
    t->renewed = (q->depends & ON_VARIABLES) && q->loops >= 0 && due;
    return t->renewed && jacobian_at(q, end) && t->h > TOO_LONG * longest_growing_step(q, t->h / TOO_LONG);
}

static void accept(rumo_integrator *q, trial *t) {
    ++q->work.steps;
    double grown = growth(t->error, t->corrections);
    if (t->first) q->beginning = grown * t->h;
    else if (q->last > 0.0) grown = smaller(grown, predicted_growth(q, t->h, t->error));
    if (t->refused) grown = smaller(grown, 1.0);
    keep_polynomial(q);
    for (int i = 0; i < q->n; ++i) q->y[i] += q->Z[2 * q->ld + i];
    set_weights(q);
    q->last = t->h;
    q->before = larger(t->error, 1e-2);
    if (!t->renewed) {
        q->fresh = 0;
        q->has_jacobian = q->contraction <= FAST;
    }
    const double next = q->has_jacobian && grown >= 1.0 && grown <= SLIGHTLY ? t->h : grown * t->h;
    q->step = t->h < q->step ? larger(next, q->step) : next; /* it was cut to what was left */
    t->first = t->refused = 0;
}

/* From y, where the rates are known. */
static rumo_ending integrate(rumo_integrator *q, double duration, int jumped) {
    const int fixed = q->system.fixed_steps;
    const long long begun = q->work.steps;
    trial t = {.first = jumped};
    int tries = 0;
    for (double passed = 0.0; passed < duration;) {
        const double left = duration - passed;
        t.h = fixed ? duration / fixed : fitting(q, left);
        if (tries++ == MOST_TRIES + fixed) return RUMO_TOO_MANY;
        if (!(t.h > 0.0 && t.h > SHORTEST * passed)) return RUMO_TOO_SHORT;
        if (!q->has_jacobian && !jacobian_at_start(q)) return RUMO_NO_VALUE;
        try_step(q, &t);
        if (!(t.error < 1.0)) {
            if (fixed && q->fresh) return RUMO_TOO_SHORT;
            refuse(q, &t);
            continue;
        }
        if (!fixed && overlooks_growth(q, &t, duration)) {
            ++q->work.rejected;
            t.refused = 1;
            q->step = q->longest;
            q->has_jacobian = 0;
            continue;
        }
        accept(q, &t);
        if (!all_finite(q->y, q->n)) return RUMO_NO_VALUE;
        passed = t.h >= left || q->work.steps - begun == fixed ? duration : passed + t.h;
        if (passed < duration && q->has_jacobian && !t.renewed && !rates_at(q, q->y, q->rate)) return RUMO_NO_VALUE;
    }
    return RUMO_ARRIVED;
}

static rumo_ending advance_integrator(rumo_integrator *q, const double *x, const double *u, const double *p, double duration,
                                      double *end) {
    const rumo_sizes *const s = &q->system.sizes;
    if (!all_finite(x, q->nx) || !all_finite(u, s->inputs) || !all_finite(p, s->parameters)) return RUMO_NO_VALUE;
    if (!(duration > 0.0 && duration < INFINITY)) return RUMO_NO_VALUE;
    int jumped = hold(u, s->inputs, q->u, q->u_lanes) ? ON_INPUTS : 0;
    jumped |= hold(p, s->parameters, q->p, q->p_lanes) ? ON_PARAMETERS : 0;
    const int steered = jumped & q->depends;
    if (!q->moving || memcmp(q->y, x, (size_t)q->nx * sizeof *x) != 0) {
        q->moving = q->predicts = q->has_jacobian = 0;
        forget_modes(q);
        q->factored = q->step = q->last = q->beginning = 0.0;
        q->quality = 1.0;
        jumped |= ON_VARIABLES;
        copy(q->y, x, q->nx);
    }
    q->jumped = q->jumped || steered;
    if (steered && q->loops >= 0) q->has_jacobian = 0;
    if (jumped && (q->depends & ON_VARIABLES) && q->loops >= 0 && q->loops * q->loops <= LOOK_AT) q->has_jacobian = 0;
    q->fresh = q->fresh && !steered;
    if (jumped) q->predicts = 0; /* rates jump: what they were says no more of the stages than nothing does */
    copy(q->start, q->y, q->n);
    set_weights(q);
    rumo_ending ending = RUMO_ARRIVED;
    if (q->nz > 0 && jumped) ending = find_algebraic(q) ? RUMO_ARRIVED : RUMO_NO_ROOT;
    else if (!(q->has_jacobian ? rates_at(q, q->y, q->rate) : jacobian_at_start(q))) ending = RUMO_NO_VALUE;
    if (ending == RUMO_ARRIVED) {
        if (q->step == 0.0) q->step = first_step(q, duration);
        else if (jumped && q->beginning > 0.0) q->step = smaller(q->beginning, q->step);
        ending = integrate(q, duration, jumped != 0);
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
