/* What a guard remembers: it decides what is applied, whatever a solver came to, and needs nothing else of a controller. */
#ifndef RUMO_GUARD_H
#define RUMO_GUARD_H

#include "base/system.h"

#include "rumo_core.h"

#include "base/arena.h"
#include "base/dims.h"

/* What tells of slow faults, see monitor.c. */
typedef struct monitor {
    double *apart, *smooth;   /* (nx,): readings less what is predicted from all before, and the same smoothed */
    double *kept, *ahead;     /* (nx,): the share of it that is there again, and what the scheme predicts too far */
    double *square;           /* (nx,): mean square of it, */
    double *unit;             /* and the deviation that is usual */
    double *way, *went;       /* (nx,): that the prediction goes in the samples compared, and went while learning */
    int *beyond;              /* (nx,): samples in a row beyond one deviation */
    int *learned;             /* (nx,): samples from which it is known what is usual, up to MONITOR_MEMORY */
    int compared;             /* samples since there are predictions, up to MONITOR_SAMPLES */
    double share;             /* of the first interval until the next sample */
    int due, expects, fresh;  /* whether there is a new plan, what comes of it is known, and a sample was compared with it */
    double *reading, *usual;  /* (nx,): the last reading that was new, and by how much they change from sample to sample */
    double *way_since;        /* (nx,): that the prediction has gone since */
    int *changes, *repeats;   /* (nx,): readings that differ, less a price for repeats; and those in a row that do not, */
    int *repeated;            /* or in all, up to MONITOR_LEARNED */
    int has_reading;
} monitor;

struct rumo_guard {
    dims s;
    rumo_guard_data data;
    double gate_width;
    int gate_patience;

    double *u, *x, *inner;                /* the plan: (N, nu), (N + 1, nx), (ni, lanes) */
    double *next_u, *next_x, *next_inner; /* the same one sample later: what is followed without a solution */
    int has_next, inputs_left;
    double *applied;                      /* (max(d, 1), nu), oldest first; */
    double *was_applied;                  /* the same before the last sample */
    long long counts[RUMO_STATUS_COUNT];
    int followed;                         /* status of the last sample, -1 if there is none */
    int astray;                           /* whether what is followed is of a plan that is not to be trusted */

    int has_guess, resting;               /* whether the solver has a guess, and whether that is a state at rest */
    int blameless;                        /* a guess at rest has failed too: the shifted plan is not to blame */
    int settled, settles;                 /* whether the last guess satisfied the dynamics, and the one prepared does */

    double *taken;                        /* (nx,): the measurement as it is used, */
    double *read;                         /* and as sensors gave it, but for full turns: the same array where none are old */
    double *used;                         /* (nx,): the last reading of each state that was used */
    double *late;                         /* (nx,): innovations of old readings, at their time; 0 once they are used, and NaN
                                             of any reading that is held back */
    double *ways, *dependences;           /* (oldest + 1, nx), (oldest + 1, nx, nx): how far plans went until the sample after
                                             theirs, and how that depends on theirs; */
    int *was_read;                        /* (oldest + 1, nx): whether what is believed of theirs is a reading; */
    int oldest, known, was_known, latest; /* how many are looked at, are known, and were before the last sample, and the row of
                                             the last; see age.c */
    double *wrong;                        /* (2, nx): what was believed wrongly, and of the sample after */
    double *last_x;                       /* (nx,): the last plausible sample, as it was read, */
    int has_last, changes, repeats;       /* how many differed from the one before, up to GATE_CHANGES, or did not */
    double *smallest, *stayed;            /* (nx,): smallest difference of readings, and how far they should have moved */
    int learned;                          /* samples from which it is known what is usual, up to GATE_LEARNED */
    double *median, *before;              /* (nx,): of innovations, and the last of a reading that was used, or the largest until
                                             it is known what is usual */
    int surprised;                        /* whether a reading that was used is farther from the prediction than ever */
    double *moved;                        /* (nx,): how far the plan moves until the next sample */
    double *suspect;                      /* (nx,): the last reading that was held back, */
    int *held, *out;                      /* how often in a row it was, and whether the present one is */
    double *health;                       /* (nx, 3): of those not healthy, deviations, samples and rumo_symptom; else 0 */
    int symptoms;
    monitor monitor;
    int missing;                          /* samples in a row with a reading that cannot be */

    double *rows, *next_rows;             /* (N, ni): for callers of a guard by itself */
};

/* The age of the oldest readings, in samples. */
RARE static int oldest_reading(const rumo_sensors *sensors, int nx) {
    int oldest = 0;
    for (int r = 0; r < nx; ++r) oldest = sensors->age[r] > oldest ? sensors->age[r] : oldest;
    return oldest;
}

