/* The eigenvalues of a small real matrix. Source: Golub and Van Loan (2013), sections 7.4 and 7.5. */
#ifndef RUMO_EIGENVALUES_C
#define RUMO_EIGENVALUES_C

#include "base/system.h"

#include "base/lanes.h"

/* Francis' steps until one or two eigenvalues more fall off; every so many have other shifts, which nothing resists. */
#define MOST_FRANCIS 60
#define UNUSUAL 10

/* A matrix (n, n) becomes one that is similar to it, and 0 below the first subdiagonal, by elimination. */
static void to_hessenberg(double *a, int n) {
    for (int k = 1; k + 1 < n; ++k) {
        int best = k;
        for (int i = k + 1; i < n; ++i)
            if (fabs(a[i * n + k - 1]) > fabs(a[best * n + k - 1])) best = i;
        const double pivot = a[best * n + k - 1];
        if (pivot == 0.0) continue;
        for (int j = 0; best != k && j < n; ++j) {
            const double kept = a[k * n + j];
            a[k * n + j] = a[best * n + j];
            a[best * n + j] = kept;
        }
        for (int i = 0; best != k && i < n; ++i) {
            const double kept = a[i * n + k];
            a[i * n + k] = a[i * n + best];
            a[i * n + best] = kept;
        }
        for (int i = k + 1; i < n; ++i) {
            const double share = a[i * n + k - 1] / pivot;
            if (share == 0.0) continue;
            a[i * n + k - 1] = 0.0;
            for (int j = k; j < n; ++j) a[i * n + j] -= share * a[k * n + j];
            for (int j = 0; j < n; ++j) a[j * n + k] += share * a[j * n + i];
        }
    }
}

/* Where the last part of rows up to `high` begins that hangs together; what cuts it off becomes 0. */
static int beginning_of_part(double *a, int n, int high) {
    for (int i = high; i > 0; --i) {
        double *const below = a + i * n + i - 1;
        const double beside = fabs(a[(i - 1) * (n + 1)]) + fabs(a[i * (n + 1)]);
        if (fabs(*below) <= 0x1p-53 * beside || *below == 0.0) {
            *below = 0.0;
            return i;
        }
    }
    return 0;
}

/* I - share v v^T with v_0 = 1, so that it takes v, as it comes, to a multiple of the first unit vector; 0 where it is one. */
static double reflection(double *v, int size) {
    double largest = 0.0, rest = 0.0;
    for (int i = 0; i < size; ++i) largest = larger(largest, fabs(v[i]));
    for (int i = 0; i < size && largest > 0.0; ++i) v[i] /= largest;
    for (int i = 1; i < size; ++i) rest += v[i] * v[i];
    if (!(rest > 0.0)) return 0.0;
    const double norm = sqrt(v[0] * v[0] + rest), first = v[0] > 0.0 ? v[0] + norm : v[0] - norm;
    for (int i = 1; i < size; ++i) v[i] /= first;
    v[0] = 1.0;
    return 2.0 * first * first / (first * first + rest);
}

/* To rows from k on, in columns from `left`, and to columns from k on, in rows from `low` to `bottom`. */
static void reflect(double *a, int n, int k, int size, const double *v, double share, int left, int low, int bottom, int high) {
    for (int j = left; j <= high; ++j) {
        double sum = 0.0;
        for (int i = 0; i < size; ++i) sum += v[i] * a[(k + i) * n + j];
        for (int i = 0; i < size; ++i) a[(k + i) * n + j] -= share * sum * v[i];
    }
    for (int i = low; i <= bottom; ++i) {
        double *const row = a + i * n + k, *const end = row + size;
        double sum = 0.0;
        for (double *x = row; x < end; ++x) sum += v[x - row] * *x;
        for (double *x = row; x < end; ++x) *x -= share * sum * v[x - row];
    }
}

/* Two steps of the QR algorithm with conjugate shifts, of rows and columns from `low` to `high`, three or more. */
static void francis_step(double *a, int n, int low, int high, int unusual) {
    const double *const end = a + (high - 1) * (n + 1), *const begin = a + low * (n + 1);
    double sum = end[0] + end[n + 1], product = end[0] * end[n + 1] - end[1] * end[n];
    if (unusual) {
        const double size = fabs(end[n]) + fabs(end[-1]);
        sum = 1.5 * size;
        product = size * size;
    }
    double v[3] = {begin[0] * begin[0] + begin[1] * begin[n] - sum * begin[0] + product,
                   begin[n] * (begin[0] + begin[n + 1] - sum), begin[n] * begin[2 * n + 1]};
    for (int k = low; k < high; ++k) {
        const int size = high - k < 2 ? 2 : 3, left = k > low ? k - 1 : low;
        for (int i = 0; k > low && i < size; ++i) v[i] = a[(k + i) * n + k - 1];
        const double share = reflection(v, size);
        if (share != 0.0) reflect(a, n, k, size, v, share, left, low, k + 3 < high ? k + 3 : high, high);
        for (int i = 1; k > low && i < size; ++i) a[(k + i) * n + k - 1] = 0.0;
    }
}

/* Those of the rows and columns at `at` and after it. */
static void two_eigenvalues(const double *at, int n, double *re, double *im) {
    const double half = 0.5 * (at[0] - at[n + 1]), square = half * half + at[1] * at[n], root = sqrt(fabs(square));
    im[0] = im[1] = 0.0;
    if (square < 0.0) {
        re[0] = re[1] = at[n + 1] + half;
        im[0] = root;
        im[1] = -root;
    } else {
        const double far = half < 0.0 ? half - root : half + root;
        re[0] = at[n + 1] + far;
        re[1] = far != 0.0 ? at[n + 1] - at[1] * at[n] / far : at[n + 1];
    }
}

/* Of a matrix (n, n), which is lost, into (n,) each; 0 where they are not found. */
static int find_eigenvalues(double *a, int n, double *re, double *im) {
    to_hessenberg(a, n);
    int tries = 0;
    for (int high = n - 1; high >= 0;) {
        const int low = beginning_of_part(a, n, high);
        if (high - low >= 2) {
            if (++tries == MOST_FRANCIS) return 0;
            francis_step(a, n, low, high, tries % UNUSUAL == 0);
            continue;
        }
        tries = 0;
        if (low < high) two_eigenvalues(a + low * (n + 1), n, re + low, im + low);
        re[high] = low < high ? re[high] : a[high * (n + 1)];
        im[high] = low < high ? im[high] : 0.0;
        high = low - 1;
    }
    return 1;
}

#endif
