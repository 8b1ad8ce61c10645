/* Implausible measurements: held back, unless they go on. */
#ifndef RUMO_GATE_C
#define RUMO_GATE_C

#include "guard/guard.h"
#include "guard/monitor.c"

/* Repeated samples are suspicious only after so many that differed: some callers always pass the same. */
#define GATE_CHANGES 5
/* And only if the prediction has left them by more than this share of the gate's unit, */
#define GATE_MOTION 1e-3
/* and, since they stay, by more than so many of the smallest differences that the sensor shows. */
#define GATE_STEPS 1.25
/* Innovations are known after so many samples. */
#define GATE_LEARNED 40
/* The gate is at first as wide as its settings say, and so many samples later it is GATE_SHARE of that. */
#define GATE_NARROWED 20
/* Until then an innovation below this is no fault: where inputs can do nothing there is nothing to compare noise with. */
#define GATE_FLOOR 0.1
/* Widths of what is usual, over the gate's own: in medians of innovations (eight deviations for a width of 5), in deviations
 * that a sensor is said to have, and in units of what the inputs can do. */
#define GATE_MEDIANS 2.4
#define GATE_DEVIATIONS 2.0
#define GATE_SHARE 0.01
/* The median size of a normal innovation, over its deviation. */
#define GATE_NORMAL 0.6745
/* In a skid innovations grow; a fault comes at once. */
#define GATE_GROWTH 2.5
/* What comes after few samples may be so many times as large as the largest of them. */
#define GATE_GROWTH_AT_FIRST 4.0
/* A prediction that moves on is wrong by a share of that. */
#define GATE_MOVED 0.25
/* An innovation beyond so many medians (four deviations) is a surprise, once so many samples have gone before, if it is more
 * than a share of how far the plan moves the state: where predictions are good to less, a little worse is none. Nor is one that
 * the sensor's noise and steps are enough for. */
#define SURPRISING 6.0
#define SURPRISING_SHARE 0.1
#define SURPRISE_LEARNED 20

/* Whether there is such a reading. */
static inline int is_possible(const rumo_guard *g, int r) {
    const double x = g->read[r];
    return isfinite(x) && x >= g->data.sensors.lowest[r] && x <= g->data.sensors.highest[r];
}

static inline int is_repeated(const rumo_guard *g) {
    return g->has_last && memcmp(g->read, g->last_x, (size_t)g->s.nx * sizeof *g->read) == 0;
}

/* The smallest difference that a sensor shows, as it is said to, or as is seen of one that often repeats itself; else 0. */
static inline double shown_step(const rumo_guard *g, int r) {
    const int has_steps = g->monitor.repeated[r] == MONITOR_LEARNED;
    return larger(g->data.sensors.resolution[r], has_steps ? g->smallest[r] : 0.0);
}

/* Up to where an innovation is no surprise, whatever the inputs can do: as those were that went before. */
static inline double known(const rumo_guard *g, int r) {
    const rumo_sensors *sensors = &g->data.sensors;
    const double noise = GATE_DEVIATIONS * g->gate_width * sensors->noise[r], told = noise + 2.0 * sensors->resolution[r];
    const double at_first = told > 0.0 ? told : GATE_FLOOR;
    if (g->learned == 0) return at_first; /* there is no median yet */
    const double as_before = GATE_MEDIANS * g->gate_width * g->median[r];
    if (g->learned < GATE_LEARNED) return larger(as_before, at_first);
    return larger(as_before, noise + 2.0 * shown_step(g, r));
}

/* The same where nothing else of the sample is suspicious: more while innovations grow, or the plan moves. */
static inline double usual(const rumo_guard *g, int r) {
    const double growth = g->learned < GATE_LEARNED ? GATE_GROWTH_AT_FIRST : GATE_GROWTH;
    return larger(known(g, r), growth * g->before[r]) + GATE_MOVED * g->moved[r];
}

/* How far the plan moves a state until a stage. */
static double span(const rumo_guard *g, int r, int stages) {
    double far = 0.0;
    for (int k = 1; k <= stages; ++k)
        far = larger(far, fabs(g->next_x[k * g->s.nx + r] - g->next_x[r]));
    return far;
}

/* The widest that is plausible, in terms of the gate's unit: at first the gate is wide. */
static inline double widest(const rumo_guard *g, int r, double unit, int suspicious) {
    const double share = pow(GATE_SHARE, smaller(1.0, (double)g->learned / GATE_NARROWED));
    const double wide = share * g->gate_width * unit;
    if (g->learned < GATE_LEARNED || !suspicious) return larger(usual(g, r), wide);
    return 0.5 * larger(known(g, r), wide); /* a good reading that is predicted costs little */
}