/* All but the plan, for readings up to so many samples old. */
static void lay_out_guard(arena *a, rumo_guard *g, const rumo_guard_data *data, int oldest) {
    const dims s = g->s = dims_of(&data->sizes);
    g->data = *data;
    g->oldest = oldest;
    const ptrdiff_t ways = oldest ? oldest + 1 : 0;
    g->ways = alloc_doubles(a, ways * s.nx);
    g->dependences = alloc_doubles(a, ways * s.nx * s.nx);
    g->was_read = alloc_ints(a, ways * s.nx);
    g->wrong = alloc_doubles(a, oldest ? 2 * s.nx : 0);
    g->late = alloc_doubles(a, s.nx);
    g->next_u = alloc_doubles(a, s.N * s.nu);
    g->next_x = alloc_doubles(a, (s.N + 1) * s.nx);
    g->next_inner = alloc_doubles(a, (ptrdiff_t)s.ni * s.lanes);
    g->applied = alloc_doubles(a, decided_inputs(&s) * s.nu);
    g->was_applied = alloc_doubles(a, decided_inputs(&s) * s.nu);
    double **const of_states[] = {&g->taken,  &g->used,   &g->last_x, &g->smallest, &g->stayed,
                                  &g->median, &g->before, &g->moved,  &g->suspect};
    for (size_t i = 0; i < sizeof of_states / sizeof *of_states; ++i) *of_states[i] = alloc_doubles(a, s.nx);
    g->read = oldest ? alloc_doubles(a, s.nx) : g->taken;
    monitor *m = &g->monitor;
    double **const watched[] = {&m->apart, &m->smooth, &m->kept,    &m->ahead, &m->square,
                                &m->unit,  &m->way,    &m->went,    &m->reading, &m->usual,
                                &m->way_since};
    for (size_t i = 0; i < sizeof watched / sizeof *watched; ++i) *watched[i] = alloc_doubles(a, s.nx);
    int **const counted[] = {&m->beyond, &m->learned, &m->changes, &m->repeats, &m->repeated};
    for (size_t i = 0; i < sizeof counted / sizeof *counted; ++i) *counted[i] = alloc_ints(a, s.nx);
    g->held = alloc_ints(a, s.nx);
    g->health = alloc_doubles(a, 3 * s.nx);
    g->out = alloc_ints(a, s.nx);
}

static void configure_guard(rumo_guard *g, const rumo_settings *settings) {
    g->gate_width = settings->gate_width;
    g->gate_patience = settings->gate_patience;
}

/* Without a prediction there is nothing to compare with. */
static inline void interrupt_monitor(monitor *m, int nx) {
    m->expects = m->fresh = m->compared = 0;
    zero(m->apart, nx);
    zero(m->smooth, nx);
}

RARE static void reset_monitor(monitor *m, int nx) {
    interrupt_monitor(m, nx);
    m->due = m->has_reading = 0;
    double *const numbers[] = {m->square, m->way, m->went, m->usual, m->way_since};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; ++i) zero(numbers[i], nx);
    for (int r = 0; r < nx; ++r) m->beyond[r] = m->learned[r] = m->changes[r] = m->repeats[r] = m->repeated[r] = 0;
}

RARE static void reset_guard(rumo_guard *g) {
    const int nu = g->s.nu;
    g->has_next = g->inputs_left = g->has_guess = g->resting = g->blameless = g->settled = g->settles = g->astray = 0;
    zero(g->health, 3 * g->s.nx);
    g->symptoms = 0;
    reset_monitor(&g->monitor, g->s.nx);
    g->repeats = g->changes = g->has_last = g->learned = g->missing = g->surprised = g->known = g->was_known = g->latest = 0;
    for (int r = 0; r < g->s.nx; ++r) {
        g->smallest[r] = g->stayed[r] = g->used[r] = g->median[r] = g->before[r] = g->moved[r] = 0.0;
        g->held[r] = g->out[r] = 0;
        g->late[r] = 0.0;
    }
    for (int k = 0; k < decided_inputs(&g->s); ++k) copy(g->applied + k * nu, g->data.bounds.safe_input, nu);
    memset(g->counts, 0, sizeof g->counts);
    g->followed = -1;
}

/* The last input decided, before the first free one. */
static inline const double *last_decided(const rumo_guard *g) { return g->applied + (decided_inputs(&g->s) - 1) * g->s.nu; }

/* The guess is a state at rest from now on, with the last input decided, as far as bounds allow: u (N, nu). */
static void rest(rumo_guard *g, double *u) {
    const rumo_bounds *bounds = &g->data.bounds;
    const double *last = last_decided(g);
    for (int i = 0; i < g->s.N * g->s.nu; ++i)
        u[i] = clip(last[i % g->s.nu], bounds->input_lower[i], bounds->input_upper[i]);
    g->has_guess = g->resting = 1;
}

#endif
