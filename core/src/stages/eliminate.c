/* From a substep's equations M dw = A0 dx + B du + defect to dw = A dx + B du + c.
 *
 * Eight stages at a time, block by block in the triangular order that the sparsity pattern gives, and inside a block in the
 * order of pivots that was found at set-up, which knows what is zero. Where a pivot turns out too small in one of the
 * stages, the block is solved with row pivoting instead: rows are exchanged stage by stage.
 */
#ifndef RUMO_ELIMINATE_C
#define RUMO_ELIMINATE_C

#include "rumo_core.h"

#include "base/clock.h"
#include "base/dims.h"
#include "base/lanes.h"
#include "stages/sparse_factor.c"
#include "stages/tape.c"

/* A pivot is kept unless another entry of its column is so many times larger, as sparse solvers do. */
#define PATIENCE 8.0

/* Make the largest entry of a column the pivot, in each stage; rows are compared in the units that end them. */
static inline void exchange_rows(double *restrict upper, double *restrict lower, int column, int length) {
    int swap[LANES];
    const int unit = length - 1;
    for (int l = 0; l < LANES; ++l)
        swap[l] = fabs(lower[column * LANES + l]) * lower[unit * LANES + l] >
                  fabs(upper[column * LANES + l]) * upper[unit * LANES + l];
    for (int e = column; e < length; ++e)
        for (int l = 0; l < LANES; ++l) {
            const double a = upper[e * LANES + l], b = lower[e * LANES + l];
            upper[e * LANES + l] = swap[l] ? b : a;
            lower[e * LANES + l] = swap[l] ? a : b;
        }
}

/* Whether some stage has an entry below the pivot of column p that is larger. */
static inline int needs_exchange(const double *restrict work, int m, int row, int p) {
    const int unit = row - LANES;
    double excess[LANES];
    for (int l = 0; l < LANES; ++l) excess[l] = 0.0;
    for (int i = p + 1; i < m; ++i)
        for (int l = 0; l < LANES; ++l) {
            const double size = fabs(work[i * row + p * LANES + l]) * work[i * row + unit + l];
            excess[l] = size > excess[l] ? size : excess[l];
        }
    double most = 0.0;
    for (int l = 0; l < LANES; ++l) {
        const double more = excess[l] - PATIENCE * fabs(work[p * row + p * LANES + l]) * work[p * row + unit + l];
        most = more > most ? more : most;
    }
    return most > 0.0;
}

/* y -= a x, entry by entry and stage by stage. */
static inline void subtract(double *restrict y, const double *restrict a, const double *restrict x, int count) {
    for (int e = 0; e < count; ++e)
        for (int l = 0; l < LANES; ++l) y[e * LANES + l] -= a[l] * x[e * LANES + l];
}

/* How pivots are taken in one block, and what else is not zero. */
typedef struct block_order {
    int m, k;
    const int *unknowns, *below, *across, *lower, *upper;
} block_order;

/* Solve a block for its right-hand side, in eight stages at once: work (m, m + k + 1, LANES). 0 if a pivot is too small. */
static OUTSIDE int solve_in_order(const block_order *o, const double *unit, double *work) {
    const int m = o->m, k = o->k, row = (m + k + 1) * LANES;
    const int *lower = o->lower, *upper = o->upper;
    double lack[LANES] = {0.0};
    for (int p = 0; p < m; ++p) {
        double *restrict pivot = work + p * row;
        double excess[LANES] = {0.0}, inverse[LANES];
        for (int i = 0; i < o->below[p]; ++i) {
            const double *restrict other = work + lower[i] * row + p * LANES;
            for (int l = 0; l < LANES; ++l) excess[l] = larger(excess[l], fabs(other[l]) * unit[o->unknowns[lower[i]]]);
        }
        const double enough = PATIENCE * unit[o->unknowns[p]];
        for (int l = 0; l < LANES; ++l) lack[l] = larger(lack[l], excess[l] - enough * fabs(pivot[p * LANES + l]));
        for (int l = 0; l < LANES; ++l) inverse[l] = 1.0 / pivot[p * LANES + l];
        for (int e = 0; e < o->across[p]; ++e)
            for (int l = 0; l < LANES; ++l) pivot[upper[e] * LANES + l] *= inverse[l];
        for (int i = 0; i < o->below[p]; ++i) {
            double *restrict other = work + lower[i] * row;
            for (int e = 0; e < o->across[p]; ++e)
                subtract(other + upper[e] * LANES, other + p * LANES, pivot + upper[e] * LANES, 1);
        }
        lower += o->below[p];
        upper += o->across[p];
    }
    for (int p = m - 1; p >= 0; --p) {
        upper -= o->across[p];
        for (int e = 0; e < o->across[p] && upper[e] < m; ++e)
            subtract(work + p * row + m * LANES, work + p * row + upper[e] * LANES, work + upper[e] * row + m * LANES, k);
    }
    return largest_size(lack, LANES) == 0.0;
}

