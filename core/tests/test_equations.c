/* Factored equations against themselves: what comes out, put into M dw = A0 dx + B du + defect as it stands. */
#include "stages/adjoint.c"

#include "check.h"
#include "patterns.h"
#include "random.h"

#include <stdlib.h>

enum { LANES_ALL = 8, COLUMNS = 16, MAX_UNKNOWNS = 64, MAX_SLOTS = 4096 };

static double terms[MAX_SLOTS * LANES_ALL], unit[MAX_UNKNOWNS];
static double before[MAX_UNKNOWNS * COLUMNS], right[MAX_UNKNOWNS * COLUMNS], after[MAX_UNKNOWNS * COLUMNS],
    correction[MAX_UNKNOWNS * LANES_ALL];

/* Terms of all lanes: unknowns in units of very different size; if `spoiled`, some diagonal entries next to nothing. */
static void fill(const rumo_problem *p, double spread, int spoiled) {
    const int nw = p->sizes.states;
    for (int r = 0; r < nw; ++r) unit[r] = spread > 1.0 ? fabs(of_any_size(1.0 / spread, spread)) : 1.0;
    for (int k = 0; k < LANES_ALL; ++k) {
        for (int r = 0; r < nw; ++r) terms[(p->defect_first + r) * LANES_ALL + k] = unit[r] * uniform(-1.0, 1.0);
        for (int e = 0; e < p->M.count; ++e) {
            const int i = p->M.row[e], j = p->M.column[e];
            double value = uniform(-1.0, 1.0) + (i == j ? 3.0 : 0.0);
            if (i == j && spoiled && below(6) == 0) value = below(2) ? 0.0 : 1e-9 * value;
            terms[(p->M.first + e) * LANES_ALL + k] = value * unit[i] / unit[j];
        }
        for (int e = 0; e < p->A0.count; ++e)
            terms[(p->A0.first + e) * LANES_ALL + k] = uniform(-1.0, 1.0) * unit[p->A0.row[e]] / unit[p->A0.column[e]];
        for (int e = 0; e < p->B.count; ++e)
            terms[(p->B.first + e) * LANES_ALL + k] = uniform(-1.0, 1.0) * unit[p->B.row[e]];
    }
}

/* y += matrix x, or its transpose, and the sum of the products' sizes. */
static void apply(const rumo_pattern *matrix, int k, const double *x, int ld, int transposed, long double *y, double *size) {
    for (int e = 0; e < matrix->count; ++e) {
        const int to = transposed ? matrix->column[e] : matrix->row[e], from = transposed ? matrix->row[e] : matrix->column[e];
        const long double product = (long double)terms[(matrix->first + e) * LANES_ALL + k] * (long double)x[from * ld];
        y[to] += product;
        size[to] += fabs((double)product);
    }
}

/* |M dw - A0 dx - given| over the sizes of what it is made of. */
static double residual(const rumo_problem *p, int k, const double *dx, const double *dw, const double *given, int ld) {
    long double left[MAX_UNKNOWNS] = {0.0L}, other[MAX_UNKNOWNS] = {0.0L};
    double size[MAX_UNKNOWNS] = {0.0}, worst = 0.0;
    apply(&p->M, k, dw, ld, 0, left, size);
    if (dx) apply(&p->A0, k, dx, ld, 0, other, size);
    for (int r = 0; r < p->sizes.states; ++r)
        worst = fmax(worst, fabs((double)(left[r] - other[r]) - given[r * ld]) / (size[r] + fabs(given[r * ld]) + 1e-300));
    return worst;
}

static void forward(const rumo_problem *p, const equations *q, int k, double tolerance) {
    const int nw = p->sizes.states, nu = p->sizes.inputs;
    double du[MAX_UNKNOWNS], dw[MAX_UNKNOWNS], sum[MAX_UNKNOWNS];
    for (int i = 0; i < nw * COLUMNS; ++i) {
        before[i] = uniform(-1.0, 1.0) * unit[i / COLUMNS];
        right[i] = uniform(-1.0, 1.0) * unit[i / COLUMNS];
    }
    advance_columns(q, k, 0, before, right, nw, after, COLUMNS, COLUMNS);
    for (int c = 0; c < COLUMNS; ++c) {
        const double worst = residual(p, k, before + c, after + c, right + c, COLUMNS);
        CHECK(worst < tolerance, "%d unknowns, column %d: %g", nw, c, worst);
    }
    advance_columns(q, k, 0, before, right, nw, right, COLUMNS, COLUMNS);
    CHECK(memcmp(right, after, sizeof *after * (size_t)(nw * COLUMNS)) == 0, "%d unknowns, in place", nw);
    for (int j = 0; j < nu; ++j) du[j] = uniform(-1.0, 1.0);
    for (int r = 0; r < nw; ++r) sum[r] = terms[(p->defect_first + r) * LANES_ALL + k];
    for (int e = 0; e < p->B.count; ++e) sum[p->B.row[e]] += terms[(p->B.first + e) * LANES_ALL + k] * du[p->B.column[e]];
    for (int r = 0; r < nw; ++r) right[r] = before[r * COLUMNS];
    advance_unknowns(q, k, 0, right, du, dw);
    CHECK(residual(p, k, right, dw, sum, 1) < tolerance, "%d unknowns: %g", nw, residual(p, k, right, dw, sum, 1));
}

