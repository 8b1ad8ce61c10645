/* Short loops over eight doubles at a time, which compilers turn into vector instructions of any width. */
#ifndef RUMO_LANES_H
#define RUMO_LANES_H

#include "base/system.h"

#define LANES 8

/* Set-up and last resorts: compiled for size, which takes an eighth off the time of a tailored build. */
#ifdef __GNUC__
#define RARE __attribute__((cold, noinline))
#define RARELY __attribute__((cold)) /* where not every build needs the function */
#else
#define RARE
#define RARELY
#endif

/* Where the compiler's own choice costs a twentieth of a step: what must be inlined, what must not, and what must not
 * where sizes are not constants. */
#ifdef __GNUC__
#define WITHIN inline __attribute__((always_inline))
#define OUTSIDE __attribute__((noinline))
#else
#define WITHIN inline
#define OUTSIDE
#endif
#if defined(__GNUC__) && !defined(RUMO_TAILORED)
#define APART __attribute__((noinline))
#else
#define APART
#endif

static inline int padded(int count) { return (count + LANES - 1) / LANES * LANES; }

/* y += a x, over a length that is a multiple of LANES. */
static inline void axpy(double *restrict y, double a, const double *restrict x, int length) {
    for (int j = 0; j < length; j += LANES)
        for (int l = 0; l < LANES; ++l) y[j + l] += a * x[j + l];
}

static inline double sum_of_lanes(const double *s) {
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

/* x' y, over a length that is a multiple of LANES. */
static inline double dot(const double *restrict x, const double *restrict y, int length) {
    double s[LANES] = {0.0};
    for (int j = 0; j < length; j += LANES)
        for (int l = 0; l < LANES; ++l) s[l] += x[j + l] * y[j + l];
    return sum_of_lanes(s);
}

/* Largest |x|, over a length that is a multiple of LANES. */
static inline double largest_size(const double *x, int length) {
    double s[LANES] = {0.0}, largest = 0.0;
    for (int j = 0; j < length; j += LANES)
        for (int l = 0; l < LANES; ++l) s[l] = fabs(x[j + l]) > s[l] ? fabs(x[j + l]) : s[l];
    for (int l = 0; l < LANES; ++l) largest = s[l] > largest ? s[l] : largest;
    return largest;
}

static inline void zero(double *x, int length) { memset(x, 0, (size_t)length * sizeof *x); }

static inline void copy(double *restrict to, const double *restrict from, int length) {
    memcpy(to, from, (size_t)length * sizeof *to);
}

/* Whether all are finite: 0 x is NaN where x is not. */
static inline int all_finite(const double *x, int length) {
    enum { MANY = 4 * LANES }; /* sums that do not wait for each other */
    double s[MANY] = {0.0};
    int j = 0;
    for (; j + MANY <= length; j += MANY)
        for (int l = 0; l < MANY; ++l) s[l] += 0.0 * x[j + l];
    for (; j < length; ++j) s[j % MANY] += 0.0 * x[j];
    return sum_of_lanes(s) + sum_of_lanes(s + LANES) + sum_of_lanes(s + 2 * LANES) + sum_of_lanes(s + 3 * LANES) == 0.0;
}

/* Numbers, for which these agree with fmax and fmin, but are no calls. */
static inline double larger(double a, double b) { return b > a ? b : a; }

static inline double smaller(double a, double b) { return b < a ? b : a; }

static inline double clip(double x, double lower, double upper) {
    return x < lower ? lower : x > upper ? upper : x;
}

#endif
