/* Sine, cosine, tangent, arctangent, maximum and minimum without branches, so that loops over stages become vector instructions.
 *
 * Within two units in the last place, of an angle where |x| <= 1e6. Whoever hands over others asks is_far first, over all
 * lanes at once, and takes the C library's functions there, which reduce any angle exactly. Source: Moshier, Cephes
 * (coefficients); Cody and Waite (1980) (reduction).
 */
#ifndef RUMO_ELEMENTARY_H
#define RUMO_ELEMENTARY_H

#include "base/system.h"

#define FAR_ANGLE 1e6

typedef struct sine_cosine {
    double sine, cosine;
} sine_cosine;

/* Nearest integer of a number far below 2^51. */
static inline double nearest(double x) {
    const double magic = 6755399441055744.0; /* 1.5 x 2^52 */
    const double shifted = x + magic;
    return shifted - magic;
}

static inline sine_cosine sine_and_cosine(double x) {
    /* pi / 2 in three parts; the first two have 33 bits, so that their products with k are exact. */
    const double k = nearest(x * 0.63661977236758134308);
    double r = x - k * 1.57079632673412561417e+00;
    r -= k * 6.07710050630396597660e-11;
    r -= k * 2.02226624879595063154e-21;
    const double z = r * r;
    const double s =
        r + r * z * (((((1.58962301576546568060E-10 * z - 2.50507477628578072866E-8) * z + 2.75573136213857245213E-6) * z -
                       1.98412698295895385996E-4) * z + 8.33333333332211858878E-3) * z - 1.66666666666666307295E-1);
    const double c =
        1.0 - 0.5 * z + z * z * (((((-1.13585365213876817300E-11 * z + 2.08757008419747316778E-9) * z -
                                    2.75573141792967388112E-7) * z + 2.48015872888517045348E-5) * z -
                                  1.38888888888730564116E-3) * z + 4.16666666666665929218E-2);
    /* k mod 4 as -0.5 (or 0.5), -0.25, 0, 0.25 */
    const double quarter = 0.25 * k - nearest(0.25 * k);
    const int odd = quarter == 0.25 || quarter == -0.25;
    const double a = odd ? c : s, b = odd ? s : c;
    sine_cosine result;
    result.sine = quarter == 0.0 || quarter == 0.25 ? a : -a;
    result.cosine = quarter == 0.0 || quarter == -0.25 ? b : -b;
    return result;
}

/* 0 for angles that sine, cosine and tangent are made for, else NaN, also for NaN: to be added up. */
static inline double is_far(double x) { return fabs(x) <= FAR_ANGLE ? 0.0 : NAN; }

static inline double sine(double x) { return sine_and_cosine(x).sine; }

static inline double cosine(double x) { return sine_and_cosine(x).cosine; }

static inline double tangent(double x) {
    const sine_cosine both = sine_and_cosine(x);
    return both.sine / both.cosine;
}

static inline double arctangent(double x) {
    const double size = fabs(x);
    const int large = size > 2.41421356237309504880, middle = size > 0.66;
    const double numerator = large ? -1.0 : middle ? size - 1.0 : size;
    const double denominator = large ? size : middle ? size + 1.0 : 1.0;
    const double base = large ? 1.57079632679489661923 : middle ? 0.78539816339744830962 : 0.0;
    const double rest = large ? 6.123233995736765886130E-17 : middle ? 3.061616997868382943065E-17 : 0.0;
    const double t = numerator / denominator, z = t * t;
    const double p = (((-8.750608600031904122785E-1 * z - 1.615753718733365076637E1) * z - 7.500855792314704667340E1) * z -
                      1.228866684490136173410E2) * z - 6.485021904942025371773E1;
    const double q = ((((z + 2.485846490142306297962E1) * z + 1.650270098316988542046E2) * z +
                       4.328810604912902668951E2) * z + 4.853903996359136964868E2) * z + 1.945506571482613964425E2;
    const double angle = base + ((t * (z * p / q) + rest) + t);
    return copysign(angle, x);
}

/* fmax and fmin, which are calls: the other one where one is no number. */
static inline double maximum(double a, double b) { return ((a < b) | (a != a)) ? b : a; }

static inline double minimum(double a, double b) { return ((b < a) | (a != a)) ? b : a; }

#endif
