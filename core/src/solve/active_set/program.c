/* The QP solver by itself, for tests and comparisons: any dense program. */
#ifndef RUMO_PROGRAM_C
#define RUMO_PROGRAM_C

#include "base/arena.h"
#include "solve/active_set/matrix.c"
#include "solve/dense/factorise.c"

typedef struct program {
    matrix_program m;
    double *hessian, *factor, *inverse, *transpose, *rows;
} program;

/* The slope of the Lagrangian from the Hessian. */
static double matrix_slope(qp *q, double *rest) {
    matrix_program *p = (matrix_program *)q;
    const double *restrict v = p->v;
    double *restrict slope = p->sum, *restrict forces = q->residual;
    double size = 0.0;
    zero(slope, q->ld);
    for (int i = 0; i < q->n; ++i) {
        const double *restrict row = p->hessian + (ptrdiff_t)i * q->ld;
        const int start = padded(i + 1);
        double s = 0.0;
        for (int j = i; j < start && j < q->n; ++j) s += row[j] * v[j];
        s += dot(row + start, v + start, q->ld - start);
        for (int j = i + 1; j < start && j < q->n; ++j) slope[j] += row[j] * v[i];
        axpy(slope + start, v[i], row + start, q->ld - start);
        slope[i] += s;
        size = larger(size, 1e-6 * row[i]);
    }
    zero(forces, q->ld);
    for (int i = 0; i < q->count; ++i) add_row(p, q->member[i], q->mu[i], forces);
    add_saturated(p, forces);
    for (int i = 0; i < q->n; ++i)
        size = larger(size, larger(fabs(slope[i]), larger(fabs(p->gradient[i]), fabs(forces[i]))));
    for (int i = 0; i < q->n; ++i) slope[i] += p->gradient[i] + forces[i];
    zero(rest, q->ld);
    add_transformed(p, slope, q->n, rest);
    return largest_size(slope, q->ld) / size;
}

static const qp_space matrix_space = {.start = matrix_start,         .evaluate = matrix_evaluate, .correct = matrix_correct,
                                      .transform = matrix_transform, .slope = matrix_slope,       .size_of = matrix_size_of,
                                      .condition = NULL,             .solve = NULL,               .combine = NULL,
                                      .project = NULL};

static void lay_out_program(arena *a, program *p, int n, int rows) {
    alloc_matrix_program(a, &p->m, &matrix_space, n, 0, rows);
    const int ld = p->m.q.ld;
    const ptrdiff_t square = (ptrdiff_t)n * ld;
    p->m.hessian = p->hessian = alloc_doubles(a, square);
    p->factor = alloc_doubles(a, square);
    p->m.inverse = p->inverse = alloc_doubles(a, square);
    p->m.transpose = p->transpose = alloc_doubles(a, square);
    p->m.matrix = p->rows = alloc_doubles(a, (ptrdiff_t)rows * ld);
}

static size_t program_size(int variables, int rows) {
    program p;
    arena a = {NULL, 0};
    (void)alloc(&a, sizeof p);
    lay_out_program(&a, &p, variables, rows);
    return a.used + ALIGNMENT;
}

/* Whether all is a number, limits are no infinities on the wrong side, and prices are none below zero. */
RARE static int sane(const rumo_qp_data *d) {
    const int n = d->variables, m = d->rows;
    int fine = all_finite(d->gradient, n) && (m == 0 || all_finite(d->matrix, m * n));
    for (int i = 0; i < n; ++i) fine &= all_finite(d->hessian + (ptrdiff_t)i * n + i, n - i);
    for (int i = 0; i < n; ++i) fine &= d->lower[i] < INFINITY && d->upper[i] > -INFINITY;
    for (int i = 0; i < m; ++i) {
        fine &= d->row_lower[i] < INFINITY && d->row_upper[i] > -INFINITY;
        fine &= d->l1[i] >= 0.0 && d->l2[i] >= 0.0 && d->l2[i] < INFINITY;
        fine &= isinf(d->l1[i]) || d->row_lower[i] <= d->row_upper[i];
    }
    return fine;
}

