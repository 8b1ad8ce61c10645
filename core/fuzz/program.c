/* Any QP: whatever its numbers, the answer is finite where there is one, and within the bounds where it is optimal. */
#include "core.h"

#include "stream.h"

static double *numbers(stream *s, int count, double usual) {
    double *made = malloc((size_t)(count ? count : 1) * sizeof *made);
    REQUIRE(made);
    for (int i = 0; i < count; ++i) made[i] = usual;
    for (int changes = take_below(s, 24); changes > 0 && count > 0; --changes) {
        const int i = take_below(s, count);
        made[i] = take_double(s, made[i]);
    }
    return made;
}

static void check(const rumo_qp_data *d, const rumo_qp_result *r, const double *v, const double *multipliers,
                  const int *conflict) {
    const int n = d->variables, all = n + d->rows;
    REQUIRE(r->status >= RUMO_OPTIMAL && r->status < RUMO_STATUS_COUNT);
    REQUIRE(r->iterations >= 0 && r->conflicts >= 0 && r->conflicts <= all);
    for (int i = 0; i < r->conflicts; ++i) REQUIRE(conflict[i] >= 0 && conflict[i] < all);
    if (r->status > RUMO_SOFT_VIOLATED) return;
    for (int i = 0; i < n; ++i) {
        REQUIRE(isfinite(v[i]));
        const double room = 1e-6 * (1.0 + fabs(v[i]));
        REQUIRE(v[i] >= d->lower[i] - room && v[i] <= d->upper[i] + room);
    }
    for (int i = 0; i < all; ++i) REQUIRE(isfinite(multipliers[i]));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    stream s = {data, size};
    const int n = 1 + take_below(&s, 9), rows = take_below(&s, 9), all = n + rows;
    double *hessian = numbers(&s, n * n, 0.0), *gradient = numbers(&s, n, 1.0), *lower = numbers(&s, n, -1.0),
           *upper = numbers(&s, n, 1.0), *matrix = numbers(&s, rows * n, 0.5),
           *row_lower = numbers(&s, rows, -(double)INFINITY), *row_upper = numbers(&s, rows, 0.25),
           *l1 = numbers(&s, rows, (double)INFINITY), *l2 = numbers(&s, rows, 0.0);
    for (int i = 0; i < n; ++i) hessian[i * n + i] += 1.0;
    const rumo_qp_data d = {n, rows, hessian, gradient, lower, upper, matrix, row_lower, row_upper, l1, l2};
    const rumo_settings settings = {.qp_iterations = take_below(&s, 2) ? 200 : take_below(&s, 8),
                                    .qp_tolerance = 1e-10,
                                    .seconds = (double)INFINITY};
    void *memory = malloc(rumo_core.qp_size(n, rows));
    double *v = calloc((size_t)n, sizeof *v), *multipliers = calloc((size_t)all, sizeof *multipliers);
    int *conflict = calloc((size_t)all, sizeof *conflict);
    REQUIRE(memory && v && multipliers && conflict);
    for (int call = 0; call < 3; ++call) { /* the first cold, then warm with other numbers */
        const rumo_qp_result r = rumo_core.qp_solve(&d, &settings, call > 0, memory, v, multipliers, conflict);
        check(&d, &r, v, multipliers, conflict);
        gradient[take_below(&s, n)] = take_double(&s, 1.0);
        if (rows) row_upper[take_below(&s, rows)] = take_double(&s, 0.5);
        if (rows) l1[take_below(&s, rows)] = take_double(&s, 1.0);
    }
    double *const made[] = {hessian, gradient, lower, upper, matrix, row_lower, row_upper, l1, l2, v, multipliers};
    for (size_t i = 0; i < sizeof made / sizeof *made; ++i) free(made[i]);
    free(conflict);
    free(memory);
    return 0;
}
