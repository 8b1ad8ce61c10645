/* The linear systems of a step with dense matrices: their inverses, which take products of whole vectors only. */
#ifndef RUMO_DENSE_SYSTEM_C
#define RUMO_DENSE_SYSTEM_C

#include "integrate/integrator.h"

static WITHIN void swap_rows(double *a, double *b, int length) {
    for (int j = 0; j < length; ++j) {
        const double kept = a[j];
        a[j] = b[j];
        b[j] = kept;
    }
}

/* Columns go back to where rows were. */
static void undo_exchanges(double *a, int n, int ld, const int *pivots) {
    for (int k = n - 1; k >= 0; --k)
        for (int i = 0; pivots[k] != k && i < n; ++i) {
            const double kept = a[i * ld + k];
            a[i * ld + k] = a[i * ld + pivots[k]];
            a[i * ld + pivots[k]] = kept;
        }
}

/* A matrix (n, ld) becomes its inverse, by Gauss and Jordan with row exchanges; 0 if it has none. */
static int invert(double *a, int n, int ld, int *pivots) {
    for (int k = 0; k < n; ++k) {
        int best = k;
        for (int i = k + 1; i < n; ++i)
            if (fabs(a[i * ld + k]) > fabs(a[best * ld + k])) best = i;
        double *const row = a + k * ld, pivot = a[best * ld + k];
        if (!(fabs(pivot) > 0.0)) return 0;
        pivots[k] = best;
        if (best != k) swap_rows(row, a + best * ld, ld);
        row[k] = 1.0;
        const double share = 1.0 / pivot;
        for (int j = 0; j < ld; ++j) row[j] *= share;
        for (int i = 0; i < n; ++i) {
            if (i == k) continue;
            const double factor = a[i * ld + k];
            a[i * ld + k] = 0.0;
            axpy(a + i * ld, -factor, row, ld);
        }
    }
    undo_exchanges(a, n, ld, pivots);
    return 1;
}

/* y -= (c + i d) x, of complex rows in two parts. */
static WITHIN void subtract_complex(double *restrict y_re, double *restrict y_im, double c, double d,
                                    const double *restrict re, const double *restrict im, int length) {
    for (int j = 0; j < length; j += LANES)
        for (int l = 0; l < LANES; ++l) {
            y_re[j + l] -= c * re[j + l] - d * im[j + l];
            y_im[j + l] -= c * im[j + l] + d * re[j + l];
        }
}

/* The same of a complex matrix in two parts. */
static int invert_complex(double *re, double *im, int n, int ld, int *pivots) {
    for (int k = 0; k < n; ++k) {
        int best = k;
        double largest = 0.0;
        for (int i = k; i < n; ++i) {
            const double size = re[i * ld + k] * re[i * ld + k] + im[i * ld + k] * im[i * ld + k];
            if (size > largest) {
                largest = size;
                best = i;
            }
        }
        if (!(largest > 0.0 && largest < INFINITY)) return 0;
        double *const row_re = re + k * ld, *const row_im = im + k * ld;
        const double c = re[best * ld + k] / largest, d = -im[best * ld + k] / largest;
        pivots[k] = best;
        if (best != k) {
            swap_rows(row_re, re + best * ld, ld);
            swap_rows(row_im, im + best * ld, ld);
        }
        row_re[k] = 1.0;
        row_im[k] = 0.0;
        for (int j = 0; j < ld; ++j) {
            const double part = row_re[j];
            row_re[j] = c * part - d * row_im[j];
            row_im[j] = c * row_im[j] + d * part;
        }
        for (int i = 0; i < n; ++i) {
            if (i == k) continue;
            const double f = re[i * ld + k], g = im[i * ld + k];
            re[i * ld + k] = im[i * ld + k] = 0.0;
            subtract_complex(re + i * ld, im + i * ld, f, g, row_re, row_im, ld);
        }
    }
    undo_exchanges(re, n, ld, pivots);
    undo_exchanges(im, n, ld, pivots);
    return 1;
}

/* a M - J and, unless b is 0, also (c + i d) M - J, transposed: the inverse's columns are rows. */
static int factor_dense(rumo_integrator *q, double a, double c, double d) {
    const rumo_pattern *const J = &q->system.J;
    const int size = q->n * q->ld;
    double *const real = q->inverse, *const re = real + size, *const im = re + size;
    zero(real, size);
    for (int e = 0; e < J->count; ++e) real[J->column[e] * q->ld + J->row[e]] = -q->J[e];
    if (d != 0.0) {
        copy(re, real, size);
        zero(im, size);
        for (int i = 0; i < q->nx; ++i) {
            re[i * (q->ld + 1)] += c;
            im[i * (q->ld + 1)] = d;
        }
        if (!invert_complex(re, im, q->n, q->ld, q->pivots)) return 0;
    }
    for (int i = 0; i < q->nx; ++i) real[i * (q->ld + 1)] += a;
    return invert(real, q->n, q->ld, q->pivots);
}

/* right (ld,) becomes the solution of the real system. */
static void solve_dense_real(rumo_integrator *q, double *right) {
    zero(q->local, q->ld);
    for (int j = 0; j < q->n; ++j) axpy(q->local, right[j], q->inverse + j * q->ld, q->ld);
    copy(right, q->local, q->ld);
}

/* right (2, ld), real and imaginary parts, becomes that of the complex one. */
static void solve_dense_complex(rumo_integrator *q, double *right) {
    const int ld = q->ld, size = q->n * ld;
    const double *const re = q->inverse + size, *const im = re + size;
    zero(q->local, 2 * ld);
    for (int j = 0; j < q->n; ++j)
        subtract_complex(q->local, q->local + ld, -right[j], -right[ld + j], re + j * ld, im + j * ld, ld);
    copy(right, q->local, 2 * ld);
}

#endif