/* Take the data over. Prices of a former call and multipliers that came from them do not fit new ones. */
static void copy_data(program *p, const rumo_qp_data *data) {
    qp *q = &p->m.q;
    const int n = data->variables, m = data->rows;
    const size_t prices = (size_t)m * sizeof(double);
    if (memcmp(q->l1 + n, data->l1, prices) != 0 || memcmp(q->l2 + n, data->l2, prices) != 0) clear_members(q);
    q->span = 0.0;
    for (int i = 0; i < n; ++i) {
        copy(p->hessian + (ptrdiff_t)i * q->ld, data->hessian + (ptrdiff_t)i * n, n);
        q->span += data->hessian[(ptrdiff_t)i * n + i];
    }
    for (int i = 0; i < m; ++i) {
        double *row = p->rows + (ptrdiff_t)i * q->ld;
        copy(row, data->matrix + (ptrdiff_t)i * n, n);
        const double norm = sqrt(dot(row, row, q->ld));
        q->weight[n + i] = norm > 0.0 ? 1.0 / norm : 1.0;
        p->m.extent[i] = q->ld;
        /* A price of nothing is no limit. */
        const int priceless = data->l1[i] == 0.0 && data->l2[i] == 0.0;
        q->lower[n + i] = data->row_lower[i];
        q->upper[n + i] = priceless ? INFINITY : data->row_upper[i];
    }
    copy(q->lower, data->lower, n);
    copy(q->upper, data->upper, n);
    copy(q->l1 + n, data->l1, m);
    copy(q->l2 + n, data->l2, m);
    copy(p->m.gradient, data->gradient, n);
}

static int as_it_is(const qp *q, int row) {
    (void)q;
    return row;
}

/* A row whose limits contradict each other, or -1. */
static int crossed(const qp *q, double tolerance) {
    for (int r = 0; r < q->rows; ++r)
        if ((q->lower[r] - q->upper[r]) * q->weight[r] > tolerance) return r;
    return -1;
}

static rumo_qp_result solve_program(const rumo_qp_data *data, const rumo_settings *settings, int warm, void *memory,
                                    double *v, double *multipliers, int *conflict) {
    const int n = data->variables, m = data->rows;
    rumo_qp_result result = {RUMO_SOLVER_FAILED, 0, 0, 0.0, 0.0};
    arena a = {aligned(memory), 0};
    program *p = (program *)(void *)a.base;
    if (!warm) {
        p = (program *)alloc(&a, sizeof *p);
        lay_out_program(&a, p, n, m);
        limit_increments(&p->m, 0);
        clear_members(&p->m.q);
    }
    if (!sane(data)) return result;
    qp *q = &p->m.q;
    double start = seconds_now();
    copy_data(p, data);
    const int impossible = crossed(q, settings->qp_tolerance);
    if (impossible >= 0) {
        result.conflicts = 1;
        *conflict = impossible;
        return result;
    }
    const double share = factorize(n, q->ld, p->hessian, p->factor, p->inverse, p->transpose, INFINITY);
    result.factor_seconds = seconds_now() - start;
    if (share == 0.0) return result;
    set_fine(q, share, longest_row(n, q->ld, p->transpose));
    start = seconds_now();
    const budget limits = {settings->qp_iterations, settings->qp_tolerance, start + settings->seconds};
    q->end = limits.end;
    renew_members(q, as_it_is);
    watch_members(q);
    result.status = solve_qp(q, &limits);
    result.seconds = seconds_now() - start;
    result.iterations = q->iterations;
    result.conflicts = q->conflicts;
    copy(v, p->m.v, n);
    for (int i = 0; i < n + m; ++i) multipliers[i] = q->state[i] == SATURATED ? q->l1[i] : 0.0;
    for (int i = 0; i < q->count; ++i) multipliers[q->member[i]] = q->mu[i];
    memcpy(conflict, q->conflict, (size_t)q->conflicts * sizeof *conflict);
    return result;
}

#endif
