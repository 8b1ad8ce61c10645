/* The Cholesky factor of a Hessian and its inverse, several rows at a time. */
#ifndef RUMO_FACTORISE_C
#define RUMO_FACTORISE_C

#include "base/clock.h"
#include "base/lanes.h"

enum { ROWS = 4 }; /* rows of a matrix that are worked on together, so that what they need is loaded once */

/* block_r -= sum of a_(p, r) times row p, for eight columns of ROWS rows. */
static inline void subtract_rows(double block[ROWS][LANES], const double *restrict a, const double *restrict rows, int ld,
                                 int count) {
    for (int p = 0; p < count; ++p, a += ld, rows += ld)
        for (int r = 0; r < ROWS; ++r)
            for (int l = 0; l < LANES; ++l) block[r][l] -= a[r] * rows[l];
}

/* Cholesky factor U of a Hessian (upper triangle given), the inverse of U' and its transpose. Returns the least share of a
 * curvature that those of the variables before leave, 0 if it is not definite, or if the clock comes to `end`. */
static double factorize(int n, int ld, const double *restrict hessian, double *restrict factor, double *restrict inverse,
                     double *restrict transpose, double end) {
    double least = 1.0;
    for (int first = 0; first < n; first += ROWS) {
        if (is_over(end)) return 0.0;
        const int rows = n - first < ROWS ? n - first : ROWS, start = first / LANES * LANES;
        for (int j = start; j < ld; j += LANES) {
            double block[ROWS][LANES] = {{0.0}};
            for (int r = 0; r < rows; ++r) copy(block[r], hessian + (ptrdiff_t)(first + r) * ld + j, LANES);
            subtract_rows(block, factor + first, factor + j, ld, first);
            for (int r = 0; r < rows; ++r) copy(factor + (ptrdiff_t)(first + r) * ld + j, block[r], LANES);
        }
        /* Rows of U'^-1: U' times them is the identity. */
        for (int j = 0; j <= first; j += LANES) {
            double block[ROWS][LANES] = {{0.0}};
            const ptrdiff_t above = (ptrdiff_t)j * ld;
            subtract_rows(block, factor + above + first, inverse + above + j, ld, first - j);
            for (int r = 0; r < rows; ++r) copy(inverse + (ptrdiff_t)(first + r) * ld + j, block[r], LANES);
        }
        for (int k = first; k < first + rows; ++k) {
            double *restrict row = factor + (ptrdiff_t)k * ld, *restrict solved = inverse + (ptrdiff_t)k * ld;
            for (int p = first; p < k; ++p) {
                const double f = factor[(ptrdiff_t)p * ld + k];
                axpy(row + start, -f, factor + (ptrdiff_t)p * ld + start, ld - start);
                axpy(solved, -f, inverse + (ptrdiff_t)p * ld, start + LANES);
            }
            const double pivot = row[k];
            const double whole = hessian[(ptrdiff_t)k * ld + k];
            if (!(pivot > 1e-14 * whole)) return 0.0;
            least = pivot < least * whole ? pivot / whole : least;
            const double scale = 1.0 / sqrt(pivot);
            for (int j = start; j < k; ++j) row[j] = 0.0;
            for (int j = start; j < ld; ++j) row[j] *= scale;
            for (int j = 0; j < start + LANES; ++j) solved[j] *= scale;
            solved[k] = scale;
            for (int j = 0; j <= k; ++j) transpose[(ptrdiff_t)j * ld + k] = solved[j];
        }
    }
    return least;
}

/* The length of the longest row of U^-1: how far a unit of w moves a variable. */
static double longest_row(int n, int ld, const double *transpose) {
    double longest = 0.0;
    for (int i = 0; i < n; ++i) longest = larger(longest, dot(transpose + (ptrdiff_t)i * ld, transpose + (ptrdiff_t)i * ld, ld));
    return sqrt(longest);
}

#endif
