/* When a motion is where. Values 0 to 2 of its curve by time are place, speed and acceleration, which is constant on a piece, so
 *
 *   place - s_i = (v_i + v) / 2 (t - t_i),   v^2 = v_i^2 + 2 a_i (place - s_i).
 *
 * Places never fall. Where the speed beyond an end is 0, that end is as far as it gets. */
#ifndef RUMO_WHEN_C
#define RUMO_WHEN_C

#include "base/lanes.h"
#include "curve/pieces.c"

/* What a value is where a piece begins. */
static double begin_of(const rumo_curve *c, int piece, int value) {
    return coefficients_of(c, piece, value)[c->order - 1];
}

/* Times (count,) at which places (count,) are reached. */
static void curve_when(const rumo_curve *c, const double *places, ptrdiff_t count, double *times) {
    for (ptrdiff_t k = 0; k < count; ++k) {
        double laps = 0.0, place = places[k];
        if (c->shift) place = within(place, begin_of(c, 0, 0), c->shift[0], &laps);
        int low = 0, high = c->pieces;
        while (high - low > 1) {
            const int middle = low + (high - low) / 2;
            if (place < begin_of(c, middle, 0)) high = middle;
            else low = middle;
        }
        const double distance = place - begin_of(c, low, 0), v = begin_of(c, low, 1), a = begin_of(c, low, 2);
        const double mean = 0.5 * (v + sqrt(larger(v * v + 2.0 * a * distance, 0.0)));
        double time = mean > 0.0 ? c->breaks[low] + distance / mean : c->breaks[low + (distance < 0.0)];
        if (c->shift) time += laps * period_of(c);
        times[k] = isfinite(place) ? time : NAN;
    }
}

#endif
