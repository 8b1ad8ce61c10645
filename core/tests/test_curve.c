/* Curves in pieces: their values against long double, the nearest point of a circle, motions back and forth; and no number, of
 * arguments or of coefficients, that leads anywhere else than to a number or NaN. */
#include "core.h"

#include <float.h>

#include "check.h"
#include "fixture.h"
#include "random.h"

static const double wild[] = {0.0, -0.0, 5e-324, 1e-300, 1e16, -1e16, 1e300, -1e300, DBL_MAX, -DBL_MAX, INFINITY, -INFINITY, NAN};
enum { WILD = sizeof wild / sizeof *wild };

/* Arrays of exactly their sizes, so that a sanitizer sees what is read beside them. */
static double *numbers(ptrdiff_t count) { return memory_of((size_t)count * sizeof(double)); }

static rumo_curve random_curve(int closed) {
    const int pieces = 1 + below(40), values = 1 + below(5), order = 1 + below(6);
    double *const breaks = numbers(pieces + 1), *const coefficients = numbers((ptrdiff_t)pieces * values * order);
    double *const shift = closed ? numbers(values) : NULL;
    breaks[0] = uniform(-10.0, 10.0);
    for (int i = 0; i < pieces; ++i) breaks[i + 1] = breaks[i] + uniform(0.01, 3.0);
    for (ptrdiff_t i = 0; i < (ptrdiff_t)pieces * values * order; ++i) coefficients[i] = uniform(-1.0, 1.0);
    for (int v = 0; closed && v < values; ++v) shift[v] = v < 2 ? 0.0 : uniform(-5.0, 5.0);
    return (rumo_curve){pieces, values, order, breaks, coefficients, shift};
}

static void release(const rumo_curve *c) {
    free((void *)c->breaks);
    free((void *)c->coefficients);
    free((void *)c->shift);
}

/* Value v at s, and the size of what it is a sum of. */
static long double exact(const rumo_curve *c, double s, int v, long double *size) {
    const long double period = (long double)(c->breaks[c->pieces] - c->breaks[0]);
    long double laps = 0.0L, at = s;
    if (c->shift) {
        laps = floorl((at - c->breaks[0]) / period);
        at -= laps * period;
    }
    int i = 0;
    while (i + 1 < c->pieces && at >= c->breaks[i + 1]) ++i;
    const long double d = at - c->breaks[i];
    const long double steep = 2.0L * fabsl(laps * period) + fabsl(at);
    long double value = 0.0L, slope = 0.0L;
    *size = 0.0L;
    for (int j = 0; j < c->order; ++j) {
        slope = slope * fabsl(d) + *size;
        value = value * d + c->coefficients[((ptrdiff_t)i * c->values + v) * c->order + j];
        *size = *size * fabsl(d) + fabsl((long double)c->coefficients[((ptrdiff_t)i * c->values + v) * c->order + j]);
    }
    *size += slope * steep + (c->shift ? fabsl(laps * c->shift[v]) : 0.0L);
    return value + (c->shift ? laps * c->shift[v] : 0.0L);
}

static void values_are_exact(const rumo_curve *c) {
    enum { COUNT = 60 };
    const double begin = c->breaks[0], end = c->breaks[c->pieces], length = end - begin;
    double s[COUNT], *const all = numbers(COUNT * c->values), *const one = numbers(c->values);
    for (int k = 0; k < COUNT; ++k) s[k] = uniform(begin - 2.0 * length, end + 2.0 * length);
    for (int i = 0; i < COUNT / 3 && i <= c->pieces; ++i) s[i] = c->breaks[i];
    rumo_core.curve_at(c, s, COUNT, all);
    for (int k = 0; k < COUNT; ++k) {
        rumo_core.curve_at(c, s + k, 1, one);
        for (int v = 0; v < c->values; ++v) {
            long double size;
            const long double value = exact(c, s[k], v, &size), off = fabsl((long double)one[v] - value);
            CHECK(one[v] == all[v * COUNT + k], "alone %g, among others %g", one[v], all[v * COUNT + k]);
            /* Where a lap begins is a matter of rounding. */
            const double share = fabs(remainder(s[k] - begin, length)) / length;
            CHECK(off <= 8.0L * DBL_EPSILON * size || (c->shift && share < 1e-14), "%g at %.17g: %Lg off", one[v], s[k], off);
        }
    }
    free(all);
    free(one);
}

/* Whatever the arguments, results are numbers or NaN, and NaN where the arguments are no numbers. */
static void wild_arguments(const rumo_curve *c) {
    double *const values = numbers(c->values), time;
    for (int i = 0; i < WILD; ++i) {
        rumo_core.curve_at(c, wild + i, 1, values);
        for (int v = 0; v < c->values; ++v) CHECK(isfinite(wild[i]) || isnan(values[v]), "%g at %g", values[v], wild[i]);
        if (c->values > 2) {
            rumo_core.curve_when(c, wild + i, 1, &time);
            CHECK(isfinite(wild[i]) || isnan(time), "%g at %g", time, wild[i]);
        }
        for (int j = 0; c->values > 1 && j < WILD; ++j) {
            const double low = wild[j], high = wild[below(WILD)], x = wild[i], y = uniform(-1.0, 1.0);
            const double s = rumo_core.curve_nearest(c, x, y, low, high);
            const int possible = isfinite(x) && isfinite(low) && isfinite(high) && low <= high;
            CHECK(possible || isnan(s), "%g of (%g, %g) from %g to %g", s, x, y, low, high);
        }
    }
    free(values);
}

