/* Curves in pieces: a few values by one number, such as position and heading of a path by its arc length.
 *
 * On piece i, of arguments from breaks[i] up to breaks[i + 1], each value is a polynomial
 *
 *   v(s) = (.. (a_0 d + a_1) d + ..) d + a_(order - 1),   d = s - breaks[i].
 *
 * The first and the last go on beyond the ends, unless the curve is closed: s is then a share of a lap from breaks[0] on, and
 * laps before it, each of which adds a shift to every value. What is not finite leads to NaN. */
#ifndef RUMO_PIECES_C
#define RUMO_PIECES_C

#include "base/system.h"

#include "rumo_core.h"

static double period_of(const rumo_curve *c) { return c->breaks[c->pieces] - c->breaks[0]; }

/* A number within the lap of a length that begins at another, and the laps before. Exact however many, since fmod is. */
static double within(double s, double begin, double length, double *laps) {
    *laps = 0.0;
    if (begin <= s && s < begin + length) return s; /* to the last digit */
    double share = fmod(s - begin, length);
    if (share < 0.0) share += length;
    *laps = floor((s - begin - share) / length + 0.5);
    return begin + share;
}

/* An argument within the first lap, and the laps before it, of a closed curve; itself, and none, of an open one. */
static double within_lap(const rumo_curve *c, double s, double *laps) {
    *laps = 0.0;
    return c->shift ? within(s, c->breaks[0], period_of(c), laps) : s;
}

/* The piece of an argument within a lap: from a guess on in strides that double, since most arguments lie a few pieces beyond
 * the one before; by halving where it lies before that. */
static int piece_of(const rumo_curve *c, double s, int guess) {
    int low = 0, high = c->pieces;
    if (s >= c->breaks[guess]) {
        low = guess;
        for (int stride = 1; low + stride < high; stride *= 2) {
            if (s < c->breaks[low + stride]) high = low + stride;
            else low += stride;
        }
    }
    while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        if (s < c->breaks[middle]) high = middle;
        else low = middle;
    }
    return low;
}

/* Coefficients of a value on a piece, (order,). */
static const double *coefficients_of(const rumo_curve *c, int piece, int value) {
    return c->coefficients + ((ptrdiff_t)piece * c->values + value) * c->order;
}

/* Values (values, count) at arguments (count,). */
static void curve_at(const rumo_curve *c, const double *s, ptrdiff_t count, double *values) {
    for (ptrdiff_t k = 0, i = 0; k < count; ++k) {
        double laps;
        const double share = within_lap(c, s[k], &laps);
        i = piece_of(c, share, (int)i);
        const double d = share - c->breaks[i];
        for (int v = 0; v < c->values; ++v) {
            const double *const a = coefficients_of(c, (int)i, v);
            double value = 0.0; /* so that constants are NaN as well where d is not finite */
            for (int j = 0; j < c->order; ++j) value = value * d + a[j];
            values[v * count + k] = c->shift ? value + laps * c->shift[v] : value;
        }
    }
}

#endif
