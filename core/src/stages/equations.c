/* The equations of all substeps, factored: M dw = A0 dx + B du + defect, without forming A = M^-1 A0.
 *
 * For models with many states and few inputs, whose sparse factors are much smaller than A. The numbers of a substep lie
 * together, so that it is applied to eight columns at once, or to one. Matrices have a row for each equation, unknown or
 * state; inside, they are in the order of the pivots.
 */
#ifndef RUMO_EQUATIONS_C
#define RUMO_EQUATIONS_C

#include "base/clock.h"
#include "base/dims.h"
#include "stages/sparse_factor.c"

/* Rounds of refinement where a pivot does not hold, and the error that they may leave, over the solution. */
#define REFINEMENTS 3
#define REFINED 1e-9

typedef struct equations {
    dims s;
    const rumo_problem *problem;
    const block_pattern *blocks;
    const int *row, *column;  /* (nw,): pivots of equations and unknowns */
    int M, A0, B, defect;     /* where they begin in the numbers of a substep, after its factors, */
    int count;                /* and how many numbers there are */
    double *numbers;          /* (N, m, count) */
    int *steady;              /* (N, m): whether all pivots hold */
    double *row_unit, *unit;  /* (nw,): in which equations and unknowns, by pivots, are of one size */
    double *lanes;            /* (count, LANES): numbers of eight stages */
    double *local, *kept, *residual; /* (nw, LANES) */
    double *dw;               /* (nw,) */
} equations;

RARE static void lay_out_equations(arena *a, equations *q, const block_pattern *blocks, const rumo_problem *own,
                                   const rumo_problem *p) {
    const rumo_factor *f = &p->factor;
    const dims s = q->s = dims_of(&p->sizes);
    const int nw = f->unknowns;
    q->problem = own;
    q->blocks = blocks;
    int *row = alloc_ints(a, nw), *column = alloc_ints(a, nw);
    for (int i = 0; a->base && i < nw; ++i) {
        row[f->equation[i]] = i;
        column[f->unknown[i]] = i;
    }
    q->row = row;
    q->column = column;
    q->M = nw + 2 * rumo_sum(f->below, nw);
    q->A0 = q->M + f->outer + f->inner;
    q->B = q->A0 + p->A0.count;
    q->defect = q->B + p->B.count;
    q->count = padded(q->defect + nw);
    q->numbers = alloc_doubles(a, (ptrdiff_t)s.N * s.m * q->count);
    q->steady = alloc_ints(a, s.N * s.m);
    q->row_unit = alloc_doubles(a, nw);
    q->unit = alloc_doubles(a, nw);
    q->lanes = alloc_doubles(a, q->count * LANES);
    q->local = alloc_doubles(a, nw * LANES);
    q->kept = alloc_doubles(a, nw * LANES);
    q->residual = alloc_doubles(a, nw * LANES);
    q->dw = alloc_doubles(a, nw);
}

static inline const double *numbers_of(const equations *q, int k, int substep) {
    return q->numbers + (ptrdiff_t)(k * q->s.m + substep) * q->count;
}

/* right (nw, length) becomes M^-1 right. */
static WITHIN void solve_blocks(const equations *q, const double *numbers, const int each, double *right,
                                const int length) {
    const rumo_factor *f = &q->problem->factor;
    for (int b = 0; b < f->blocks; ++b) {
        const block_pattern *block = q->blocks + b;
        for (int e = block[0].outside; e < block[1].outside; ++e) {
            const int *at = f->nonzero + 3 * e;
            subtract_product(right + at[1] * length, numbers + (q->M + e) * each, right + at[2] * length, each, length);
        }
        solve_factored(block, numbers + block->entry * each, each, right + block->first * length, length);
    }
}

/* right becomes M'^-1 right. */
static WITHIN void solve_blocks_transposed(const equations *q, const double *numbers, double *right, const int length) {
    const rumo_factor *f = &q->problem->factor;
    for (int b = f->blocks - 1; b >= 0; --b) {
        const block_pattern *block = q->blocks + b;
        solve_transposed(block, numbers + block->entry, 1, right + block->first * length, length);
        for (int e = block[0].outside; e < block[1].outside; ++e) {
            const int *at = f->nonzero + 3 * e;
            subtract_product(right + at[2] * length, numbers + q->M + e, right + at[1] * length, 1, length);
        }
    }
}

