/* From stages dx_i = A dx_{i-1} + B du_{i-1} + c to a dense quadratic program in the free inputs v = du / range.
 *
 * Rows of a stage are states, then algebraic variables at its end; of these only states go on to the next.
 *
 * Index k = 0 .. N-1 stands for stage i = k + 1. An input acts on its own stage and those after it: columns of earlier
 * stages are skipped, not multiplied.
 */
#ifndef RUMO_CONDENSE_C
#define RUMO_CONDENSE_C

#include "base/clock.h"
#include "base/lanes.h"
#include "base/dims.h"
#include "stages/equations.c"
#include "stages/sparse.h"
#include "base/blocks.h"
#include "solve/dense/factorise.c"

typedef struct condensed {
    rumo_blocking held;
    double *stages;       /* (N, width, ldx): columns of A, B and c */
    double *response;     /* (N, rows, ld): dx and dz over v */
    double *right;        /* (nw, ld): of wide models' equations */
    double *outputs;      /* (N ny, ld): sqrt(2 Q) dy over v */
    double *rows;         /* (N nc, ld): dG over v */
    double *root_weights; /* (N, ny): sqrt(2 Q) */
    double *hessian;      /* (n, ld): upper triangle */
    double *factor;       /* (n, ld): U, with U'U the Hessian */
    double *inverse;      /* (n, ld): inverse of U', lower triangular */
    double *transpose;    /* (n, ld): inverse of U, upper triangular */
} condensed;

/* The stages' maps (entries, lanes) to the columns of each stage. */
static void spread(const dims *s, const sparse *map, const int *row, const double *restrict maps, double *restrict stages) {
    for (int e = 0; e < map->start[s->rows]; ++e) {
        double *restrict place = stages + map->column[e] * s->ldx + row[e];
        const double *restrict values = maps + (ptrdiff_t)e * s->lanes;
        for (int k = 0; k < s->N; ++k) place[(ptrdiff_t)k * s->width * s->ldx] = values[k];
    }
}

/* dx of a stage from dx of the one before; du may be NULL for none. */
static inline void advance(const dims *s, const double *restrict stage, const double *restrict before,
                           const double *restrict du, double *restrict dx) {
    for (int r = 0; r < s->ldx; r += LANES) {
        double even[LANES], odd[LANES] = {0.0}; /* two sums, so that one need not wait for the other */
        const double *restrict column = stage + r;
        copy(even, stage + (ptrdiff_t)(s->width - 1) * s->ldx + r, LANES);
        int c = 0;
        for (; c + 1 < s->nx; c += 2, column += 2 * s->ldx) {
            for (int l = 0; l < LANES; ++l) even[l] += before[c] * column[l];
            for (int l = 0; l < LANES; ++l) odd[l] += before[c + 1] * column[s->ldx + l];
        }
        if (c < s->nx) {
            for (int l = 0; l < LANES; ++l) even[l] += before[c] * column[l];
            column += s->ldx;
        }
        for (int j = 0; du && j < s->nu; ++j, column += s->ldx)
            for (int l = 0; l < LANES; ++l) odd[l] += du[j] * column[l];
        for (int l = 0; l < LANES; ++l) dx[r + l] = even[l] + odd[l];
    }
}

/* row = scale * sum of factor_e * (row column_e of from); factors lie `step` apart. */
static inline void combine(double *restrict row, double scale, const double *restrict factor, int step,
                           const int *column, int count, const double *restrict from, int ld, int length) {
    for (int j = 0; j < length; j += LANES) {
        double s[LANES] = {0.0};
        for (int e = 0; e < count; ++e) {
            const double f = factor[(ptrdiff_t)e * step];
            const double *restrict x = from + (ptrdiff_t)column[e] * ld + j;
            for (int l = 0; l < LANES; ++l) s[l] += f * x[l];
        }
        for (int l = 0; l < LANES; ++l) row[j + l] = scale * s[l];
    }
}

/* The sparse matrices (Cx, Cu) or (D, E) of stage k times what the free inputs do to (x_i, u_{i-1}). */
static WITHIN void measure(const dims *s, const condensed *h, const double *restrict terms, int k, int r,
                           const sparse *of_x, const sparse *of_u, double scale, const double *input_scales,
                           double *restrict row) {
    const double *values = terms + k;
    combine(row, scale, values + (ptrdiff_t)(of_x->first + of_x->start[r]) * s->lanes, s->lanes,
            of_x->column + of_x->start[r], of_x->start[r + 1] - of_x->start[r], h->response + (ptrdiff_t)k * s->rows * s->ld,
            s->ld, padded(inputs_at(s, &h->held, k)));
    if (k < s->d) return;
    for (int e = of_u->start[r]; e < of_u->start[r + 1]; ++e) {
        const int j = of_u->column[e];
        act(s, &h->held, k, j, scale * values[(ptrdiff_t)(of_u->first + e) * s->lanes] * input_scales[j], row);
    }
}