/* The adjoint: slopes' (dw(dx, du) - dw(0, 0)) = by_state' dx + by_input' du, for any dx and du. */
static void back(const rumo_problem *p, const equations *q, int k, double tolerance) {
    const int nw = p->sizes.states, nu = p->sizes.inputs;
    double slopes[MAX_UNKNOWNS], by_state[MAX_UNKNOWNS], by_input[MAX_UNKNOWNS] = {0.0}, dx[MAX_UNKNOWNS], du[MAX_UNKNOWNS];
    double dw[MAX_UNKNOWNS], zero_dw[MAX_UNKNOWNS];
    for (int r = 0; r < nw; ++r) slopes[r] = uniform(-1.0, 1.0) / unit[r];
    retreat(q, k, 0, slopes, nw, by_state, by_input);
    for (int r = 0; r < nw; ++r) dx[r] = uniform(-1.0, 1.0) * unit[r];
    for (int j = 0; j < nu; ++j) du[j] = uniform(-1.0, 1.0);
    advance_unknowns(q, k, 0, dx, du, dw);
    double left = 0.0, other = 0.0, size = 0.0;
    const double still[MAX_UNKNOWNS] = {0.0};
    advance_unknowns(q, k, 0, still, NULL, zero_dw);
    for (int r = 0; r < nw; ++r) {
        left += slopes[r] * (dw[r] - zero_dw[r]);
        size += fabs(slopes[r] * dw[r]) + fabs(slopes[r] * zero_dw[r]) + fabs(by_state[r] * dx[r]);
        other += by_state[r] * dx[r];
    }
    for (int j = 0; j < nu; ++j) other += by_input[j] * du[j];
    CHECK(fabs(left - other) < tolerance * size, "%d unknowns: %g of %g", nw, left - other, size);
}

int main(void) {
    int singular = 0, unsteady = 0, compared = 0;
    for (int i = 0; i < WIDE_PATTERNS; ++i) {
        const rumo_problem *p = wide_patterns[i];
        if (p->sizes.slots > MAX_SLOTS || p->sizes.states > MAX_UNKNOWNS) abort();
        arena measured = {NULL, 0};
        equations q;
        lay_out_equations(&measured, &q, patterns_of(&measured, &p->factor, &p->factor), p, p);
        void *memory = malloc(measured.used + ALIGNMENT);
        arena a = {aligned(memory), 0};
        lay_out_equations(&a, &q, patterns_of(&a, &p->factor, &p->factor), p, p);
        for (int round = 0; round < 12; ++round) {
            fill(p, round % 2 ? 1e6 : 1.0, round % 3 == 2);
            if (!factor_equations(&q, terms, 0, correction, INFINITY)) {
                ++singular;
                continue;
            }
            for (int k = 0; k < LANES_ALL; ++k) {
                unsteady += !q.steady[k];
                ++compared;
                /* Multipliers up to STEADY lose two digits, and there may be two of them one after the other. */
                forward(p, &q, k, 1e-11);
                back(p, &q, k, 1e-9);
                if (!q.steady[k]) continue;
                const double worst = residual(p, k, NULL, correction + k, terms + p->defect_first * LANES_ALL + k, LANES_ALL);
                CHECK(worst < 1e-11, "%d unknowns, correction: %g", p->sizes.states, worst);
            }
        }
        free(memory);
    }
    CHECK(compared > 8 * singular && unsteady > 0, "%d compared, %d unsteady, %d singular", compared, unsteady, singular);
    printf("%d compared, %d unsteady, %d singular\n", compared, unsteady, singular);
    return finish();
}
