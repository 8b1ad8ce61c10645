/* Faults that no single reading gives away: readings that leave the prediction bit by bit, and such that stay as they are. */
#ifndef RUMO_MONITOR_C
#define RUMO_MONITOR_C

#include "guard/age.c"
#include "guard/guard.h"

/* A reading is compared with what was predicted from all before it, which are forgotten over so many samples, */
#define MONITOR_SAMPLES 25
/* and the difference is smoothed over so many. */
#define MONITOR_SMOOTH 5
/* How large that usually is, is known after so many samples, remembered for so many, and hardly grows by what is far beyond. */
#define MONITOR_LEARNED 50
#define MONITOR_MEMORY 200
#define MONITOR_CLIP 2.0
/* Until then a sample counts up to so many medians of innovations, three deviations, and a share of how far the plan moved. */
#define MONITOR_MEDIANS 4.5
#define MONITOR_MOVED 0.25
/* What was learned holds up to so many times the way that the prediction went then; a share of what is beyond may be wrong. */
#define MONITOR_FURTHER 3.0
#define MONITOR_UNKNOWN 0.03
/* A prediction may be wrong by this share of the way that it goes in MONITOR_SAMPLES, and of the number itself. */
#define MONITOR_SHARE 0.003
#define MONITOR_DIGITS 1e-6
/* A reading leaves the prediction beyond so many deviations; what lasts no longer than that is soon forgotten. */
#define MONITOR_LIMIT 2.5
#define MONITOR_FAR 8.0
/* One that has changed with each of MONITOR_LEARNED samples is stuck after so many that are all the same, if it should have
 * moved by this share of its usual change. */
#define MONITOR_REPEATS 8
#define MONITOR_MOTION 0.1
/* A repeat counts as much as so many changes. */
#define MONITOR_PRICE 10
/* Nobody counts any further. */
#define MONITOR_MOST 1000000000

/* Say what is wrong with a reading. */
static void complain(rumo_guard *g, int r, double deviations, int samples, rumo_symptom symptom) {
    double *said = g->health + 3 * r;
    g->symptoms += !(said[2] > 0.0);
    said[0] = deviations;
    said[1] = samples;
    said[2] = symptom;
}

/* Readings as they come: which of them are stuck, while others change. */
static void find_stuck(rumo_guard *g, const double *x) {
    monitor *m = &g->monitor;
    int changed = 0;
    for (int r = 0; r < g->s.nx; ++r) {
        const double step = fabs(x[r] - m->reading[r]);
        if (!isfinite(x[r])) continue;
        if (m->has_reading && !(step > 0.0)) {
            m->repeats[r] += m->repeats[r] < MONITOR_MOST;
            m->repeated[r] += m->repeated[r] < MONITOR_LEARNED;
            m->way_since[r] += g->moved[r];
            continue;
        }
        changed = 1;
        const int repeats = m->repeats[r] < MONITOR_REPEATS ? m->repeats[r] : MONITOR_REPEATS;
        const int count = m->changes[r] + 1 - MONITOR_PRICE * repeats;
        m->changes[r] = count < 0 ? 0 : count < MONITOR_LEARNED ? count : MONITOR_LEARNED;
        m->repeats[r] = 0;
        m->way_since[r] = 0.0;
        if (m->has_reading) m->usual[r] += 0.1 * (step - m->usual[r]);
        m->reading[r] = x[r];
    }
    m->has_reading = 1;
    for (int r = 0; changed && r < g->s.nx; ++r)
        if (m->repeats[r] >= MONITOR_REPEATS && m->changes[r] == MONITOR_LEARNED &&
            m->way_since[r] > MONITOR_MOTION * m->usual[r])
            complain(g, r, m->repeats[r], m->repeats[r], RUMO_STUCK);
}

/* Readings as they are used, x (nx,): which of them leave the prediction.
 *
 * An observer would predict the next state from its own estimate; that is x - apart. By expect_reading(), a share `kept` of
 * apart is there again at the next sample, on top of that sample's innovation. */