/* right -= M x, or M' x */
static WITHIN void subtract_image(const equations *q, const double *numbers, const double *x, double *right,
                                  const int length, const int transposed) {
    const int *at = q->problem->factor.nonzero;
    for (int e = q->M; e < q->A0; ++e, at += 3)
        subtract_product(right + at[1 + transposed] * length, numbers + e, x + at[2 - transposed] * length, 1, length);
}

/* q->local (nw, length) becomes M^-1 or M'^-1 times itself, refined where a pivot does not hold. */
static WITHIN void solve_equations(const equations *q, const double *numbers, int steady, const int length,
                                   const int transposed) {
    const int size = q->problem->factor.unknowns * length;
    if (!steady) copy(q->kept, q->local, size);
    for (int round = 0;; ++round) {
        double *const x = round ? q->residual : q->local;
        if (transposed) solve_blocks_transposed(q, numbers, x, length);
        else solve_blocks(q, numbers, 1, x, length);
        for (int i = 0; round && i < size; ++i) q->local[i] += x[i];
        if (steady || round == REFINEMENTS) return;
        copy(q->residual, q->kept, size);
        subtract_image(q, numbers, q->local, q->residual, length, transposed);
    }
}

/* Units in which the largest entries of rows and columns are of size 1, by those of one stage. Source: Ruiz (2001). */
static void find_units(const equations *q, const double *M) {
    const rumo_factor *f = &q->problem->factor;
    for (int i = 0; i < f->unknowns; ++i) q->unit[i] = 1.0;
    for (int round = 0; round < 2 * SCALINGS; ++round) {
        const int of_rows = round % 2 == 0;
        double *const own = of_rows ? q->row_unit : q->unit, *const largest = q->kept;
        zero(largest, f->unknowns);
        for (int e = 0; e < f->outer + f->inner; ++e) {
            const int row = f->nonzero[3 * e + 1], column = f->nonzero[3 * e + 2];
            const double size = fabs(M[e * LANES]) * (of_rows ? q->unit[column] : q->row_unit[row]);
            double *const place = largest + (of_rows ? row : column);
            *place = size > *place ? size : *place;
        }
        for (int i = 0; i < f->unknowns; ++i) own[i] = largest[i] > 0.0 ? 1.0 / largest[i] : 1.0;
    }
}

/* Whether a substep in which a pivot does not hold gives the unknowns that its right-hand side was made of. */
RARE static int is_refined(const equations *q, const double *numbers) {
    const int nw = q->problem->factor.unknowns;
    double worst = 0.0;
    for (int transposed = 0; transposed < 2; ++transposed) {
        double *const unit = q->dw;
        for (int i = 0; i < nw; ++i) unit[i] = transposed ? q->row_unit[i] : q->unit[i];
        zero(q->local, nw);
        subtract_image(q, numbers, unit, q->local, 1, transposed);
        solve_equations(q, numbers, 0, 1, transposed);
        for (int i = 0; i < nw; ++i) worst = fmax(worst, fabs(q->local[i] / unit[i] + 1.0));
    }
    return worst < REFINED;
}

/* Factor a substep's M in all stages, from its terms (slots, lanes). correction (nw, lanes) becomes M^-1 (A0 dx + defect),
 * not refined, dx being its first rows; 0 for the first substep. Returns 0 if some stage has no solution to be trusted, or if
 * the clock comes to `end`. */
