/* Covariances as P = U D U', U unit upper triangular: a square matrix with U above its diagonal and D on it.
 *
 * Whatever is rounded, P stays symmetric and positive semidefinite, without a root being taken.
 * Source: Bierman (1977), ch. V and VI. */
#ifndef RUMO_UD_C
#define RUMO_UD_C

#include "base/system.h"

#include "base/lanes.h"

/* U D U' = W diag(weights) W' for W (n, k), which is used up: Thornton's Gram-Schmidt with weights. For working: (k,). */
static void orthogonalise(int n, int k, double *restrict W, const double *restrict weights, double *restrict ud,
                          double *restrict weighted) {
    for (int j = n - 1; j >= 0; --j) {
        const double *const own = W + (ptrdiff_t)j * k;
        double size = 0.0;
        for (int e = 0; e < k; ++e) {
            weighted[e] = weights[e] * own[e];
            size += weighted[e] * own[e];
        }
        zero(ud + (ptrdiff_t)j * n, j);
        ud[j * n + j] = size;
        for (int i = 0; i < j; ++i) {
            double *const other = W + (ptrdiff_t)i * k;
            double along = 0.0;
            for (int e = 0; e < k; ++e) along += other[e] * weighted[e];
            along = size > 0.0 ? along / size : 0.0;
            for (int e = 0; e < k; ++e) other[e] -= along * own[e];
            ud[i * n + j] = along;
        }
    }
}

/* W (n, k), with k >= n, begins with A U, and the weights with D. */
static void load_product(int n, int k, const double *restrict A, const double *restrict ud, double *restrict W,
                         double *restrict weights) {
    for (int i = 0; i < n; ++i) {
        double *const row = W + (ptrdiff_t)i * k;
        for (int j = 0; j < n; ++j) row[j] = A[i * n + j];
        for (int l = 0; l < n; ++l) {
            const double a = A[i * n + l];
            if (a == 0.0) continue;
            for (int j = l + 1; j < n; ++j) row[j] += a * ud[l * n + j];
        }
    }
    for (int j = 0; j < n; ++j) weights[j] = ud[j * n + j];
}

/* U' h (n,), and the variance h' P h. */
static double variance_along(int n, const double *restrict ud, const double *restrict h, double *restrict f) {
    double sum = 0.0;
    for (int j = 0; j < n; ++j) f[j] = h[j];
    for (int i = 0; i < n; ++i)
        for (int j = i + 1; j < n; ++j) f[j] += ud[i * n + j] * h[i];
    for (int j = 0; j < n; ++j) sum += ud[j * n + j] * f[j] * f[j];
    return sum;
}

/* P h (n,), from U' h. */
static void covariance_along(int n, const double *restrict ud, const double *restrict f, double *restrict along) {
    for (int i = 0; i < n; ++i) {
        along[i] = ud[i * n + i] * f[i];
        for (int j = i + 1; j < n; ++j) along[i] += ud[i * n + j] * ud[j * n + j] * f[j];
    }
}

/* Bierman's update by one measurement along h with a variance of its own: f is U' h; gain (n,) over the result is what an
 * innovation moves the state by. Returns the innovation's variance. */
static double correct_factor(int n, double *restrict ud, const double *restrict f, double variance, double *restrict gain) {
    double before = variance;
    for (int j = 0; j < n; ++j) {
        const double v = ud[j * n + j] * f[j], after = before + f[j] * v, lambda = -f[j] / before;
        ud[j * n + j] *= before / after;
        gain[j] = v;
        for (int i = 0; i < j; ++i) {
            const double u = ud[i * n + j];
            ud[i * n + j] = u + gain[i] * lambda;
            gain[i] += u * v;
        }
        before = after;
    }
    return before;
}

/* P (n, n) itself. */
static void product_of_factors(int n, const double *restrict ud, double *restrict P) {
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j) {
            double sum = (i == j ? 1.0 : ud[i * n + j]) * ud[j * n + j];
            for (int l = j + 1; l < n; ++l) sum += ud[i * n + l] * ud[l * n + l] * ud[j * n + l];
            P[i * n + j] = P[j * n + i] = sum;
        }
}

#endif