static inline double sum_of_sizes(const double *x, int length) {
    double s[LANES] = {0.0};
    for (int j = 0; j < length; j += LANES)
        for (int l = 0; l < LANES; ++l) s[l] += fabs(x[j + l]);
    return sum_of_lanes(s);
}

/* dx and dz over v, stage by stage, from the sparse rows of A and B, until the clock comes to `end`. */
static void respond(const dims *s, const sparse *map, const int *end_of_A, const double *restrict maps,
                    const double *input_scales, double end, condensed *h) {
    for (int k = s->d; k < s->N; ++k) {
        if (is_over(end)) return;
        double *now = h->response + (ptrdiff_t)k * s->rows * s->ld;
        const int before = padded(inputs_at(s, &h->held, k - 1)), length = padded(inputs_at(s, &h->held, k));
        for (int r = 0; r < s->rows; ++r) {
            double *restrict row = now + r * s->ld;
            const double *values = maps + (ptrdiff_t)map->start[r] * s->lanes + k;
            zero(row + before, length - before);
            combine(row, 1.0, values, s->lanes, map->column + map->start[r], end_of_A[r] - map->start[r],
                    now - (ptrdiff_t)s->rows * s->ld, s->ld, before);
            for (int e = end_of_A[r]; e < map->start[r + 1]; ++e) {
                const int j = map->column[e] - s->nx;
                if (j < s->nu) act(s, &h->held, k, j, maps[(ptrdiff_t)e * s->lanes + k] * input_scales[j], row);
            }
        }
    }
}

/* The same from the equations of wide models. */
static void respond_widely(const equations *q, const double *input_scales, double end, condensed *h) {
    const dims *s = &q->s;
    const rumo_pattern *B = &q->problem->B;
    for (int k = s->d; k < s->N; ++k) {
        double *now = h->response + (ptrdiff_t)k * s->rows * s->ld;
        const double *before = k > s->d ? now - (ptrdiff_t)s->rows * s->ld : NULL;
        const int length = padded(inputs_at(s, &h->held, k));
        for (int j = 0; j < s->m && !is_over(end); ++j) {
            const double *numbers = numbers_of(q, k, j) + q->B;
            const int rows = j + 1 == s->m ? s->rows : s->nx;
            zero(h->right, s->nw * s->ld);
            for (int e = 0; e < B->count; ++e)
                act(s, &h->held, k, B->column[e], numbers[e] * input_scales[B->column[e]], h->right + B->row[e] * s->ld);
            advance_columns(q, k, j, before, h->right, rows, now, s->ld, length);
            before = now;
        }
    }
}

/* How far the ranges of all free inputs together move each state until the end of a stage: it is in the responses. */
static void reach_of(const dims *s, const condensed *h, int stages, double *restrict reach) {
    const double *last = h->response + (ptrdiff_t)(stages - 1) * s->rows * s->ld;
    const int length = padded(inputs_at(s, &h->held, stages - 1));
    for (int r = 0; r < s->nx; ++r) reach[r] = sum_of_sizes(last + r * s->ld, length);
}

/* Upper triangle of the Gauss-Newton Hessian: outputs' outputs, and the band of the input increments; until the clock comes to
 * `end`. */
static void add_up_hessian(const dims *s, const double *restrict move_weights, const double *input_scales, double damping,
                           double end, condensed *h) {
    for (int i = 0; i < s->n && !is_over(end); i += ROWS)
        for (int j = i / LANES * LANES; j < s->ld; j += LANES) {
            double block[ROWS][LANES] = {{0.0}};
            /* Column j and those after it are zero before the stage of input j. */
            const int first = first_stage(s, &h->held, j / s->nu < s->nb ? j / s->nu : s->nb - 1) * s->ny;
            for (int r = first; r < s->N * s->ny; ++r) {
                const double *restrict y = h->outputs + (ptrdiff_t)r * s->ld;
                for (int p = 0; p < ROWS; ++p)
                    for (int l = 0; l < LANES; ++l) block[p][l] += y[i + p] * y[j + l];
            }
            for (int p = 0; p < ROWS && i + p < s->n; ++p)
                copy(h->hessian + (ptrdiff_t)(i + p) * s->ld + j, block[p], LANES);
        }
    for (int i = 0; i < s->n; ++i) {
        const int j = i % s->nu;
        const double weight = 2.0 * move_weights[i] * input_scales[j] * input_scales[j] + 2.0 * damping;
        double *diagonal = h->hessian + (ptrdiff_t)i * s->ld + i;
        *diagonal += weight;
        if (i < s->nu) continue;
        double *before = diagonal - (ptrdiff_t)s->nu * (s->ld + 1);
        *before += weight;
        before[s->nu] -= weight;
    }
}

#endif
