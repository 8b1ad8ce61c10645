/* Implausible measurements: held back, unless they go on. */
#ifndef RUMO_GATE_C
#define RUMO_GATE_C

#include "guard/guard.h"

/* Repeated samples are suspicious only after so many that differed: some callers always pass the same. */
#define GATE_CHANGES 5
/* And only if the prediction has left them by more than this share of the gate's unit. */
#define GATE_MOTION 1e-3

/* Whether a measurement is plausible however little the inputs can do: what they can then need not be known. */
static int is_near(const rumo_guard *g, const double *x) {
    const int nx = g->s.nx;
    if (isinf(g->gate_width) || !g->has_next) return 1;
    if (g->has_last && memcmp(x, g->last_x, (size_t)nx * sizeof *x) == 0) return 0;
    for (int r = 0; r < nx; ++r) {
        const double innovation = fabs(x[r] - g->next_x[r]);
        int k = gate_stages(&g->s); /* where the plan is most likely to have moved on by as much */
        while (k > 0 && !(innovation <= g->gate_width * fabs(g->next_x[k * nx + r] - g->next_x[r]))) --k;
        if (k == 0 && innovation > 0.0) return 0;
    }
    return 1;
}

/* Whether a measurement can be. Held back are samples outside a wide gate around the prediction, and samples that repeat
 * the one before in every state although the prediction has moved; both are believed when they go on for too long.
 *
 * The gate's width is in units of how far the inputs can move a state over the next stages (reach: (nx,), NULL where not
 * known; a state with a reach of 0 has nothing to compare with), plus how far the plan does.
 */
static int plausible(rumo_guard *g, const double *x, const double *reach) {
    const int nx = g->s.nx;
    const double width = g->gate_width;
    if (isinf(width) || !g->has_next || !reach) return 1;
    const int repeated = g->has_last && memcmp(x, g->last_x, (size_t)nx * sizeof *x) == 0;
    int expected = 1, agrees = g->implausible > 0, moved = 0;
    for (int r = 0; r < nx; ++r) {
        const double innovation = fabs(x[r] - g->next_x[r]);
        if (reach[r] == 0.0) continue;
        /* Most samples are near enough without. */
        if (!repeated && !agrees && innovation <= width * reach[r]) continue;
        double span = 0.0;
        for (int k = 1; k <= gate_stages(&g->s); ++k) span = larger(span, fabs(g->next_x[k * nx + r] - g->next_x[r]));
        const double unit = reach[r] + span;
        expected &= innovation <= width * unit;
        agrees &= fabs(x[r] - g->suspect[r]) <= width * unit;
        moved |= innovation > GATE_MOTION * unit;
    }
    int *const count = expected ? &g->repeats : &g->implausible;
    if (expected) {
        g->implausible = 0;
        if (!repeated) {
            copy(g->last_x, x, nx);
            g->has_last = 1;
            g->repeats = 0;
            if (g->changes < GATE_CHANGES) ++g->changes;
            return 1;
        }
        if (!moved || g->changes < GATE_CHANGES) return 1;
        ++g->repeats;
    } else {
        copy(g->suspect, x, nx);
        g->implausible = agrees ? g->implausible + 1 : 1;
    }
    if (*count <= g->gate_patience) return 0;
    *count = 0;
    if (expected) g->changes = 0;
    g->has_guess = 0; /* what was predicted is wrong */
    return 1;
}

/* Whether a sample is one that can be used: OPTIMAL, or why not. */
static inline rumo_status finite_sample(int nx, const double *x, int reference_is_finite) {
    if (!all_finite(x, nx)) return RUMO_BAD_MEASUREMENT;
    return reference_is_finite ? RUMO_OPTIMAL : RUMO_BAD_REFERENCE;
}

#endif
