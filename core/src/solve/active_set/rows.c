/* Rows of a quadratic program and their states.
 *
 *   min v'Hv/2 + g'v + sum_i l1_i s_i + l2_i s_i^2    lower <= (v, increments of v, rows v) <= upper + s,  s >= 0
 *
 * A row with infinite l1 is hard. Slacks are no variables: a multiplier between 0 and l1 holds a soft row at its
 * limit, one above l1 lets it give way by (multiplier - l1) / (2 l2), and with l2 = 0 it stays at l1.
 */
#ifndef RUMO_ROWS_C
#define RUMO_ROWS_C

#include "rumo_core.h"

#include "base/arena.h"
#include "base/lanes.h"

typedef enum row_state {
    INACTIVE,
    AT_LOWER,  /* multiplier <= 0 */
    AT_UPPER,  /* 0 <= multiplier <= l1 */
    GIVING,    /* soft, multiplier >= l1, l2 > 0 */
    SATURATED  /* soft, multiplier = l1, l2 = 0: not in the working set */
} row_state;

typedef struct qp {
    int n, ld;             /* variables; length of a row, padded */
    int band;              /* inputs of a stage, if increments v_j - v_{j - band} are limited; else 0 */
    int rows, dense;       /* all rows: n bounds, n increments if limited, then the dense ones from `dense` on */
    int places;            /* for rows, at most and padded */
    int capacity, stride;  /* of the working set; of L */
    const double *hessian, *inverse, *transpose; /* see condense.c */
    const double *matrix;  /* dense rows, ld apart */
    int *extent;           /* (dense rows,): length to which a row is not zero, padded */
    double *lower, *upper, *l1, *l2, *weight; /* (rows,): weight is 1 / norm, */
    double *norm;                             /* of those that were members */
    double *floor, *ceiling, *value;          /* (rows,): limits that are still to be watched, and a'v */
    int *state, saturated;                    /* (rows,): row_state; how many are saturated */
    int count;             /* members of the working set */
    int *member, *place;   /* row of each; where its m lies */
    double *mu, *moved, *L, *D;
    int pending;           /* 1 while the row at position `count` waits to join */
    int settled;           /* members at the front that are where their multipliers want them, but for rounding */
    int delicate;          /* whether rows nearly depend on each other, and rounding matters */
    double *w, *v;         /* minimiser, as U v and as v */
    double *direction, *trial, *spare; /* scratch: of multipliers, */
    double *shift, *residual;          /* and of variables */
    int *conflict, conflicts, *scratch;
    double tolerance;      /* of a row, in units of v */
    int iterations;
} qp;

/* Room for bounds and increments of n variables, and for dense rows; increments are limited later if at all. */
RARE static void alloc_qp(arena *a, qp *q, int n, int band, int dense) {
    q->n = n;
    q->ld = padded(n);
    q->dense = n;
    q->rows = n + dense;
    q->capacity = n + dense + 1; /* only rows that give way can be more than n; one may be pending */
    q->stride = padded(q->capacity);
    q->places = padded((band ? 2 * n : n) + dense);
    double **const per_row[] = {&q->lower,  &q->upper, &q->l1,      &q->l2,   &q->weight,
                                &q->norm, &q->floor, &q->ceiling, &q->value};
    for (size_t i = 0; i < sizeof per_row / sizeof *per_row; ++i) *per_row[i] = alloc_doubles(a, q->places);
    q->extent = alloc_ints(a, dense);
    q->state = alloc_ints(a, q->places);
    q->member = alloc_ints(a, q->capacity);
    q->place = alloc_ints(a, q->capacity);
    q->conflict = alloc_ints(a, q->capacity);
    q->scratch = alloc_ints(a, q->capacity);
    q->moved = alloc_doubles(a, (ptrdiff_t)q->capacity * q->ld);
    q->L = alloc_doubles(a, (ptrdiff_t)q->capacity * q->stride);
    double **const per_member[] = {&q->mu, &q->D, &q->direction, &q->trial, &q->spare};
    for (size_t i = 0; i < sizeof per_member / sizeof *per_member; ++i) *per_member[i] = alloc_doubles(a, q->stride);
    double **const per_variable[] = {&q->w, &q->v, &q->shift, &q->residual};
    for (size_t i = 0; i < sizeof per_variable / sizeof *per_variable; ++i) *per_variable[i] = alloc_doubles(a, q->ld);
}

