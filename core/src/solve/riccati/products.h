/* Products of small matrices by rows: each row of a result is a combination of rows. Rows lie `ld` apart, and what is worked on
 * is a multiple of four columns wide. */
#ifndef RUMO_PRODUCTS_H
#define RUMO_PRODUCTS_H

#include "base/lanes.h"

enum { TILE = 4, TILE_VECS = 2 }; /* rows (or one more) and vectors of a result that are worked on together */

static inline int in_fours(int count) { return (count + 3) / 4 * 4; }

/* What a product is added to: nothing, what is there, or a matrix of which the columns with ones in `mask` count. */
typedef struct onto {
    int add;
    const double *from, *mask;
} onto;

static const onto nothing_else = {0, NULL, NULL}, what_is_there = {1, NULL, NULL};

#define PRODUCT_TILE(name, type, lanes, tile_vecs)                                                                          \
    static WITHIN void name(const double *X, ptrdiff_t x_row, ptrdiff_t x_column, const double *Y, int ld, int count,       \
                            double *to, onto before, int column, const int rows, const int vecs) {                         \
        const type nothing = {0.0};                                                                                         \
        type sum[TILE + 1][tile_vecs];                                                                                      \
        UNROLL for (int i = 0; i < rows; ++i)                                                                               \
            UNROLL for (int j = 0; j < vecs; ++j) {                                                                         \
                const ptrdiff_t at = (ptrdiff_t)i * ld + column + j * lanes;                                                \
                sum[i][j] = nothing;                                                                                        \
                if (before.add) sum[i][j] = *(const type *)(to + at);                                                       \
                else if (before.from)                                                                                       \
                    sum[i][j] = *(const type *)(before.from + at) * *(const type *)(before.mask + column + j * lanes);      \
            }                                                                                                               \
        UNROLL_TWO for (int r = 0; r < count; ++r) {                                                                        \
            type y[tile_vecs];                                                                                              \
            UNROLL for (int j = 0; j < vecs; ++j) y[j] = *(const type *)(Y + (ptrdiff_t)r * ld + column + j * lanes);       \
            UNROLL for (int i = 0; i < rows; ++i) {                                                                         \
                const double x = X[i * x_row + r * x_column];                                                               \
                UNROLL for (int j = 0; j < vecs; ++j) sum[i][j] += x * y[j];                                                \
            }                                                                                                               \
        }                                                                                                                   \
        UNROLL for (int i = 0; i < rows; ++i)                                                                               \
            UNROLL for (int j = 0; j < vecs; ++j) *(type *)(to + (ptrdiff_t)i * ld + column + j * lanes) = sum[i][j];       \
    }

PRODUCT_TILE(product_tile, vec, VEC, TILE_VECS)
#if VEC == 8
PRODUCT_TILE(product_half_tile, half_vec, 4, 1)
#endif

static WITHIN void product_rows(const double *X, ptrdiff_t x_row, ptrdiff_t x_column, const double *Y, int ld, int count,
                                double *to, int width, onto before, const int rows) {
    int j = 0;
    for (; j + TILE_VECS * VEC <= width; j += TILE_VECS * VEC)
        product_tile(X, x_row, x_column, Y, ld, count, to, before, j, rows, TILE_VECS);
    for (; j + VEC <= width; j += VEC) product_tile(X, x_row, x_column, Y, ld, count, to, before, j, rows, 1);
#if VEC == 8
    if (j < width) product_half_tile(X, x_row, x_column, Y, ld, count, to, before, j, rows, 1);
#endif
}

/* to (rows, width) = X Y, and what it is added to: X is (rows, count) with entries at x_row and x_column. Calls would take a
 * twelfth of a step where sizes are not constants. */
static WITHIN void product(const double *X, ptrdiff_t x_row, ptrdiff_t x_column, int rows, const double *Y, int ld, int count,
                           double *to, int width, onto before) {
    for (; rows > TILE + 1 || rows == TILE; rows -= TILE) {
        product_rows(X, x_row, x_column, Y, ld, count, to, width, before, TILE);
        X += TILE * x_row;
        to += (ptrdiff_t)TILE * ld;
        if (before.from) before.from += (ptrdiff_t)TILE * ld;
    }
    /* A row by itself would wait for its own sums. */
    if (rows == TILE + 1) product_rows(X, x_row, x_column, Y, ld, count, to, width, before, TILE + 1);
    if (rows == 3) product_rows(X, x_row, x_column, Y, ld, count, to, width, before, 3);
    if (rows == 2) product_rows(X, x_row, x_column, Y, ld, count, to, width, before, 2);
    if (rows == 1) product_rows(X, x_row, x_column, Y, ld, count, to, width, before, 1);
}

/* The same for a symmetric result, added to what is there if `add`, from its row `first` on: of each four rows only the columns
 * up to their own four. */
static WITHIN void product_lower(const double *X, ptrdiff_t x_row, ptrdiff_t x_column, int first, int rows, const double *Y,
                                 int ld, int count, double *to, int add) {
    const onto before = add ? what_is_there : nothing_else;
    UNROLL_TAILORED for (int width = in_fours(first + 1); width < first + rows + 4; width += 4) {
        const int begin = width - 4 > first ? width - 4 - first : 0, end = width - first < rows ? width - first : rows;
        product(X + begin * x_row, x_row, x_column, end - begin, Y, ld, count, to + (ptrdiff_t)begin * ld, width, before);
    }
}

/* Make it symmetric to the last bit: what differs would grow as the plant does by itself, not as it does in closed loop.
 * Nothing stays of what is above the diagonal, and there is room for a multiple of four rows. */
static WITHIN void mirror_lower(double *P, int size, int ld) {
    for (int i = 0; i < size; i += 4) {
        const double *const rows[4] = {P + i * ld, P + (i + 1) * ld, P + (i + 2) * ld, P + (i + 3) * ld};
        for (int j = 0; j < i; j += 4) turn_fours(rows, j, 4, P + j * ld + i, ld);
        for (int a = 0; a < 4; ++a)
            for (int b = 0; b < a; ++b) P[(i + b) * ld + i + a] = rows[a][i + b];
    }
}

/* to (ld,) = x Y or, if `add`, that more, for a single row x (count,): in two sums, which do not wait for each other. */
static WITHIN void combine_rows(const double *x, const double *Y, int ld, int count, double *to, int add) {
    const vec nothing = {0.0};
    for (int j = 0; j < ld; j += VEC) {
        const double *y = Y + j;
        vec even = add ? load(to + j) : nothing, odd = nothing;
        int r = 0;
        for (; r + 1 < count; r += 2, y += 2 * ld) {
            even += x[r] * load(y);
            odd += x[r + 1] * load(y + ld);
        }
        if (r < count) even += x[r] * load(y);
        store(to + j, even + odd);
    }
}

/* x' y, over a length that is a multiple of LANES. */
static WITHIN double dot_of(const double *x, const double *y, int length) {
    vec sum = load(x) * load(y);
    for (int j = VEC; j < length; j += VEC) sum += load(x + j) * load(y + j);
    return total(sum);
}

#endif
