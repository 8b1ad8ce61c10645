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

/* A pivot is kept unless eliminating its column changes another pivot by more than so many times that one. That is the same in
 * any units of equations and unknowns. */
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

/* y -= a x, entry by entry and stage by stage. */
static inline void subtract(double *restrict y, const double *restrict a, const double *restrict x, int count) {
    for (int e = 0; e < count; ++e)
        for (int l = 0; l < LANES; ++l) y[e * LANES + l] -= a[l] * x[e * LANES + l];
}

/* How pivots are taken in one block, and what else is not zero. */
typedef struct block_order {
    int m, k;
    const int *below, *across, *lower, *upper;
} block_order;

/* Solve a block for its right-hand side, in eight stages at once: work (m, m + k + 1, LANES). 0 if a pivot is too small. */
static OUTSIDE int solve_in_order(const block_order *o, double *work) {
    const int m = o->m, k = o->k, row = (m + k + 1) * LANES;
    const int *lower = o->lower, *upper = o->upper;
    double lack[LANES] = {0.0}, odd[LANES] = {0.0};
    for (int p = 0; p < m; ++p) {
        double *restrict pivot = work + p * row;
        double inverse[LANES];
        for (int l = 0; l < LANES; ++l) inverse[l] = 1.0 / pivot[p * LANES + l];
        for (int l = 0; l < LANES; ++l) odd[l] += 0.0 * inverse[l];
        for (int e = 0; e < o->across[p]; ++e)
            for (int l = 0; l < LANES; ++l) pivot[upper[e] * LANES + l] *= inverse[l];
        for (int i = 0; i < o->below[p]; ++i) {
            const int r = lower[i];
            double *restrict other = work + r * row;
            for (int l = 0; l < LANES; ++l)
                lack[l] = larger(lack[l], fabs(other[p * LANES + l] * pivot[r * LANES + l]) -
                                              PATIENCE * fabs(other[r * LANES + l]));
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
    double sum = largest_size(lack, LANES);
    for (int l = 0; l < LANES; ++l) sum += odd[l];
    return sum == 0.0;
}

/* Units at the ends of rows in which these are equally large, and columns as well: of those, column (m, LANES). They are found
 * from the numbers of each stage, so that pivots do not depend on users' units or on what was before. Source: Ruiz (2001). */
static void find_row_units(double *restrict work, int m, int row, double *restrict column) {
    const int unit = row - LANES;
    for (int e = 0; e < m * LANES; ++e) column[e] = 1.0;
    for (int round = 0; round < SCALINGS; ++round) {
        for (int i = 0; i < m; ++i) {
            double largest[LANES] = {0.0};
            for (int j = 0; j < m; ++j)
                for (int l = 0; l < LANES; ++l)
                    largest[l] = larger(largest[l], fabs(work[i * row + j * LANES + l]) * column[j * LANES + l]);
            for (int l = 0; l < LANES; ++l) work[i * row + unit + l] = largest[l] > 0.0 ? 1.0 / largest[l] : 1.0;
        }
        for (int j = 0; j < m; ++j) {
            double largest[LANES] = {0.0};
            for (int i = 0; i < m; ++i)
                for (int l = 0; l < LANES; ++l)
                    largest[l] = larger(largest[l], fabs(work[i * row + j * LANES + l]) * work[i * row + unit + l]);
            for (int l = 0; l < LANES; ++l) column[j * LANES + l] = largest[l] > 0.0 ? 1.0 / largest[l] : 1.0;
        }
    }
}

/* The same with row pivoting. */
static OUTSIDE void eliminate_with_exchanges(double *work, int m, int k, double *column) {
    const int columns = m + k, row = (columns + 1) * LANES;
    find_row_units(work, m, row, column);
    for (int p = 0; p < m; ++p) {
        double *restrict pivot = work + p * row;
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

/* Row pivoting and one refinement, after which the result is that of a matrix each entry of which is off by rounding only, as
 * long as sizes differ by no more than 1e16 or so: work (2, m, m + k + 1, LANES), and m more. Source: Skeel (1980). */
static OUTSIDE void solve_with_exchanges(double *work, int m, int k) {
    const int row = (m + k + 1) * LANES;
    double *const left = work + m * row, *const column = left + m * row;
    copy(left, work, m * row);
    eliminate_with_exchanges(work, m, k, column);
    for (int i = 0; i < m; ++i)
        for (int j = 0; j < m; ++j)
            subtract(left + i * row + m * LANES, left + i * row + j * LANES, work + j * row + m * LANES, k);
    eliminate_with_exchanges(left, m, k, column);
    for (int i = 0; i < m; ++i)
        for (int e = m * LANES; e < row - LANES; ++e) work[i * row + e] += left[i * row + e];
}

/* Units in which the rows and columns of a sparse block are equally large, as above, in the largest of eight stages. */
static void find_block_units(const block_pattern *b, const double *entries, double *row, double *column) {
    const int m = b->size;
    for (int i = 0; i < m; ++i) column[i] = 1.0;
    for (int round = 0; round < 2 * SCALINGS; ++round) {
        const int of_rows = round % 2 == 0;
        double *const own = of_rows ? row : column, *const given = of_rows ? column : row;
        const double *below = entries + m * LANES, *across = below + b->fill * LANES;
        const int *later = b->later;
        for (int i = 0; i < m; ++i) own[i] = largest_size(entries + i * LANES, LANES) * given[i];
        for (int p = 0; p < m; ++p)
            for (int i = 0; i < b->below[p]; ++i, ++later, below += LANES, across += LANES) {
                own[*later] = larger(own[*later], largest_size(of_rows ? below : across, LANES) * given[p]);
                own[p] = larger(own[p], largest_size(of_rows ? across : below, LANES) * given[*later]);
            }
        for (int i = 0; i < m; ++i) own[i] = own[i] > 0.0 ? 1.0 / own[i] : 1.0;
    }
}

/* The same of a sparse block: right (m, k, LANES), the entries of the block, and as much room as a dense one needs. If a pivot
 * does not hold in some stage, all eight are solved as a dense block, and 0 is returned. */
static OUTSIDE int solve_sparse_block(const block_pattern *b, double *right, int k) {
    const int m = b->size, row = (m + k + 1) * LANES;
    double *const entries = right + m * k * LANES, *const kept = entries + entries_of(b) * LANES;
    double *const square = kept + entries_of(b) * LANES, *const unit = square;
    copy(kept, entries, entries_of(b) * LANES);
    find_block_units(b, entries, unit, unit + m);
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
static int eliminate_chunk(const rumo_elimination *order, const block_pattern *patterns, const double *restrict terms,
                           int lanes, double *restrict work, double *restrict result) {
    const int *load = order->load, *update = order->update, *store = order->store;
    block_order o = {0, 0, order->below, order->across, order->lower, order->upper};
    int exchanged = 0;
    for (int b = 0; b < order->blocks; ++b) {
        o.m = order->size[b];
        o.k = order->width[b];
        const int sparsely = RUMO_SPARSE && order->sparse[b];
        const int places = sparsely ? o.m * o.k + entries_of(patterns + b) : o.m * (o.m + o.k + 1);
        load_block(order, b, load, update, terms, result, lanes, places, work);
        if (sparsely) {
            exchanged += !solve_sparse_block(patterns + b, work, o.k);
        } else if (!solve_in_order(&o, work)) {
            load_block(order, b, load, update, terms, result, lanes, places, work);
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
    }
    return exchanged;
}

/* terms (slots, lanes) to result (entries, lanes): `lack` (lanes,) is more than 0 or NaN where a pivot was too small, or the
 * result is not finite. 0 if nothing was done. A tailored build has it as C code, if there is not too much of it. */
#ifndef RUMO_TAILORED
#define eliminate_in_order(patience, terms, result, lack) 0
#endif

/* terms (slots, lanes) to result (entries, lanes); 0 where that is not finite, or if the clock comes to `end`. */
static int eliminate(const rumo_elimination *order, const block_pattern *patterns, const double *restrict terms, int lanes,
                     double *restrict lack, double *restrict work, double *restrict result, double end) {
    const int tried = eliminate_in_order(PATIENCE, terms, result, lack);
    int complete = tried;
    for (int first = 0; first < lanes; first += LANES) {
        int fine = tried;
        for (int k = first; fine && k < first + LANES; ++k) fine = lack[k] == 0.0;
        if (fine) continue;
        if (is_over(end)) return 0;
        complete = 0;
        eliminate_chunk(order, patterns, terms + first, lanes, work, result + first);
    }
    return complete || all_finite(result, order->entries * lanes);
}

#endif