/* Whether some reading is implausible. */
static int is_suspicious(const rumo_guard *g, const double *x, const double *reach) {
    for (int r = 0; r < g->s.nx; ++r) {
        if (!is_possible(g, r)) return 1;
        const double innovation = fabs(x[r] - g->next_x[r]);
        if (reach[r] > 0.0 && innovation > widest(g, r, reach[r] + span(g, r, gate_stages(&g->s)), 0)) return 1;
    }
    return 0;
}

/* Whether a measurement is plausible however little the inputs can do: what they can then need not be known. */
static int is_near(const rumo_guard *g, const double *x) {
    if (isinf(g->gate_width) || !g->has_next) return 1;
    if (is_repeated(g)) return 0;
    for (int r = 0; r < g->s.nx; ++r) {
        if (g->held[r] || !is_possible(g, r)) return 0;
        if (fabs(x[r] - g->next_x[r]) > usual(g, r)) return 0;
    }
    return 1;
}

/* A running median: each sample moves it by a factor, however far off it is. */
static void learn(rumo_guard *g, int r, double innovation, double limit) {
    const double step = g->learned < GATE_LEARNED ? 1.25 : 1.05;
    const double least = 1e-9 * fabs(g->next_x[r]) + 1e-12;
    if (g->learned == 0) g->median[r] = smaller(innovation, limit) / (GATE_MEDIANS * 5.0);
    else g->median[r] *= innovation > g->median[r] ? step : 1.0 / step;
    g->median[r] = larger(g->median[r], least);
}

/* What a sensor shows where nothing moves: four deviations that it is said to have, and two of its steps, if it has any. */
static inline double noise_and_steps(const rumo_guard *g, int r) {
    return GATE_NORMAL * SURPRISING * g->data.sensors.noise[r] + 2.0 * shown_step(g, r);
}

/* A reading that is used as it is. */
static void use_reading(rumo_guard *g, int r, double innovation) {
    g->used[r] = g->read[r];
    if (g->learned >= SURPRISE_LEARNED && innovation > SURPRISING * g->median[r])
        g->surprised |= innovation > larger(SURPRISING_SHARE * span(g, r, g->s.N), noise_and_steps(g, r));
    /* What has been believed once while little is known has a way back. */
    g->before[r] = g->learned < GATE_LEARNED ? larger(g->before[r], innovation) : innovation;
}

/* Take a sample over, for what is said of the next: the smallest step of each sensor among others. */
static void remember(rumo_guard *g) {
    for (int r = 0; r < g->s.nx; ++r) {
        const double step = g->has_last ? fabs(g->read[r] - g->last_x[r]) : 0.0;
        if (step > 0.0) {
            if (!(g->smallest[r] > 0.0 && g->smallest[r] <= step)) g->smallest[r] = step;
            g->stayed[r] = 0.0;
        }
        g->last_x[r] = g->read[r];
    }
    g->has_last = 1;
    g->repeats = 0;
    if (g->changes < GATE_CHANGES) ++g->changes;
}

/* All readings are used as they are. */
static void use_all(rumo_guard *g, const double *x) {
    for (int r = 0; r < g->s.nx; ++r) {
        const double innovation = fabs(x[r] - g->next_x[r]);
        const double limit = g->learned ? innovation : larger(usual(g, r), span(g, r, g->s.N)); /* before it is used */
        use_reading(g, r, innovation);
        learn(g, r, innovation, limit);
        g->held[r] = 0;
    }
    if (!is_repeated(g)) remember(g);
    g->missing = 0;
    if (g->learned < GATE_LEARNED) ++g->learned;
}

/* Whether a sample that repeats the last one is frozen: the prediction has moved by what the sensors show. */
static int is_frozen(rumo_guard *g, const double *x, const double *reach) {
    int moved = 0;
    for (int r = 0; r < g->s.nx; ++r) {
        if (reach[r] == 0.0) continue;
        const double innovation = fabs(x[r] - g->next_x[r]);
        g->stayed[r] += innovation;
        const double step = larger(g->data.sensors.resolution[r], g->smallest[r]);
        if (step == 0.0) continue; /* a sensor that has shown none may have any */
        const int shows = g->stayed[r] > GATE_STEPS * step;
        moved |= shows && innovation > GATE_MOTION * (reach[r] + span(g, r, gate_stages(&g->s)));
    }
    return moved && g->changes == GATE_CHANGES;
}

