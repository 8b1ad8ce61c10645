/* The QP solver: small programs with solutions known by hand, and random ones by their optimality conditions. */
#include "core.h"

#include "check.h"
#include "random.h"

#include <stdlib.h>

enum { MAX_VARIABLES = 24, MAX_ROWS = 40 };

typedef struct example {
    int n, m;
    double H[MAX_VARIABLES * MAX_VARIABLES], g[MAX_VARIABLES], lower[MAX_VARIABLES], upper[MAX_VARIABLES];
    double A[MAX_ROWS * MAX_VARIABLES], row_lower[MAX_ROWS], row_upper[MAX_ROWS], l1[MAX_ROWS], l2[MAX_ROWS];
    double v[MAX_VARIABLES], multipliers[MAX_VARIABLES + MAX_ROWS];
    int conflict[MAX_VARIABLES + MAX_ROWS + 1];
    void *memory;
} example;

/* v'v / 2, without limits, all rows hard. */
static void start(example *e, int n, int m) {
    memset(e, 0, sizeof *e);
    e->n = n;
    e->m = m;
    for (int i = 0; i < n; ++i) {
        e->H[i * n + i] = 1.0;
        e->lower[i] = -INFINITY;
        e->upper[i] = INFINITY;
    }
    for (int i = 0; i < m; ++i) {
        e->row_lower[i] = -INFINITY;
        e->row_upper[i] = e->l1[i] = INFINITY;
    }
    e->memory = malloc(rumo_core.qp_size(n, m));
    if (!e->memory) abort();
}

static void finish_example(example *e) { free(e->memory); }

static rumo_qp_result solve(example *e, int iterations, int warm) {
    const rumo_qp_data data = {e->n, e->m,         e->H,         e->g,  e->lower, e->upper,
                               e->A, e->row_lower, e->row_upper, e->l1, e->l2};
    const rumo_settings settings = {.qp_iterations = iterations, .qp_tolerance = 1e-10, .seconds = INFINITY};
    return rumo_core.qp_solve(&data, &settings, warm, e->memory, e->v, e->multipliers, e->conflict);
}

static void expect(example *e, const char *what, const double *v, const double *multipliers) {
    const rumo_qp_result result = solve(e, 100, 0);
    CHECK(result.status == RUMO_OPTIMAL, "%s: status %d", what, (int)result.status);
    for (int i = 0; i < e->n; ++i) CHECK(fabs(e->v[i] - v[i]) < 1e-9, "%s: v[%d] = %.12g", what, i, e->v[i]);
    for (int i = 0; i < e->n + e->m; ++i)
        CHECK(fabs(e->multipliers[i] - multipliers[i]) < 1e-9, "%s: multiplier %d = %.12g", what, i, e->multipliers[i]);
}