static void find_leaving(rumo_guard *g, const double *x) {
    monitor *m = &g->monitor;
    if (!m->expects) {
        interrupt_monitor(m, g->s.nx);
        return;
    }
    for (int r = 0; r < g->s.nx; ++r) {
        const int learned = m->learned[r] >= MONITOR_LEARNED;
        const double far = learned ? MONITOR_FAR * m->unit[r] : INFINITY;
        const double jump = learned ? INFINITY : MONITOR_MEDIANS * g->median[r] + MONITOR_MOVED * g->moved[r];
        const double innovation = clip(x[r] - g->next_x[r] + m->ahead[r], -jump, jump);
        m->apart[r] = clip(innovation + m->kept[r] * m->apart[r], -far, far);
        m->smooth[r] += (m->apart[r] - m->smooth[r]) / MONITOR_SMOOTH;
        if (!learned) continue;
        const double size = fabs(m->smooth[r]);
        m->beyond[r] = size > m->unit[r] ? m->beyond[r] + (m->beyond[r] < MONITOR_MOST) : 0;
        if (size > MONITOR_LIMIT * m->unit[r] && !(g->health[3 * r + 2] > 0.0))
            complain(g, r, size / m->unit[r], m->beyond[r], RUMO_LEAVING);
    }
    m->fresh = 1;
}

/* Whether it is time to say what the next readings depend on: once a sample, for those who have a plan and look at it. What was
 * said holds if the same sample is prepared again. */
static int begin_expecting(rumo_guard *g) {
    monitor *m = &g->monitor;
    const rumo_shift *shift = &g->data.shift;
    if (!m->due) return 0;
    m->due = m->expects = 0;
    if ((isinf(g->gate_width) && g->oldest == 0) || !g->has_next) return 0;
    /* The next sample lies within the first interval, or at its end. */
    m->share = shift->stages[0] == 0 ? shift->shares[0] : 1.0;
    if (shift->stages[0] > 1 || (shift->stages[0] == 1 && shift->shares[0] != 0.0)) return 0;
    if (m->fresh && m->compared < MONITOR_SAMPLES) ++m->compared;
    return m->expects = 1;
}

/* How a reading depends on the one before, `own`, and by how much all of them make the way change that it goes, as linearised:
 * (A - I) m for ways m. What a scheme of first order predicts is wrong by a share of that, where it does not decay. */
static void expect_reading(rumo_guard *g, int r, double own, double change) {
    monitor *m = &g->monitor;
    const rumo_sensors *sensors = &g->data.sensors;
    const double lasts = clip(1.0 + m->share * (own - 1.0), 0.0, 1.0), way = fabs(g->next_x[r] - g->x[r]);
    if (!isfinite(own) || !isfinite(change)) m->expects = 0;
    if (m->fresh) { /* learn of the last sample */
        const double further = m->way[r] - MONITOR_FURTHER * m->went[r];
        if (MONITOR_UNKNOWN * further > m->unit[r]) m->learned[r] = m->beyond[r] = 0; /* anew where it goes further than ever */
        m->learned[r] += m->learned[r] < MONITOR_MEMORY;
        const double size = fabs(m->apart[r]), weight = 1.0 / m->learned[r];
        const double most = m->learned[r] <= MONITOR_LEARNED ? INFINITY : MONITOR_CLIP * MONITOR_CLIP * m->square[r];
        m->square[r] += weight * (smaller(size * size, most) - m->square[r]);
        m->went[r] += weight * (m->way[r] - m->went[r]);
    }
    m->way[r] += way - m->way[r] / MONITOR_SAMPLES;
    /* A sensor that often repeats itself shows steps. */
    const int shows = m->repeated[r] == MONITOR_LEARNED || 2 * m->changes[r] < MONITOR_LEARNED;
    const double steps = larger(sensors->resolution[r], shows ? g->smallest[r] : 0.0);
    m->unit[r] = larger(sqrt(m->square[r]), sensors->noise[r]) + steps + MONITOR_SHARE * m->way[r] +
                 MONITOR_DIGITS * fabs(g->x[r]) + 1e-12;
    m->kept[r] = lasts * (1.0 - 1.0 / larger(2.0, smaller(m->compared + 2, MONITOR_SAMPLES)));
    m->ahead[r] = sensors->lead[r] * lasts * change;
}

#endif
