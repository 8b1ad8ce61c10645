/* Programs whose Hessian and rows are matrices: bounds, increments of variables if limited, then dense rows. */
#ifndef RUMO_MATRIX_C
#define RUMO_MATRIX_C

#include "solve/active_set/qp.c"

typedef struct matrix_program {
    qp q;
    const double *hessian, *inverse, *transpose; /* (n, ld): upper triangle; inverses of U' and U, see factorise.c */
    const double *matrix;                        /* dense rows, ld apart */
    int band;        /* inputs of a stage, if increments v_j - v_{j - band} are limited; else 0 */
    int dense_rows;
    int *extent;     /* (dense rows,): length to which a row is not zero, padded */
    double *gradient, *v, *sum; /* (ld,) */
} matrix_program;

/* Room for bounds and increments of n variables, and for dense rows; increments are limited later if at all. */
RARE static void alloc_matrix_program(arena *a, matrix_program *p, const qp_space *space, int n, int band, int dense_rows) {
    alloc_qp(a, &p->q, space, n, (band ? 2 * n : n) + dense_rows, band ? 2 * n : n);
    p->dense_rows = dense_rows;
    p->extent = alloc_ints(a, dense_rows);
    p->gradient = alloc_doubles(a, p->q.ld);
    p->v = alloc_doubles(a, p->q.ld);
    p->sum = alloc_doubles(a, p->q.ld);
}

/* Limit increments v_j - v_{j - band}, or none (0). Only where that changes are rows as new. */
RARE static void limit_increments(matrix_program *p, int band) {
    qp *q = &p->q;
    const int fresh = q->weight[0] == 0.0;
    if (!fresh && p->band == band) return;
    p->band = band;
    q->first_soft = band ? 2 * q->n : q->n;
    q->rows = q->first_soft + p->dense_rows;
    for (int i = 0; i < q->places; ++i) {
        q->lower[i] = q->floor[i] = -INFINITY;
        q->upper[i] = q->ceiling[i] = q->l1[i] = INFINITY;
        q->l2[i] = 0.0;
        q->weight[i] = i < q->n ? 1.0 : 0.70710678118654752440;
    }
}

/* y += scale a, for row a. */
static void add_row(const matrix_program *p, int row, double scale, double *restrict y) {
    const qp *q = &p->q;
    if (row < q->n) {
        y[row] += scale;
    } else if (row < q->first_soft) {
        const int j = row - q->n;
        y[j] += scale;
        if (j >= p->band) y[j - p->band] -= scale;
    } else {
        axpy(y, scale, p->matrix + (ptrdiff_t)(row - q->first_soft) * q->ld, p->extent[row - q->first_soft]);
    }
}

/* y += sum of l1 a over the saturated rows. */
static void add_saturated(const matrix_program *p, double *restrict y) {
    const qp *q = &p->q;
    for (int r = q->first_soft, left = q->saturated; left > 0 && r < q->rows; ++r)
        if (q->state[r] == SATURATED) {
            add_row(p, r, q->l1[r], y);
            --left;
        }
}

/* y += U'^-1 x, for an x that is zero from `extent` on. */
static void add_transformed(const matrix_program *p, const double *restrict x, int extent, double *restrict y) {
    const qp *q = &p->q;
    const int end = extent < q->n ? extent : q->n;
    for (int i = 0; i < end; ++i) {
        const int start = i / LANES * LANES;
        axpy(y + start, x[i], p->transpose + (ptrdiff_t)i * q->ld + start, q->ld - start);
    }
}

/* v += U^-1 x. */
static void add_solution(const matrix_program *p, const double *restrict x, double *restrict v) {
    for (int i = 0; i < p->q.n; ++i) axpy(v, x[i], p->inverse + (ptrdiff_t)i * p->q.ld, padded(i + 1));
}

static int matrix_transform(qp *q, int position) {
    const matrix_program *p = (const matrix_program *)q;
    const int row = q->member[position];
    double *m = moved(q, position);
    zero(m, q->ld);
    q->base[q->place[position]] = 0.0;
    q->extent[q->place[position]] = q->ld;
    if (row < q->first_soft) {
        const int j = row < q->n ? row : row - q->n;
        copy(m, p->transpose + (ptrdiff_t)j * q->ld, q->ld);
        if (row >= q->n && j >= p->band) axpy(m, -1.0, p->transpose + (ptrdiff_t)(j - p->band) * q->ld, q->ld);
    } else {
        const int i = row - q->first_soft;
        add_transformed(p, p->matrix + (ptrdiff_t)i * q->ld, p->extent[i], m);
    }
    return 1;
}

static void matrix_start(qp *q) {
    matrix_program *p = (matrix_program *)q;
    double *restrict total = p->sum;
    zero(q->w, q->ld);
    copy(total, p->gradient, q->ld);
    add_saturated(p, total);
    for (int i = 0; i < q->n; ++i) total[i] = -total[i];
    add_transformed(p, total, q->n, q->w);
}

/* Values of all rows at v. */
static void update_values(matrix_program *p) {
    qp *q = &p->q;
    const double *restrict v = p->v;
    double *restrict value = q->value;
    copy(value, v, q->n);
    if (p->band) {
        for (int j = 0; j < p->band; ++j) value[q->n + j] = v[j];
        for (int j = p->band; j < q->n; ++j) value[q->n + j] = v[j] - v[j - p->band];
    }
    for (int r = q->first_soft; r < q->rows; ++r)
        value[r] = dot(p->matrix + (ptrdiff_t)(r - q->first_soft) * q->ld, v, p->extent[r - q->first_soft]);
}

static void matrix_evaluate(qp *q) {
    matrix_program *p = (matrix_program *)q;
    zero(p->v, q->ld);
    add_solution(p, q->w, p->v);
    update_values(p);
}

static double matrix_correct(qp *q, const double *step) {
    matrix_program *p = (matrix_program *)q;
    axpy(q->w, 1.0, step, q->ld);
    zero(p->sum, q->ld);
    add_solution(p, step, p->sum);
    axpy(p->v, 1.0, p->sum, q->ld);
    update_values(p);
    return largest_size(p->sum, q->ld);
}

static double matrix_size_of(qp *q, const double *parts, int members, double *at_zero) {
    const matrix_program *p = (const matrix_program *)q;
    double *sum = q->shift, size = 0.0;
    zero(sum, q->ld);
    for (int i = 0; i < members; ++i)
        if (parts[i] != 0.0) add_row(p, q->member[i], parts[i], sum);
    for (int j = 0; j < q->n; ++j) size += fabs(sum[j]);
    *at_zero = 0.0;
    return size;
}

#endif