static void known_solutions(void) {
    example e;
    start(&e, 2, 0);
    e.g[0] = -3.0, e.g[1] = 4.0;
    expect(&e, "free", (double[]){3.0, -4.0}, (double[]){0.0, 0.0});
    e.upper[0] = 1.0, e.lower[1] = -1.0;
    expect(&e, "bounds", (double[]){1.0, -1.0}, (double[]){2.0, -3.0});
    e.lower[0] = 1.0;
    expect(&e, "fixed variable", (double[]){1.0, -1.0}, (double[]){2.0, -3.0});
    finish_example(&e);

    start(&e, 2, 1);
    e.g[0] = e.g[1] = -1.0;
    e.A[0] = e.A[1] = 1.0;
    e.row_upper[0] = 1.0;
    expect(&e, "hard row", (double[]){0.5, 0.5}, (double[]){0.0, 0.0, 0.5});
    e.l1[0] = 0.2, e.l2[0] = 0.0;
    expect(&e, "soft row that gives way", (double[]){0.8, 0.8}, (double[]){0.0, 0.0, 0.2});
    e.l1[0] = 0.6;
    expect(&e, "soft row that holds", (double[]){0.5, 0.5}, (double[]){0.0, 0.0, 0.5});
    /* mu = l1 + 2 l2 s, s = 1 - 2 mu */
    e.l1[0] = 0.1, e.l2[0] = 0.5;
    expect(&e, "soft row with both penalties", (double[]){1.0 - 1.1 / 3.0, 1.0 - 1.1 / 3.0},
           (double[]){0.0, 0.0, 1.1 / 3.0});
    e.l1[0] = 0.0;
    expect(&e, "soft row with a square only", (double[]){2.0 / 3.0, 2.0 / 3.0}, (double[]){0.0, 0.0, 1.0 / 3.0});
    e.row_upper[0] = 10.0, e.row_lower[0] = 3.0, e.l1[0] = INFINITY;
    expect(&e, "lower limit of a row", (double[]){1.5, 1.5}, (double[]){0.0, 0.0, -0.5});
    finish_example(&e);

    /* The same row three times: one multiplier or several, but one solution. */
    start(&e, 2, 3);
    e.g[0] = e.g[1] = -1.0;
    for (int i = 0; i < 3; ++i) {
        e.A[2 * i] = e.A[2 * i + 1] = 1.0;
        e.row_upper[i] = 1.0;
    }
    CHECK(solve(&e, 100, 0).status == RUMO_OPTIMAL, "repeated rows");
    CHECK(fabs(e.v[0] - 0.5) < 1e-9 && fabs(e.v[1] - 0.5) < 1e-9, "repeated rows: %g, %g", e.v[0], e.v[1]);
    finish_example(&e);
}

static void failures(void) {
    example e;
    start(&e, 2, 2);
    e.A[0] = e.A[2] = 1.0;
    e.row_upper[0] = -1.0, e.row_lower[1] = 1.0;
    rumo_qp_result result = solve(&e, 100, 0);
    CHECK(result.status == RUMO_SOLVER_FAILED, "infeasible: %d", (int)result.status);
    CHECK(result.conflicts == 2, "%d conflicts", result.conflicts);
    int named = 0;
    for (int i = 0; i < result.conflicts; ++i) named |= 1 << e.conflict[i];
    CHECK(named == ((1 << 2) | (1 << 3)), "rows in conflict: %d", named);
    /* With one of them soft there is a solution. */
    e.l1[0] = 5.0;
    CHECK(solve(&e, 100, 0).status == RUMO_OPTIMAL, "one soft row");
    CHECK(fabs(e.v[0] - 1.0) < 1e-9, "v = %g", e.v[0]);
    result = solve(&e, 0, 0);
    CHECK(result.status == RUMO_BUDGET_EXCEEDED && result.iterations == 0, "no budget: %d", (int)result.status);
    CHECK(isfinite(e.v[0]) && isfinite(e.v[1]), "no budget: %g, %g", e.v[0], e.v[1]);
    e.H[0] = -1.0;
    CHECK(solve(&e, 100, 0).status == RUMO_SOLVER_FAILED, "indefinite Hessian");
    e.H[0] = 1.0;
    const double wild[] = {NAN, INFINITY, 1e300};
    for (size_t i = 0; i < sizeof wild / sizeof *wild; ++i) {
        e.g[0] = wild[i];
        const rumo_status status = solve(&e, 100, 0).status;
        CHECK(status != RUMO_OPTIMAL || (isfinite(e.v[0]) && isfinite(e.v[1])), "gradient %g: %d", wild[i],
              (int)status);
    }
    finish_example(&e);
}

