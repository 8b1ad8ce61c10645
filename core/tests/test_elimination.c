/* Elimination of the unknowns, by loops and as straight-line code, against a dense LU with row pivoting in long double. */
#include "stages/eliminate.c"

#include "check.h"
#include "patterns.h"
#include "random.h"

#include <stdlib.h>

enum { MAX_STATES = 32, MAX_INPUTS = 4, MAX_WIDTH = MAX_STATES + MAX_INPUTS + 1, MAX_SLOTS = 1024 };

/* M x = right, in place, with rows made equally large first; 0 if M is singular. */
static int solve_dense(int n, int width, long double M[MAX_STATES][MAX_STATES],
                       long double right[MAX_STATES][MAX_WIDTH]) {
    for (int i = 0; i < n; ++i) {
        long double largest = 0.0L;
        for (int j = 0; j < n; ++j) largest = fmaxl(largest, fabsl(M[i][j]));
        if (largest == 0.0L) return 0;
        for (int j = 0; j < n; ++j) M[i][j] /= largest;
        for (int j = 0; j < width; ++j) right[i][j] /= largest;
    }
    for (int p = 0; p < n; ++p) {
        int best = p;
        for (int i = p + 1; i < n; ++i)
            if (fabsl(M[i][p]) > fabsl(M[best][p])) best = i;
        if (M[best][p] == 0.0L) return 0;
        for (int j = 0; j < n; ++j) {
            const long double kept = M[p][j];
            M[p][j] = M[best][j];
            M[best][j] = kept;
        }
        for (int j = 0; j < width; ++j) {
            const long double kept = right[p][j];
            right[p][j] = right[best][j];
            right[best][j] = kept;
        }
        for (int i = 0; i < n; ++i) {
            if (i == p) continue;
            const long double factor = M[i][p] / M[p][p];
            for (int j = p; j < n; ++j) M[i][j] -= factor * M[p][j];
            for (int j = 0; j < width; ++j) right[i][j] -= factor * right[p][j];
        }
    }
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < width; ++j) right[i][j] /= M[i][i];
    return 1;
}

/* Fill the terms of all lanes: states in units of very different size, one in so many diagonal entries zero or tiny. */
static void fill(const rumo_problem *p, int lanes, double spread, int share, double *unit, double *terms) {
    const int nx = p->sizes.states;
    for (int r = 0; r < nx; ++r) unit[r] = spread > 1.0 ? fabs(of_any_size(1.0 / spread, spread)) : 1.0;
    for (int k = 0; k < lanes; ++k) {
        for (int r = 0; r < nx; ++r) terms[r * lanes + k] = unit[r] * uniform(-1.0, 1.0);
        for (int e = 0; e < p->M.count; ++e) {
            const int i = p->M.row[e], j = p->M.column[e];
            double value = uniform(-1.0, 1.0) + (below(2) ? 1.0 : -1.0);
            if (i == j && below(share) == 0) value = below(2) ? 0.0 : 1e-9 * value;
            terms[(p->M.first + e) * lanes + k] = value * unit[i] / unit[j];
        }
        for (int e = 0; e < p->A0.count; ++e)
            terms[(p->A0.first + e) * lanes + k] = uniform(-1.0, 1.0) * unit[p->A0.row[e]] / unit[p->A0.column[e]];
        for (int e = 0; e < p->B.count; ++e)
            terms[(p->B.first + e) * lanes + k] = uniform(-1.0, 1.0) * unit[p->B.row[e]];
    }
}

/* One stage against the dense solution, in units in which the states are of one size; 0 where M is singular, or so
 * near to it that neither can be trusted. */