/* So do coefficients and breaks that no one should hand over. */
static void wild_curves(void) {
    const rumo_curve c = random_curve(below(2));
    double *const breaks = (double *)c.breaks, *const coefficients = (double *)c.coefficients;
    breaks[below(c.pieces + 1)] = wild[below(WILD)];
    coefficients[below(c.pieces * c.values * c.order)] = wild[below(WILD)];
    wild_arguments(&c);
    release(&c);
}

/* A circle about the origin, of so many cubic pieces that 1e-5 of a turn is more than they are off; closed or not. */
static void nearest_of_a_circle(int closed) {
    enum { PIECES = 100, ORDER = 4 };
    const double turn = 6.283185307179586477, radius = uniform(1.0, 500.0), step = turn / (int)PIECES, h = radius * step;
    double breaks[PIECES + 1], coefficients[PIECES][2][ORDER], shift[2] = {0.0, 0.0};
    for (int i = 0; i <= PIECES; ++i) breaks[i] = i * h;
    for (int i = 0; i < PIECES; ++i)
        for (int v = 0; v < 2; ++v) {
            const double phase = v * 0.25 * turn, p = radius * cos(i * step - phase), q = radius * cos((i + 1) * step - phase);
            const double t = -sin(i * step - phase), u = -sin((i + 1) * step - phase);
            const double a[ORDER] = {(2.0 * (p - q) / h + t + u) / (h * h), (3.0 * (q - p) / h - 2.0 * t - u) / h, t, p};
            copy(coefficients[i][v], a, ORDER);
        }
    const rumo_curve c = {PIECES, 2, ORDER, breaks, coefficients[0][0], closed ? shift : NULL};
    const double length = breaks[PIECES];
    for (int k = 0; k < 500; ++k) {
        const double laps = closed ? floor(uniform(-1e6, 1e6)) : 0.0, share = closed ? uniform(0.0, 1.0) : uniform(0.05, 0.95);
        const double s = (laps + share) * length, away = radius * uniform(0.2, 3.0), window = length * uniform(0.001, closed ? 0.9 : 0.04);
        const double x = away * cos(share * turn), y = away * sin(share * turn);
        const double low = s - window * uniform(0.0, 1.0), high = s + window * uniform(0.0, 1.0);
        double found = rumo_core.curve_nearest(&c, x, y, low, high);
        CHECK(low - 1e-9 * length <= found && found <= high + 1e-9 * length, "%g is not from %g to %g", found, low, high);
        if (high - low > length) found = s + remainder(found - s, length); /* of a lap about their middle */
        CHECK(fabs(found - s) <= 1e-5 * length, "%.17g instead of %.17g", found, s);
        /* What is beyond the window is not found: its end is. */
        const double beyond = rumo_core.curve_nearest(&c, x, y, s + 0.01 * length, s + 0.1 * length);
        CHECK(fabs(beyond - s - 0.01 * length) <= 2e-9 + 1e-9 * fabs(s), "%g", beyond - s);
    }
}

/* Places at times of random motions, with stops where they pass, and at rest or not beyond their ends. */
static void times_of_places(int closed) {
    enum { PIECES = 12 };
    double breaks[PIECES + 1] = {0.0}, rows[PIECES][3][3] = {{{0.0}}};
    double place = 5.0, v = closed ? uniform(1.0, 9.0) : below(2) * uniform(1.0, 9.0);
    const double first = v;
    for (int i = 0; i < PIECES; ++i) {
        const int held = !closed && (i == 0 || i == PIECES - 1);
        const double next = held ? v : i == PIECES - 1 ? first : below(3) || v == 0.0 ? uniform(0.1, 9.0) : 0.0;
        const double time = held ? 1.0 : uniform(0.1, 4.0), a = (next - v) / time;
        const double row[3][3] = {{0.5 * a, v, place}, {0.0, a, v}, {0.0, 0.0, a}};
        memcpy(rows[i], row, sizeof row);
        breaks[i + 1] = breaks[i] + time;
        place += (v + 0.5 * a * time) * time;
        v = next;
    }
    const double shift[3] = {place - 5.0, 0.0, 0.0}, length = shift[0];
    const rumo_curve c = {PIECES, 3, 3, breaks, rows[0][0], closed ? shift : NULL};
    for (int k = 0; k < 200; ++k) {
        double wanted = 5.0 + length * uniform(closed ? -3.0 : 0.0, closed ? 4.0 : 1.0), time, there[3];
        if (k < PIECES) wanted = rows[k][0][2];
        rumo_core.curve_when(&c, &wanted, 1, &time);
        rumo_core.curve_at(&c, &time, 1, there);
        CHECK(fabs(there[0] - wanted) <= 1e-9 * (1.0 + fabs(wanted)), "%.17g instead of %.17g", there[0], wanted);
    }
    const double outside[2] = {5.0 - 2.0 * length, 5.0 + 2.0 * length};
    double times[2], values[6];
    rumo_core.curve_when(&c, outside, 2, times);
    rumo_core.curve_at(&c, times, 2, values);
    const int ways[2] = {closed || first > 0.0, closed || v > 0.0}; /* where there is a way on */
    for (int k = 0; k < 2; ++k) {
        if (ways[k]) CHECK(fabs(values[k] - outside[k]) <= 1e-9 * (1.0 + length), "%g instead of %g", values[k], outside[k]);
        else CHECK(times[k] == breaks[k ? PIECES - 1 : 1], "%g is not when it ends", times[k]);
    }
}

int main(void) {
    for (int i = 0; i < 400; ++i) {
        const rumo_curve c = random_curve(i % 2);
        values_are_exact(&c);
        wild_arguments(&c);
        release(&c);
        wild_curves();
        times_of_places(i % 2);
    }
    for (int i = 0; i < 20; ++i) nearest_of_a_circle(i % 2);
    return finish();
}
