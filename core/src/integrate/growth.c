/* The longest step in which exponential modes that grow are followed.
 *
 * An L-stable method damps what is fast, and what grows fast as well: where l h is large, a mode e^(l t) falls whatever the sign
 * of l. The estimate of errors tells as soon as that is of a size that matters; a state that lies nearer to an unstable
 * equilibrium than the tolerance would stay there for ever. The method's factor of such a mode, R(z) with z = l h, differs from
 * e^z by z^6 / 7200: with |z|^6 at most 7200 times the tolerance it grows as it should, however small it is.
 *
 * Of most Jacobians n^3 / 6 products show that nothing grows too fast: the real parts of eigenvalues are at most the largest
 * eigenvalue of (B + B^T) / 2 for each B that is similar to J, and the imaginary parts at most the norm of (B - B^T) / 2. Where
 * nothing but exchange of energy makes J unsymmetric, both are close if B is balanced (Osborne, 1960). Of other Jacobians all
 * eigenvalues are found. */
#ifndef RUMO_GROWTH_C
#define RUMO_GROWTH_C

#include "integrate/eigenvalues.c"
#include "integrate/integrator.h"

/* Error of R(z), over z^6. */
#define ERROR_OF_GROWTH (1.0 / 7200.0)
/* More states than this, in loops, are not looked into. */
#define MOST_MODES 200
/* Sweeps that balance a matrix before it is taken as it is, and its largest factors. */
#define BALANCING_SWEEPS 4
#define MOST_BALANCE 1e15
/* How far it is known that nothing limits a step, over that which is tried. */
#define AHEAD 8.0
/* A mode that grows by less while it turns by one radian does not count, nor what may be rounding, over the matrix; by how much
 * may grow, over the phase, what a proof of no growth leaves open. */
#define SLOWLY 1e-8
#define ROUNDING 0x1p-50
#define OPEN 1e-3

/* States on which the rates of others depend and which depend on others, both again and again: the eigenvalues of the rest are
 * entries on the diagonal. Into `inside` (nx,) which one of them a state is, or -1; how many there are. */
static int find_loops(const rumo_pattern *J, int nx, int *inside) {
    int count = nx;
    for (int i = 0; i < nx; ++i) inside[i] = 1;
    for (int before = count + 1; count < before;) {
        before = count;
        for (int side = 0; side < 2; ++side) {
            const int *const from = side ? J->column : J->row, *const to = side ? J->row : J->column;
            for (int i = 0; i < nx; ++i) inside[i] = inside[i] ? 2 : 0;
            for (int e = 0; e < J->count; ++e)
                if (from[e] != to[e] && inside[from[e]] && inside[to[e]]) inside[from[e]] = 1;
            for (int i = 0; i < nx; ++i) {
                count -= inside[i] == 2;
                inside[i] = inside[i] == 1;
            }
        }
    }
    for (int i = 0, next = 0; i < nx; ++i) inside[i] = inside[i] ? next++ : -1;
    return count;
}

/* Where nonzeros of the Jacobian go: into the matrix of the loops, or, with algebraic variables, into that of all; -1 nowhere. */
static void find_places(rumo_integrator *q) {
    const rumo_pattern *const J = &q->system.J;
    int *const inside = q->loop;
    if (q->nz == 0) q->loops = find_loops(J, q->nx, inside);
    else q->loops = q->nx;
    const int size = q->nz > 0 ? q->n : q->loops;
    if (size > MOST_MODES) q->loops = -1;
    for (int i = 0; q->nz > 0 && i < q->n; ++i) inside[i] = i;
    for (int e = 0; e < J->count; ++e) {
        const int i = inside[J->row[e]], j = inside[J->column[e]];
        q->place[e] = i >= 0 && j >= 0 ? i * size + j : -1;
    }
}

/* The Jacobian of the states alone, where the algebraic variables follow them, of that of all (n, n); 0 if there is none. */
static int eliminate_algebraic(double *a, int n, int nx) {
    for (int k = n - 1; k >= nx; --k) {
        int best = k;
        for (int i = nx; i < k; ++i)
            if (fabs(a[i * n + k]) > fabs(a[best * n + k])) best = i;
        const double pivot = a[best * n + k];
        if (!(fabs(pivot) > 0.0)) return 0;
        for (int j = 0; best != k && j <= k; ++j) {
            const double kept = a[k * n + j];
            a[k * n + j] = a[best * n + j];
            a[best * n + j] = kept;
        }
        for (int i = 0; i < k; ++i) {
            const double share = a[i * n + k] / pivot;
            for (int j = 0; share != 0.0 && j < k; ++j) a[i * n + j] -= share * a[k * n + j];
        }
    }
    for (int i = 1; i < nx; ++i)
        for (int j = 0; j < nx; ++j) a[i * nx + j] = a[i * n + j];
    return 1;
}

