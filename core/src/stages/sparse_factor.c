/* Sparse LU of a block of a substep's matrix, with pivots on the diagonal in an order that adds few nonzeros.
 *
 * Which entries there are is known beforehand, and the same in rows and columns. An entry has `each` doubles: LANES for
 * eight stages at once, 1 for one stage. Right-hand sides have rows of `length` doubles: for eight stages a multiple of
 * LANES, for one stage the same, lanes being columns, or 1.
 */
#ifndef RUMO_SPARSE_FACTOR_C
#define RUMO_SPARSE_FACTOR_C

#include "base/system.h"

#include "rumo_core.h"

#include "base/arena.h"
#include "base/lanes.h"

/* A pivot holds unless an entry below it is so many times larger: rounding errors grow by as much. */
#define STEADY 1e2
/* One that is less than this share of an entry below it is replaced by that share, so that there is a solution at all. */
#define LEAST_PIVOT 1e-8
/* Rounds in which rows and columns are made equally large, one after the other. */
#define SCALINGS 3

/* Entries are pivots, then what is below each of them, then what is right of each of them. */
typedef struct block_pattern {
    int size, fill;              /* pivots, and entries below them */
    int first, entry, outside;   /* pivot, entry, and nonzero outside of blocks, with which the block begins */
    const int *below, *later;    /* how many entries are below each pivot, and in which rows, */
    const int *target;           /* and where those rows and columns meet */
} block_pattern;

/* The patterns of all blocks, and one more that says where they end. */
RARE static block_pattern *patterns_of(arena *a, const rumo_factor *own, const rumo_factor *f) {
    block_pattern *patterns = (block_pattern *)alloc(a, (size_t)(f->blocks + 1) * sizeof *patterns);
    if (!patterns) return NULL;
    block_pattern next = {0, 0, 0, 0, 0, own->below, own->later, own->target};
    for (int b = 0; b < f->blocks; ++b) {
        next.size = f->size[b];
        next.fill = rumo_sum(next.below, next.size);
        patterns[b] = next;
        next.target += rumo_sum_of_squares(next.below, next.size);
        next.later += next.fill;
        next.below += next.size;
        next.first += next.size;
        next.entry += next.size + 2 * next.fill;
        while (next.outside < f->outer && own->nonzero[3 * next.outside + 1] < next.first) ++next.outside;
    }
    next.size = next.fill = 0;
    patterns[f->blocks] = next;
    return patterns;
}

static inline int entries_of(const block_pattern *b) { return b->size + 2 * b->fill; }

/* y -= a x and y += a x */
static WITHIN void subtract_product(double *restrict y, const double *restrict a, const double *restrict x,
                                    const int each, const int length) {
    if (length == 1) y[0] -= a[0] * x[0];
    for (int e = 0; e + LANES <= length; e += LANES)
        for (int l = 0; l < LANES; ++l) y[e + l] -= a[each == 1 ? 0 : l] * x[e + l];
}

static WITHIN void add_product(double *restrict y, const double *restrict a, const double *restrict x, const int each,
                               const int length) {
    if (length == 1) y[0] += a[0] * x[0];
    for (int e = 0; e + LANES <= length; e += LANES)
        for (int l = 0; l < LANES; ++l) y[e + l] += a[each == 1 ? 0 : l] * x[e + l];
}

static WITHIN void multiply(double *restrict y, const double *restrict a, const int each, const int length) {
    if (length == 1) y[0] *= a[0];
    for (int e = 0; e + LANES <= length; e += LANES)
        for (int l = 0; l < LANES; ++l) y[e + l] *= a[each == 1 ? 0 : l];
}

/* Entries (entries, LANES) become those of the factors, with inverse pivots. Rows compare in units (size,) of their own.
 * Returns whether all pivots hold, in all lanes. */
static OUTSIDE int factor_block(const block_pattern *b, const double *unit, double *entries) {
    const int *later = b->later, *target = b->target;
    double *lower = entries + b->size * LANES, *upper = lower + b->fill * LANES;
    double worst = 0.0;
    for (int p = 0; p < b->size; ++p) {
        const int count = b->below[p];
        double largest[LANES] = {0.0}, excess[LANES], inverse[LANES];
        for (int i = 0; i < count; ++i) {
            const double ratio = unit[later[i]] / unit[p];
            for (int l = 0; l < LANES; ++l) {
                const double size = fabs(lower[i * LANES + l]) * ratio;
                largest[l] = size > largest[l] ? size : largest[l];
            }
        }
        for (int l = 0; l < LANES; ++l) {
            const double pivot = entries[p * LANES + l], size = fabs(pivot), least = LEAST_PIVOT * largest[l];
            excess[l] = largest[l] - STEADY * size;
            inverse[l] = 1.0 / (size < least ? copysign(least, pivot) : pivot);
        }
        for (int l = 0; l < LANES; ++l) worst = excess[l] > worst ? excess[l] : worst;
        copy(entries + p * LANES, inverse, LANES);
        for (int i = 0; i < count; ++i) {
            double factor[LANES];
            for (int l = 0; l < LANES; ++l) factor[l] = lower[i * LANES + l] * inverse[l];
            copy(lower + i * LANES, factor, LANES);
            for (int j = 0; j < count; ++j, ++target) {
                double *const place = entries + *target * LANES;
                const double *const across = upper + j * LANES;
                double entry[LANES];
                for (int l = 0; l < LANES; ++l) entry[l] = place[l] - factor[l] * across[l];
                copy(place, entry, LANES);
            }
        }
        lower += count * LANES;
        upper += count * LANES;
        later += count;
    }
    return worst <= 0.0;
}

/* Right-hand sides (size, length) become solutions. */
static WITHIN void solve_factored(const block_pattern *b, const double *entries, const int each, double *right,
                                  const int length) {
    const double *lower = entries + b->size * each, *upper = lower + 2 * b->fill * each;
    const int *later = b->later;
    for (int p = 0; p < b->size; ++p)
        for (int i = 0; i < b->below[p]; ++i, lower += each)
            subtract_product(right + *later++ * length, lower, right + p * length, each, length);
    for (int p = b->size - 1; p >= 0; --p) {
        double *const row = right + p * length;
        for (int i = 0; i < b->below[p]; ++i) {
            upper -= each;
            subtract_product(row, upper, right + *--later * length, each, length);
        }
        multiply(row, entries + p * each, each, length);
    }
}

/* The same with the transposed matrix. */
static WITHIN void solve_transposed(const block_pattern *b, const double *entries, const int each, double *right,
                                    const int length) {
    const double *lower = entries + b->size * each, *upper = lower + b->fill * each;
    const int *later = b->later;
    for (int p = 0; p < b->size; ++p) {
        multiply(right + p * length, entries + p * each, each, length);
        for (int i = 0; i < b->below[p]; ++i, upper += each)
            subtract_product(right + *later++ * length, upper, right + p * length, each, length);
    }
    lower += b->fill * each; /* which is where it ends */
    for (int p = b->size - 1; p >= 0; --p)
        for (int i = 0; i < b->below[p]; ++i) {
            lower -= each;
            subtract_product(right + p * length, lower, right + *--later * length, each, length);
        }
}

#endif
