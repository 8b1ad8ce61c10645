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

/* Vectors of the processor's own width, plain numbers where the compiler has none. */
#if defined(__GNUC__) && defined(__AVX512F__)
#define VEC 8
#elif defined(__GNUC__) && defined(__AVX__)
#define VEC 4
#elif defined(__GNUC__) && (defined(__SSE2__) || defined(__ARM_NEON))
#define VEC 2
#else
#define VEC 1
#endif
#if VEC > 1
typedef double vec __attribute__((vector_size(VEC * 8), may_alias));
typedef double half_vec __attribute__((vector_size(VEC * 4), may_alias));
#define UNROLL _Pragma("GCC unroll 16")
#define UNROLL_TWO _Pragma("GCC unroll 2")
#else
typedef double vec;
#define UNROLL
#define UNROLL_TWO
#endif

/* Where that takes sizes that are constants. */
#ifdef RUMO_TAILORED
#define UNROLL_TAILORED UNROLL
#else
#define UNROLL_TAILORED
#endif

static WITHIN vec load(const double *from) { return *(const vec *)from; }

static WITHIN void store(double *to, vec a) { *(vec *)to = a; }

/* The sum of a vector's numbers: halves are added until one is left. */
#if VEC == 1
static WITHIN double total(vec a) { return a; }
#else
#ifdef __clang__
#define MOVED(a, ...) __builtin_shufflevector(a, a, __VA_ARGS__)
#else
typedef long long lane_numbers __attribute__((vector_size(VEC * 8)));
#define MOVED(a, ...) __builtin_shuffle(a, (lane_numbers){__VA_ARGS__})
#endif
static WITHIN double total(vec a) {
#if VEC == 8
    a += MOVED(a, 4, 5, 6, 7, 0, 1, 2, 3);
    a += MOVED(a, 2, 3, 0, 1, 6, 7, 4, 5);
    a += MOVED(a, 1, 0, 3, 2, 5, 4, 7, 6);
#elif VEC == 4
    a += MOVED(a, 2, 3, 0, 1);
    a += MOVED(a, 1, 0, 3, 2);
#else
    a += MOVED(a, 1, 0);
#endif
    return a[0];
}
#endif

/* Four rows of lanes as columns: to[l * stride + i] = rows[i][first + l] for four lanes and `count` of the rows. */
static WITHIN void turn_fours(const double *const *rows, int first, int count, double *to, ptrdiff_t stride) {
#if VEC >= 4
    typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
#ifdef __clang__
#define JOINED(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
    typedef long long four_numbers __attribute__((vector_size(32)));
#define JOINED(a, b, ...) __builtin_shuffle(a, b, (four_numbers){__VA_ARGS__})
#endif
    if (count == 4) {
        const four a = *(const four *)(rows[0] + first), b = *(const four *)(rows[1] + first);
        const four c = *(const four *)(rows[2] + first), d = *(const four *)(rows[3] + first);
        const four even = JOINED(a, b, 0, 4, 2, 6), odd = JOINED(a, b, 1, 5, 3, 7);
        const four even_of_rest = JOINED(c, d, 0, 4, 2, 6), odd_of_rest = JOINED(c, d, 1, 5, 3, 7);
        *(four *)to = JOINED(even, even_of_rest, 0, 1, 4, 5);
        *(four *)(to + stride) = JOINED(odd, odd_of_rest, 0, 1, 4, 5);
        *(four *)(to + 2 * stride) = JOINED(even, even_of_rest, 2, 3, 6, 7);
        *(four *)(to + 3 * stride) = JOINED(odd, odd_of_rest, 2, 3, 6, 7);
        return;
    }
#undef JOINED
#endif
    for (int l = 0; l < 4; ++l)
        for (int i = 0; i < count; ++i) to[l * stride + i] = rows[i][first + l];
}

/* to[j * to_stride + i] = from[i * from_stride + j]. The last four rows and columns overlap those before. */
static inline void turn(const double *restrict from, ptrdiff_t from_stride, int rows, int columns, double *restrict to,
                             ptrdiff_t to_stride) {
    if (rows < 4 || columns < 4) {
        for (int j = 0; j < columns; ++j)
            for (int i = 0; i < rows; ++i) to[j * to_stride + i] = from[i * from_stride + j];
        return;
    }
    for (int i = 0; i < rows; i += 4) {
        const int row = i + 4 > rows ? rows - 4 : i;
        const double *const first = from + row * from_stride;
        const double *const fours[4] = {first, first + from_stride, first + 2 * from_stride, first + 3 * from_stride};
        for (int j = 0; j < columns; j += 4) {
            const int column = j + 4 > columns ? columns - 4 : j;
            turn_fours(fours, column, 4, to + column * to_stride + row, to_stride);
        }
    }
}

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

/* y += |x|. */
static inline void add_sizes(double *restrict y, const double *restrict x, int length) {
    for (int j = 0; j < length; ++j) y[j] += fabs(x[j]);
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