/* The same with row pivoting. */
static OUTSIDE void solve_with_exchanges(double *work, int m, int k) {
    const int columns = m + k, row = (columns + 1) * LANES;
    for (int p = 0; p < m; ++p) {
        double *restrict pivot = work + p * row;
        if (needs_exchange(work, m, row, p))
            for (int i = p + 1; i < m; ++i) exchange_rows(pivot, work + i * row, p, columns + 1);
        double inverse[LANES];
        for (int l = 0; l < LANES; ++l) inverse[l] = 1.0 / pivot[p * LANES + l];
        for (int e = p + 1; e < columns; ++e)
            for (int l = 0; l < LANES; ++l) pivot[e * LANES + l] *= inverse[l];
        const int next = (p + 1) * LANES;
        for (int i = p + 1; i < m; ++i)
            subtract(work + i * row + next, work + i * row + p * LANES, pivot + next, columns - p - 1);
    }
    for (int p = m - 1; p > 0; --p)
        for (int i = 0; i < p; ++i)
            subtract(work + i * row + m * LANES, work + i * row + p * LANES, work + p * row + m * LANES, k);
}

/* The same of a sparse block: right (m, k, LANES), the entries of the block, and as much room as a dense one needs. If a pivot
 * does not hold in some stage, all eight are solved as a dense block, and 0 is returned. */
static OUTSIDE int solve_sparse_block(const block_pattern *b, const double *unit, double *right, int k) {
    const int m = b->size, row = (m + k + 1) * LANES;
    double *const entries = right + m * k * LANES, *const kept = entries + entries_of(b) * LANES;
    double *const square = kept + entries_of(b) * LANES;
    copy(kept, entries, entries_of(b) * LANES);
    if (factor_block(b, unit, entries)) {
        solve_factored(b, entries, LANES, right, k * LANES);
        return 1;
    }
    zero(square, m * row);
    const double *below = kept + m * LANES, *across = below + b->fill * LANES;
    const int *later = b->later;
    for (int p = 0; p < m; ++p) {
        copy(square + p * row + p * LANES, kept + p * LANES, LANES);
        for (int i = 0; i < b->below[p]; ++i, ++later, below += LANES, across += LANES) {
            copy(square + *later * row + p * LANES, below, LANES);
            copy(square + p * row + *later * LANES, across, LANES);
        }
        copy(square + p * row + m * LANES, right + p * k * LANES, k * LANES);
        for (int l = 0; l < LANES; ++l) square[p * row + (m + k) * LANES + l] = unit[b->equation[p]];
    }
    solve_with_exchanges(square, m, k);
    for (int p = 0; p < m; ++p) copy(right + p * k * LANES, square + p * row + m * LANES, k * LANES);
    return 0;
}

/* What a block is made of, in eight stages: entries of the terms, and what is known of earlier blocks. */
static void load_block(const rumo_elimination *order, int b, const int *load, const int *update, const double *restrict terms,
                       const double *restrict result, int lanes, int places, double *restrict work) {
    zero(work, places * LANES);
    for (int e = 0; e < order->loads[b]; ++e, load += 2)
        copy(work + load[1] * LANES, terms + (ptrdiff_t)load[0] * lanes, LANES);
    for (int e = 0; e < order->updates[b]; ++e, update += 3) {
        const double *restrict coefficient = terms + (ptrdiff_t)update[0] * lanes;
        const double *restrict known = result + (ptrdiff_t)update[1] * lanes;
        double *restrict place = work + update[2] * LANES;
        for (int l = 0; l < LANES; ++l) place[l] -= coefficient[l] * known[l];
    }
}