static int compare(const rumo_problem *p, int lanes, int k, const double *unit, const double *terms,
                   const double *result) {
    static long double M[MAX_STATES][MAX_STATES], kept[MAX_STATES][MAX_STATES], right[MAX_STATES][MAX_WIDTH],
        inverse[MAX_STATES][MAX_WIDTH];
    const int nx = p->sizes.states, nu = p->sizes.inputs, width = nx + nu + 1;
    memset(M, 0, sizeof M);
    memset(right, 0, sizeof right);
    memset(inverse, 0, sizeof inverse);
    for (int e = 0; e < p->M.count; ++e) {
        const int i = p->M.row[e], j = p->M.column[e];
        M[i][j] = (long double)terms[(p->M.first + e) * lanes + k] / (long double)unit[i] * (long double)unit[j];
    }
    for (int e = 0; e < p->A0.count; ++e)
        right[p->A0.row[e]][p->A0.column[e]] = (long double)terms[(p->A0.first + e) * lanes + k];
    for (int e = 0; e < p->B.count; ++e)
        right[p->B.row[e]][nx + p->B.column[e]] = (long double)terms[(p->B.first + e) * lanes + k];
    for (int r = 0; r < nx; ++r) right[r][width - 1] = (long double)terms[r * lanes + k];
    for (int r = 0; r < nx; ++r) {
        inverse[r][r] = 1.0L;
        for (int c = 0; c < width; ++c) right[r][c] /= (long double)unit[r];
    }
    memcpy(kept, M, sizeof M);
    if (!solve_dense(nx, nx, M, inverse)) return 0;
    memcpy(M, kept, sizeof M);
    solve_dense(nx, width, M, right);
    long double condition = 0.0L, largest[MAX_WIDTH] = {0.0L}, worst = 0.0L;
    for (int r = 0; r < nx; ++r) {
        long double sum = 0.0L;
        for (int i = 0; i < nx; ++i)
            for (int j = 0; j < nx; ++j) sum += fabsl(inverse[r][i] * kept[i][j]);
        condition = fmaxl(condition, sum);
        for (int c = 0; c < width; ++c) largest[c] = fmaxl(largest[c], fabsl(right[r][c]));
    }
    if (!(condition < 1e10L)) return 0;
    for (int e = 0; e < p->elimination.entries; ++e) {
        const int r = p->elimination.row[e];
        right[r][p->elimination.column[e]] -= (long double)result[e * lanes + k] / (long double)unit[r];
    }
    /* Where the result has no entry, the dense solution has none either. */
    for (int r = 0; r < nx; ++r)
        for (int c = 0; c < width; ++c)
            if (right[r][c] != 0.0L) worst = fmaxl(worst, fabsl(right[r][c]) / (condition * largest[c]));
    CHECK(worst < 1e-14L, "%d states, stage %d: %g", nx, k, (double)worst);
    return 1;
}

int main(void) {
    enum { LANES_ALL = 8, ROUNDS = 20 };
    static double terms[MAX_SLOTS * LANES_ALL], result[MAX_STATES * MAX_WIDTH * LANES_ALL],
        straight[MAX_STATES * MAX_WIDTH * LANES_ALL], work[MAX_STATES * (3 * MAX_WIDTH + 4 * MAX_STATES) * LANES_ALL];
    double unit[MAX_STATES], lack[LANES_ALL];
    static _Alignas(ALIGNMENT) unsigned char memory[1 << 14];
    int singular = 0, compared = 0, in_order = 0, exchanged = 0, sparsely = 0, spoiled = 0;
    for (int i = 0; i < PATTERNS; ++i) {
        const rumo_problem *p = patterns[i].problem;
        arena a = {memory, 0};
        const block_pattern *blocks = patterns_of(&a, &p->factor, &p->factor);
        const int sparse = rumo_sum(p->elimination.sparse, p->elimination.blocks);
        if (a.used > sizeof memory || p->sizes.slots > MAX_SLOTS || p->sizes.states > MAX_STATES || p->sizes.inputs > MAX_INPUTS) abort();
        for (int round = 0; round < ROUNDS; ++round) {
            fill(p, LANES_ALL, round % 2 ? 1e6 : 1.0, round % 4 < 2 ? 4 : 100, unit, terms);
            const int exchanges = eliminate_chunk(&p->elimination, blocks, terms, LANES_ALL, work, result);
            const int written = patterns[i].straight(PATIENCE, terms, straight, lack);
            CHECK(written ? !sparse : p->sizes.states > 10, "pattern %d has %s code", i, written ? "some" : "no");
            int lacking = 0;
            for (int k = 0; k < LANES_ALL; ++k) {
                if (compare(p, LANES_ALL, k, unit, terms, result)) ++compared;
                else ++singular;
                if (!written) continue;
                if (lack[k] == 0.0) compare(p, LANES_ALL, k, unit, terms, straight);
                lacking |= lack[k] > 0.0;
            }
            CHECK(!lacking || exchanges, "pattern %d: a pivot is too small for the code alone", i);
            exchanged += exchanges > 0;
            in_order += exchanges == 0;
            sparsely += sparse > 0;
            spoiled += sparse > 0 && exchanges > 0;
        }
    }
    CHECK(compared > singular, "%d compared, %d singular", compared, singular);
    CHECK(in_order > 50 && exchanged > 50, "%d in order, %d with exchanges", in_order, exchanged);
    CHECK(sparsely > 50 && spoiled > 5, "%d with sparse blocks, %d with exchanges", sparsely, spoiled);
    return finish();
}