/* A random program whose bounds contain `inside`; soft rows need not. */
static void randomise(example *e, int n, int m) {
    double G[2 * MAX_VARIABLES * MAX_VARIABLES], inside[MAX_VARIABLES];
    start(e, n, m);
    for (int i = 0; i < 2 * n * n; ++i) G[i] = uniform(-1.0, 1.0);
    for (int i = 0; i < n; ++i) {
        inside[i] = uniform(-1.0, 1.0);
        e->g[i] = uniform(-20.0, 20.0);
        e->H[i * n + i] = 0.1;
        if (below(3)) e->lower[i] = inside[i] - uniform(0.0, 1.0);
        if (below(3)) e->upper[i] = inside[i] + uniform(0.0, 1.0);
        for (int j = 0; j < n; ++j)
            for (int r = 0; r < 2 * n; ++r) e->H[i * n + j] += G[r * n + i] * G[r * n + j];
    }
    for (int i = 0; i < m; ++i) {
        double at = 0.0;
        for (int j = 0; j < n; ++j) {
            e->A[i * n + j] = i > 0 && below(8) == 0 ? e->A[(i - 1) * n + j] : uniform(-1.0, 1.0) * (below(3) > 0);
            at += e->A[i * n + j] * inside[j];
        }
        const int soft = below(2);
        e->row_upper[i] = at + (soft ? uniform(-1.0, 1.0) : uniform(0.0, 1.0) * (below(6) > 0));
        if (soft) {
            e->l1[i] = below(5) ? fabs(of_any_size(1e-2, 1e2)) : 0.0;
            e->l2[i] = e->l1[i] == 0.0 || below(2) ? fabs(of_any_size(1e-2, 1e2)) : 0.0;
        }
    }
}

/* Stationarity, feasibility, signs and complementarity, in one number. */
static double residual(const example *e) {
    const int n = e->n;
    double worst = 0.0;
    for (int i = 0; i < n; ++i) {
        double sum = e->g[i] + e->multipliers[i];
        for (int j = 0; j < n; ++j) sum += e->H[i * n + j] * e->v[j];
        for (int r = 0; r < e->m; ++r) sum += e->A[r * n + i] * e->multipliers[n + r];
        worst = fmax(worst, fabs(sum));
    }
    for (int r = 0; r < n + e->m; ++r) {
        const int row = r - n;
        double value = r < n ? e->v[r] : 0.0;
        for (int j = 0; r >= n && j < n; ++j) value += e->A[row * n + j] * e->v[j];
        const double lower = r < n ? e->lower[r] : e->row_lower[row], upper = r < n ? e->upper[r] : e->row_upper[row];
        const double l1 = r < n ? INFINITY : e->l1[row], mu = e->multipliers[r];
        const double slack = fmax(value - upper, 0.0);
        if (isinf(l1)) worst = fmax(worst, slack);
        else if (slack > 1e-8) worst = fmax(worst, fabs(mu - l1 - 2.0 * e->l2[row] * slack));
        else worst = fmax(worst, mu - l1 - 2e-8 * e->l2[row]);
        worst = fmax(worst, lower - value);
        if (mu > 0.0 && value < upper) worst = fmax(worst, fmin(mu, upper - value));
        if (mu < 0.0) worst = fmax(worst, fmin(-mu, value - lower));
    }
    return worst;
}

static void random_programs(void) {
    for (int round = 0; round < 1500; ++round) {
        example e;
        randomise(&e, 1 + below(MAX_VARIABLES), below(MAX_ROWS + 1));
        rumo_qp_result result = solve(&e, 1000, 0);
        CHECK(result.status == RUMO_OPTIMAL && residual(&e) < 1e-6, "program %d, %d by %d: status %d, residual %g",
              round, e.n, e.m, (int)result.status, residual(&e));
        /* Warm, from the same working set and from that of a neighbour. */
        double cold[MAX_VARIABLES];
        memcpy(cold, e.v, sizeof cold);
        result = solve(&e, 1000, 1);
        CHECK(result.status == RUMO_OPTIMAL && result.iterations == 0, "program %d again: %d, %d iterations", round,
              (int)result.status, result.iterations);
        for (int i = 0; i < e.n; ++i) e.g[i] += uniform(-1.0, 1.0);
        for (int i = 0; i < e.m; ++i) e.row_upper[i] += uniform(0.0, 0.1);
        result = solve(&e, 1000, 1);
        CHECK(result.status == RUMO_OPTIMAL && residual(&e) < 1e-6,
              "neighbour of program %d, %d by %d: status %d, residual %g", round, e.n, e.m, (int)result.status,
              residual(&e));
        finish_example(&e);
    }
}

int main(void) {
    known_solutions();
    failures();
    random_programs();
    return finish();
}