static OUTSIDE int factor_equations(equations *q, const double *terms, int substep, double *correction, double end) {
    const rumo_problem *p = q->problem;
    const rumo_factor *f = &p->factor;
    const dims s = dims_of(&p->sizes);
    const int nw = f->unknowns;
    const int firsts[] = {p->A0.first, p->B.first, p->defect_first}, counts[] = {p->A0.count, p->B.count, nw};
    for (int first = 0; first < s.lanes; first += LANES) {
        if (is_over(end)) return 0;
        const double *from = terms + first;
        double *const M = q->lanes + q->M * LANES, *to = M;
        for (int e = 0; e < f->outer + f->inner; ++e, to += LANES)
            copy(to, from + (ptrdiff_t)f->nonzero[3 * e] * s.lanes, LANES);
        for (int i = 0; i < 3; ++i)
            for (int e = 0; e < counts[i]; ++e, to += LANES) copy(to, from + (ptrdiff_t)(firsts[i] + e) * s.lanes, LANES);
        zero(q->lanes, q->M * LANES);
        for (int e = 0; e < f->inner; ++e) copy(q->lanes + f->entry[e] * LANES, M + (f->outer + e) * LANES, LANES);
        if (first == 0) find_units(q, M);
        int steady = 1;
        for (int b = 0; b < f->blocks; ++b)
            steady &= factor_block(q->blocks + b, q->row_unit + q->blocks[b].first, q->lanes + q->blocks[b].entry * LANES);
        for (int l = 0; l < LANES && first + l < s.N; ++l) {
            const int stage = (first + l) * s.m + substep;
            double *const numbers = q->numbers + (ptrdiff_t)stage * q->count;
            for (int e = 0; e < q->count; ++e) numbers[e] = q->lanes[e * LANES + l];
            q->steady[stage] = steady;
            if (!steady && !is_refined(q, numbers)) return 0;
        }
        for (int r = 0; r < nw; ++r) copy(q->local + q->row[r] * LANES, q->lanes + (q->defect + r) * LANES, LANES);
        for (int e = 0; substep > 0 && e < p->A0.count; ++e)
            add_product(q->local + q->row[p->A0.row[e]] * LANES, q->lanes + (q->A0 + e) * LANES,
                        correction + (ptrdiff_t)p->A0.column[e] * s.lanes + first, LANES, LANES);
        solve_blocks(q, q->lanes, LANES, q->local, LANES);
        for (int r = 0; r < nw; ++r)
            copy(correction + (ptrdiff_t)r * s.lanes + first, q->local + q->column[r] * LANES, LANES);
    }
    return all_finite(correction, nw * s.lanes);
}

/* right (nw, ld) + A0 before (nx, ld; NULL for none), solved for the unknowns: the first of them to after (rows, ld). */
static WITHIN void advance_some(const equations *q, int k, int substep, const double *before, const double *right,
                                int rows, double *after, int ld, const int length) {
    const double *numbers = numbers_of(q, k, substep);
    const rumo_pattern *A0 = &q->problem->A0;
    for (int r = 0; r < q->problem->factor.unknowns; ++r) copy(q->local + q->row[r] * length, right + r * ld, length);
    for (int e = 0; before && e < A0->count; ++e)
        add_product(q->local + q->row[A0->row[e]] * length, numbers + q->A0 + e, before + A0->column[e] * ld, 1, length);
    solve_equations(q, numbers, q->steady[k * q->s.m + substep], length, 0);
    for (int r = 0; r < rows; ++r) copy(after + r * ld, q->local + q->column[r] * length, length);
}

/* The same for as many columns as a multiple of LANES; after may be right, where it has as many rows. */
static OUTSIDE void advance_columns(const equations *q, int k, int substep, const double *before, const double *right,
                                    int rows, double *after, int ld, int columns) {
    for (int c = 0; c < columns; c += LANES)
        advance_some(q, k, substep, before ? before + c : NULL, right + c, rows, after + c, ld, LANES);
}

/* All unknowns dw (nw,) after dx (nx,) and du (nu,); du may be NULL for none. */
static OUTSIDE void advance_unknowns(const equations *q, int k, int substep, const double *dx, const double *du,
                                     double *dw) {
    const double *numbers = numbers_of(q, k, substep);
    const rumo_pattern *B = &q->problem->B;
    const int nw = q->problem->factor.unknowns;
    copy(q->residual, numbers + q->defect, nw);
    for (int e = 0; du && e < B->count; ++e) q->residual[B->row[e]] += numbers[q->B + e] * du[B->column[e]];
    advance_some(q, k, substep, dx, q->residual, nw, dw, 1, 1);
}

/* All substeps of an interval: the variables at its end, after (rows,), from the state dx (nx,) at its beginning. */
static void advance_interval(const equations *q, int k, const double *dx, const double *du, double *after) {
    for (int j = 0; j < q->s.m; ++j) {
        copy(after, j ? q->dw : dx, q->s.nx);
        advance_unknowns(q, k, j, after, du, q->dw);
    }
    copy(after, q->dw, q->s.rows);
}

#endif