/* Limit increments v_j - v_{j - band}, or none (0). Only where that changes are rows as new. */
RARE static void limit_increments(qp *q, int band) {
    const int dense_rows = q->rows - q->dense, fresh = q->weight[0] == 0.0;
    if (!fresh && q->band == band) return;
    q->band = band;
    q->dense = band ? 2 * q->n : q->n;
    q->rows = q->dense + dense_rows;
    for (int i = 0; i < q->places; ++i) {
        q->lower[i] = q->floor[i] = -INFINITY;
        q->upper[i] = q->ceiling[i] = q->l1[i] = INFINITY;
        q->l2[i] = 0.0;
        q->weight[i] = i < q->n ? 1.0 : 0.70710678118654752440;
    }
}

static inline double *moved(const qp *q, int position) { return q->moved + (ptrdiff_t)q->place[position] * q->ld; }

/* y += scale a, for row a. */
static void add_row(const qp *q, int row, double scale, double *restrict y) {
    if (row < q->n) {
        y[row] += scale;
    } else if (row < q->dense) {
        const int j = row - q->n;
        y[j] += scale;
        if (j >= q->band) y[j - q->band] -= scale;
    } else {
        axpy(y, scale, q->matrix + (ptrdiff_t)(row - q->dense) * q->ld, q->extent[row - q->dense]);
    }
}

/* y += sum of l1 a over the saturated rows. */
static void add_saturated(const qp *q, double *restrict y) {
    for (int r = q->dense, left = q->saturated; left > 0 && r < q->rows; ++r)
        if (q->state[r] == SATURATED) {
            add_row(q, r, q->l1[r], y);
            --left;
        }
}

/* y += U'^-1 x, for an x that is zero from `extent` on. */
static void add_transformed(const qp *q, const double *restrict x, int extent, double *restrict y) {
    const int end = extent < q->n ? extent : q->n;
    for (int i = 0; i < end; ++i) {
        const int start = i / LANES * LANES;
        axpy(y + start, x[i], q->transpose + (ptrdiff_t)i * q->ld + start, q->ld - start);
    }
}

/* v += U^-1 x. */
static void add_solution(const qp *q, const double *restrict x, double *restrict v) {
    for (int i = 0; i < q->n; ++i) axpy(v, x[i], q->inverse + (ptrdiff_t)i * q->ld, padded(i + 1));
}

/* m = U'^-1 a. */
static void transform(const qp *q, int row, double *restrict m) {
    zero(m, q->ld);
    if (row < q->dense) {
        const int j = row < q->n ? row : row - q->n;
        copy(m, q->transpose + (ptrdiff_t)j * q->ld, q->ld);
        if (row >= q->n && j >= q->band) axpy(m, -1.0, q->transpose + (ptrdiff_t)(j - q->band) * q->ld, q->ld);
    } else {
        add_transformed(q, q->matrix + (ptrdiff_t)(row - q->dense) * q->ld, q->extent[row - q->dense], m);
    }
}

static void watch(qp *q, int row, row_state state) {
    q->saturated += (state == SATURATED) - (q->state[row] == SATURATED);
    q->state[row] = (int)state;
    q->floor[row] = state == INACTIVE ? q->lower[row] : state == SATURATED ? q->upper[row] : -INFINITY;
    q->ceiling[row] = state == INACTIVE ? q->upper[row] : INFINITY;
}

static inline double compliance(const qp *q, int row) { return q->state[row] == GIVING ? 0.5 / q->l2[row] : 0.0; }

/* How far a value of a member is from where its state and multiplier want it. */
static inline double deviation(const qp *q, int position, double value) {
    const int row = q->member[position];
    switch ((row_state)q->state[row]) {
    case AT_LOWER: return value - q->lower[row];
    case GIVING: return value - q->upper[row] - (q->mu[position] - q->l1[row]) * 0.5 / q->l2[row];
    default: return value - q->upper[row];
    }
}

#endif