/* Eight stages, from terms to result; how many blocks needed exchanges. */
static int eliminate_chunk(const rumo_elimination *order, const block_pattern *patterns, const double *unit,
                           const double *restrict terms, int lanes, double *restrict work, double *restrict result) {
    const int *load = order->load, *update = order->update, *store = order->store;
    block_order o = {0, 0, order->unknowns, order->below, order->across, order->lower, order->upper};
    int exchanged = 0;
    for (int b = 0; b < order->blocks; ++b) {
        o.m = order->size[b];
        o.k = order->width[b];
        const int sparsely = RUMO_SPARSE && order->sparse[b];
        const int places = sparsely ? o.m * o.k + entries_of(patterns + b) : o.m * (o.m + o.k + 1);
        load_block(order, b, load, update, terms, result, lanes, places, work);
        if (sparsely) {
            exchanged += !solve_sparse_block(patterns + b, unit, work, o.k);
        } else if (!solve_in_order(&o, unit, work)) {
            load_block(order, b, load, update, terms, result, lanes, places, work);
            for (int i = 0; i < o.m; ++i)
                for (int l = 0; l < LANES; ++l) work[((i + 1) * (o.m + o.k + 1) - 1) * LANES + l] = unit[o.unknowns[i]];
            solve_with_exchanges(work, o.m, o.k);
            ++exchanged;
        }
        for (int e = 0; e < order->stores[b]; ++e, store += 2)
            copy(result + (ptrdiff_t)store[1] * lanes, work + store[0] * LANES, LANES);
        load += 2 * order->loads[b];
        update += 3 * order->updates[b];
        for (int p = 0; p < o.m; ++p) {
            o.lower += *o.below++;
            o.upper += *o.across++;
        }
        o.unknowns += o.m;
    }
    return exchanged;
}

/* terms (slots, lanes) to result (entries, lanes): `lack` (lanes,) is more than 0 or NaN where a pivot was too small, or the
 * result is not finite. 0 if nothing was done. A tailored build has it as C code, if there is not too much of it. */
#ifndef RUMO_TAILORED
#define eliminate_in_order(unit, patience, terms, result, lack) 0
#endif

/* terms (slots, lanes) to result (entries, lanes); 0 where that is not finite, or if the clock comes to `end`. */
static int eliminate(const rumo_elimination *order, const block_pattern *patterns, const double *unit,
                     const double *restrict terms, int lanes, double *restrict lack, double *restrict work,
                     double *restrict result, double end) {
    const int tried = eliminate_in_order(unit, PATIENCE, terms, result, lack);
    int complete = tried;
    for (int first = 0; first < lanes; first += LANES) {
        int fine = tried;
        for (int k = first; fine && k < first + LANES; ++k) fine = lack[k] == 0.0;
        if (fine) continue;
        if (is_over(end)) return 0;
        complete = 0;
        eliminate_chunk(order, patterns, unit, terms + first, lanes, work, result + first);
    }
    return complete || all_finite(result, order->entries * lanes);
}

/* Units in which the rows of each block compare: powers of two that balance |M| over all stages, so that pivots
 * do not depend on the units of the unknowns; 0 if the clock comes to `end` before. Source: Osborne (1960). */
RARE static int balance(const rumo_elimination *order, const rumo_pattern *M, const double *terms, int lanes, int unknowns,
                        int *block_of, double *unit, double end) {
    const int *member = order->unknowns;
    for (int b = 0; b < order->blocks; ++b)
        for (int i = 0; i < order->size[b]; ++i) block_of[*member++] = b;
    for (int r = 0; r < unknowns; ++r) unit[r] = 1.0;
    for (int sweep = 0; sweep < 4; ++sweep)
        for (int r = 0; r < unknowns; ++r) {
            if (is_over(end)) return 0;
            double in_row = 0.0, in_column = 0.0;
            for (int e = 0; e < M->count; ++e) {
                const int i = M->row[e], j = M->column[e];
                if (i == j || block_of[i] != block_of[j] || (i != r && j != r)) continue;
                double largest = 0.0;
                for (int k = 0; k < lanes; ++k) largest = fmax(largest, fabs(terms[(ptrdiff_t)(M->first + e) * lanes + k]));
                /* M_ij has the unit of row i over that of unknown j. */
                largest *= unit[i] / unit[j];
                if (i == r) in_row = fmax(in_row, largest);
                else in_column = fmax(in_column, largest);
            }
            if (in_row > 0.0 && in_column > 0.0 && isfinite(in_row) && isfinite(in_column)) {
                int exponent;
                (void)frexp(sqrt(in_column / in_row), &exponent);
                unit[r] = ldexp(unit[r], exponent);
            }
        }
    return 1;
}

#endif