/* Whether a state's reading is held back: it is far from the prediction, and has not been so for long. */
static int is_held(rumo_guard *g, const double *x, int r, double limit, double agreement, int *believed) {
    if (!is_possible(g, r)) return 1;
    if (fabs(x[r] - g->next_x[r]) <= limit) return g->held[r] = 0;
    const int agrees = g->held[r] > 0 && fabs(x[r] - g->suspect[r]) <= agreement;
    g->held[r] = agrees ? g->held[r] + 1 : 1;
    g->suspect[r] = x[r];
    if (g->held[r] <= g->gate_patience) return 1;
    *believed = 1; /* unless too many others are not: then it still is next time */
    return 0;
}

/* Whether a measurement is used: x (nx,), in which readings that are held back become what is predicted.
 *
 * Held back is what cannot be: readings that are farther from the prediction than is usual, and than a share of all that inputs
 * can do over the next stages (reach: (nx,), NULL where not known; a state with a reach of 0 has nothing to compare with), plus
 * how far the plan goes: at first many times that, and less with each sample. Where half of all readings
 * are, or where a sample repeats the one before in every state although the prediction has moved, none is used. All are
 * believed when they go on for too long.
 */
static int plausible(rumo_guard *g, double *x, const double *reach) {
    const int nx = g->s.nx;
    g->surprised = 0;
    if (isinf(g->gate_width) || !g->has_next) {
        for (int r = 0; r < nx; ++r) g->held[r] = 0;
        g->missing = 0;
        if (g->has_next) use_all(g, x);
        copy(g->last_x, g->read, nx);
        copy(g->used, g->read, nx);
        g->has_last = 1;
        interrupt_monitor(&g->monitor, nx);
        return 1;
    }
    find_stuck(g, g->read);
    if (is_near(g, x) || !reach) {
        use_all(g, x);
        find_leaving(g, x);
        return 1;
    }
    const int suspicious = is_suspicious(g, x, reach);
    int judged = 0, bad = 0, believed = 0, missing = 0;
    for (int r = 0; r < nx; ++r) {
        const double innovation = fabs(x[r] - g->next_x[r]), unit = reach[r] + span(g, r, gate_stages(&g->s));
        const double limit = widest(g, r, unit, suspicious), agreement = widest(g, r, unit, 0) + g->moved[r];
        const int possible = is_possible(g, r), there = reach[r] > 0.0 || !possible;
        missing |= !possible;
        g->out[r] = there && is_held(g, x, r, limit, agreement, &believed);
        judged += there;
        bad += g->out[r];
        if (!g->out[r]) use_reading(g, r, innovation);
        if (possible) learn(g, r, innovation, limit);
        const double deviations = possible ? GATE_NORMAL * innovation / g->median[r] : INFINITY;
        if (g->out[r]) complain(g, r, deviations, possible ? g->held[r] : g->missing + 1, RUMO_HELD);
    }
    if (g->learned < GATE_LEARNED) ++g->learned;
    if (bad && 2 * bad >= judged) return 0;
    /* The plan, of which predictions are, is good for so many samples. */
    g->missing = missing ? g->missing + 1 : 0;
    if (g->missing >= g->s.N - g->s.d) return 0;
    if (believed) g->has_guess = 0; /* what was predicted is wrong */
    if (!is_repeated(g)) {
        if (!bad) remember(g);
    } else if (is_frozen(g, x, reach)) {
        if (++g->repeats <= g->gate_patience) return 0;
        g->repeats = g->changes = 0;
        g->has_guess = 0;
    }
    for (int r = 0; r < nx; ++r) {
        if (g->out[r]) {
            x[r] = g->next_x[r];
            g->late[r] = NAN;
        } else {
            g->held[r] = 0;
        }
    }
    find_leaving(g, x);
    return 1;
}

/* Whether a sample is one that can be used, as far as its numbers say: OPTIMAL, or why not. */
static rumo_status finite_sample(rumo_guard *g, int reference_is_finite) {
    int impossible = 0;
    if (g->symptoms) zero(g->health, 3 * g->s.nx);
    g->symptoms = 0;
    for (int r = 0; r < g->s.nx; ++r) impossible += !is_possible(g, r);
    const int gated = g->has_next && !isinf(g->gate_width);
    if (impossible && (!gated || 2 * impossible >= g->s.nx)) return RUMO_BAD_MEASUREMENT;
    return reference_is_finite ? RUMO_OPTIMAL : RUMO_BAD_REFERENCE;
}

#endif
