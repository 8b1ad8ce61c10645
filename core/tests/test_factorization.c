/* The Cholesky factor, its inverse and the transpose of that, for random Hessians. */
#include "solve/dense/factorise.c"

#include "check.h"
#include "random.h"

enum { MAX_VARIABLES = 61, MAX_LD = 64 };
static double hessian[MAX_VARIABLES * MAX_LD], factor[MAX_VARIABLES * MAX_LD], inverse[MAX_VARIABLES * MAX_LD],
    transpose[MAX_VARIABLES * MAX_LD];

/* H = G'G with a condition number up to the square of `spread`, upper triangle. */
static void fill(int n, int ld, double spread) {
    static double G[2 * MAX_VARIABLES][MAX_VARIABLES];
    for (int i = 0; i < 2 * n; ++i)
        for (int j = 0; j < n; ++j) G[i][j] = uniform(-1.0, 1.0);
    memset(hessian, 0, sizeof hessian);
    double unit[MAX_VARIABLES];
    for (int j = 0; j < n; ++j) unit[j] = spread > 1.0 ? fabs(of_any_size(1.0 / spread, spread)) : 1.0;
    for (int i = 0; i < n; ++i)
        for (int j = i; j < n; ++j)
            for (int r = 0; r < 2 * n; ++r) hessian[i * ld + j] += G[r][i] * G[r][j] * unit[i] * unit[j];
}

static void compare(int n, int ld) {
    double worst_factor = 0.0, worst_inverse = 0.0;
    int same = 1, triangular = 1, padding = 1;
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            double product = 0.0, unit = 0.0, size = 0.0;
            for (int p = 0; p < n; ++p) {
                product += factor[p * ld + i] * factor[p * ld + j];
                unit += inverse[i * ld + p] * factor[j * ld + p] * (p <= i);
                size += fabs(inverse[i * ld + p] * factor[j * ld + p]) * (p <= i);
            }
            const double scale = sqrt(hessian[i * ld + i] * hessian[j * ld + j]);
            if (j >= i) worst_factor = fmax(worst_factor, fabs(product - hessian[i * ld + j]) / scale);
            /* (U'^-1 U')_ij = sum over p of inverse_ip factor_jp: U'_pj = U_jp */
            worst_inverse = fmax(worst_inverse, fabs(unit - (i == j)) / fmax(size, 1.0));
            same &= transpose[j * ld + i] == (j <= i ? inverse[i * ld + j] : 0.0);
            triangular &= j >= i || factor[i * ld + j] == 0.0;
            triangular &= j <= i || inverse[i * ld + j] == 0.0;
        }
        for (int j = n; j < ld; ++j)
            padding &= factor[i * ld + j] == 0.0 && inverse[i * ld + j] == 0.0 && transpose[i * ld + j] == 0.0;
    }
    CHECK(worst_factor < 1e-14 * n, "n = %d: %g", n, worst_factor);
    CHECK(worst_inverse < 1e-12, "n = %d: %g", n, worst_inverse);
    CHECK(same, "n = %d", n);
    CHECK(triangular, "n = %d", n);
    CHECK(padding, "n = %d", n);
}

int main(void) {
    for (int n = 1; n <= MAX_VARIABLES; ++n)
        for (int round = 0; round < 6; ++round) {
            const int ld = padded(n);
            fill(n, ld, round % 2 ? 1e5 : 1.0);
            memset(factor, 0, sizeof factor);
            memset(inverse, 0, sizeof inverse);
            memset(transpose, 0, sizeof transpose);
            const int definite = 0.0 < factorize(n, ld, hessian, factor, inverse, transpose, INFINITY);
            CHECK(definite, "n = %d", n);
            if (definite) compare(n, ld);
            const int where = below(n), diagonal = where * ld + where;
            const double kept = hessian[diagonal];
            const double spoiled[] = {0.0, -kept, NAN, -INFINITY};
            for (size_t i = 0; i < sizeof spoiled / sizeof *spoiled; ++i) {
                hessian[diagonal] = spoiled[i];
                CHECK(0.0 == factorize(n, ld, hessian, factor, inverse, transpose, INFINITY), "n = %d with %g", n, spoiled[i]);
            }
        }
    return finish();
}
