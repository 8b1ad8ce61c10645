/* Implausible measurements: held back, unless they go on. */
#ifndef RUMO_GATE_C
#define RUMO_GATE_C

#include "controller.h"

/* Stages over which the gate asks how far a state can go: over a long horizon, anywhere. */
#define GATE_STAGES 15
/* Repeated samples are suspicious only after so many that differed: some callers always pass the same. */
#define GATE_CHANGES 5
/* And only if the prediction has left them by more than this share of the gate's unit. */
#define GATE_MOTION 1e-3

static inline int gate_stages(const dims *s) { return s->N < s->d + GATE_STAGES ? s->N : s->d + GATE_STAGES; }

/* Whether a measurement can be. Held back are samples outside a wide gate around the prediction, and samples that repeat
 * the one before in every state although the prediction has moved; both are believed when they go on for too long.
 *
 * The gate's width is in units of how far the inputs can move a state over the next stages, plus how far the plan does.
 */
static int plausible(rumo_controller *ctl, const double *x) {
    const int nx = ctl->s.nx;
    const double width = ctl->settings.gate_width;
    if (isinf(width) || !ctl->has_previous) return 1;
    int expected = 1, agrees = ctl->implausible > 0, moved = 0;
    for (int r = 0; r < nx; ++r) {
        double span = 0.0;
        for (int k = 1; k <= gate_stages(&ctl->s); ++k)
            span = fmax(span, fabs(ctl->previous_x[k * nx + r] - ctl->previous_x[r]));
        const double unit = ctl->condensed.near_reach[r] + span, innovation = fabs(x[r] - ctl->previous_x[r]);
        if (ctl->condensed.near_reach[r] == 0.0) continue; /* nothing to compare with */
        expected &= innovation <= width * unit;
        agrees &= fabs(x[r] - ctl->suspect[r]) <= width * unit;
        moved |= innovation > GATE_MOTION * unit;
    }
    int *const count = expected ? &ctl->repeats : &ctl->implausible;
    if (expected) {
        ctl->implausible = 0;
        if (!ctl->has_last || memcmp(x, ctl->last_x, (size_t)nx * sizeof *x) != 0) {
            copy(ctl->last_x, x, nx);
            ctl->has_last = 1;
            ctl->repeats = 0;
            if (ctl->changes < GATE_CHANGES) ++ctl->changes;
            return 1;
        }
        if (!moved || ctl->changes < GATE_CHANGES) return 1;
        ++ctl->repeats;
    } else {
        copy(ctl->suspect, x, nx);
        ctl->implausible = agrees ? ctl->implausible + 1 : 1;
    }
    if (*count <= ctl->settings.gate_patience) return 0;
    *count = 0;
    if (expected) ctl->changes = 0;
    ctl->has_guess = 0; /* what was predicted is wrong */
    return 1;
}

#endif