/* What can grow of the Jacobian, (loops, loops), balanced as the one before; 0 if that is not finite. */
static int matrix_of_loops(rumo_integrator *q) {
    const int m = q->loops, n = q->nz > 0 ? q->n : m;
    double *const a = q->modes;
    const double *const d = q->balance;
    zero(a, n * n);
    for (int e = 0; e < q->system.J.count; ++e)
        if (q->place[e] >= 0) a[q->place[e]] = q->J[e];
    if (q->nz > 0 && !eliminate_algebraic(a, n, m)) return 0;
    for (int i = 0; i < m; ++i) {
        const double share = 1.0 / d[i];
        for (int j = 0; j < m; ++j) a[i * m + j] *= d[j] * share;
    }
    return all_finite(a, m * m);
}

/* a / d_i * d_j, in place, with d so that rows and columns become about as large. */
static void balance(double *a, int n, double *d) {
    for (int i = 0; i < n; ++i) {
        double row = 0.0, column = 0.0;
        for (int j = 0; j < n; ++j) {
            row += i == j ? 0.0 : a[i * n + j] * a[i * n + j];
            column += i == j ? 0.0 : a[j * n + i] * a[j * n + i];
        }
        if (!(row + column > 0.0)) continue;
        const double wanted = clip(d[i] * sqrt(sqrt(row / column)), 1.0 / MOST_BALANCE, MOST_BALANCE), change = wanted / d[i];
        d[i] = wanted;
        for (int j = 0; j < n; ++j) a[j * n + i] *= change;
        for (int j = 0; j < n; ++j) a[i * n + j] /= change;
    }
}

/* The Frobenius norm of a matrix, and that of its skew part over the root of 2: no smaller than the spectral norm, since the
 * singular values of such a matrix are equal in pairs. */
static void norms_of(const double *a, int n, double *whole, double *skew) {
    double squares = 0.0, halves = 0.0;
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) squares += a[i * n + j] * a[i * n + j];
        for (int j = 0; j < i; ++j) {
            const double half = 0.5 * (a[i * n + j] - a[j * n + i]);
            halves += half * half;
        }
    }
    *whole = sqrt(squares);
    *skew = sqrt(halves);
}

/* Whether shift I - (a + a^T) / 2 is positive definite: no eigenvalue of `a` has a real part that is larger. */
static int is_below(const double *a, int n, double shift, double *lower) {
    for (int i = 0; i < n; ++i) {
        double *const row = lower + i * n;
        double pivot = shift - a[i * (n + 1)];
        for (int j = 0; j < i; ++j) {
            const double *const other = lower + j * n;
            double sum = -0.5 * (a[i * n + j] + a[j * n + i]);
            for (int k = 0; k < j; ++k) sum -= row[k] * other[k];
            row[j] = sum * other[j];
            pivot -= row[j] * row[j];
        }
        if (!(pivot > 0.0)) return 0;
        row[i] = 1.0 / sqrt(pivot);
    }
    return 1;
}

/* Of a growing mode. */
static double longest_for(const rumo_integrator *q, double re, double im, double rounding) {
    const double size = hypot(re, im);
    return re > SLOWLY * size && size > rounding ? q->phase / size : INFINITY;
}

/* Of states in loops; or, q->exact being 0, one from `step` on up to which nothing limits steps. */
static double longest_for_loops(rumo_integrator *q, double step) {
    const int m = q->loops;
    double *const a = q->modes, *const re = q->right, *const im = re + q->ld;
    double whole, skew, rounding, longest = INFINITY;
    if (!matrix_of_loops(q)) return longest;
    for (int k = 0; k <= BALANCING_SWEEPS; ++k) {
        if (k > 0) balance(a, m, q->balance);
        norms_of(a, m, &whole, &skew);
        rounding = ROUNDING * m * whole;
        const double enough = clip(q->phase / (1.5 * skew), step, AHEAD * step), size = q->phase / enough;
        const double shift = size > skew ? sqrt(size * size - skew * skew) : 0.0;
        if (shift < rounding && rounding * step > OPEN * q->phase) continue;
        if (!is_below(a, m, larger(shift, rounding), q->lower)) continue;
        q->exact = shift < rounding;
        return q->exact ? INFINITY : enough;
    }
    if (!find_eigenvalues(a, m, re, im)) return q->phase / whole; /* none is larger than the norm */
    for (int i = 0; i < m; ++i) longest = smaller(longest, longest_for(q, re[i], im[i], rounding));
    return longest;
}

/* As when nothing was known of it. */
static void forget_modes(rumo_integrator *q) {
    for (int i = 0; i < q->loops; ++i) q->balance[i] = 1.0;
    q->longest = q->exact = 0;
}

/* Of the Jacobian that there is, if it is shorter than `step`; else one that is not. */
static double longest_growing_step(rumo_integrator *q, double step) {
    if (q->longest >= step || q->exact) return q->longest;
    const rumo_pattern *const J = &q->system.J;
    q->exact = 1;
    q->seen = q->work.steps;
    double longest = q->loops > 0 ? longest_for_loops(q, step) : INFINITY, alone = INFINITY;
    for (int e = 0; e < J->count && q->loops >= 0; ++e)
        if (q->place[e] < 0 && J->row[e] == J->column[e]) alone = smaller(alone, longest_for(q, q->J[e], 0.0, 0.0));
    q->exact = q->exact || alone < longest;
    return q->longest = smaller(longest, alone);
}

#endif
