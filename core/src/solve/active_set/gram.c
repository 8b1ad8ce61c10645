/* The factors of the members' Gram matrix.
 *
 * With U'U = H and m = U'^-1 a for each row a of the working set, the minimiser over the set is w = U v with
 * w = -U'^-1 (g + sum of l1 a over saturated rows) - M' mu, where M w - E mu = targets, and E is the compliance of
 * rows that give way. M M' + E = L D L'.
 *
 * Source: Arnstroem, Bemporad and Axehill (2022) for L D L' in place of the Q R of Goldfarb and Idnani (1983).
 */
#ifndef RUMO_GRAM_C
#define RUMO_GRAM_C

#include "solve/active_set/rows.c"

/* Pivots are squares of sines of angles between rows. Below the first share of 1 they are computed with care, below
 * the second, rows depend on each other. */
#define SMALL_PIVOT 1e-6
#define NO_PIVOT 1e-14
/* The second, where L is not kept and pivots come from differences. */
#define NO_SHARE 1e-10

/* Factor the rows before a position where L is not kept; returns the least pivot as a share of 1, and whose it is. */
static double condition_members(qp *q, int members, int *weakest) {
    q->stale = 0;
    return q->space->condition(q, members, weakest);
}

/* Solve L x = x for the rows before a position, where x begins with some zeros. What earlier blocks contribute need not
 * wait for rows of the same. */
static void solve_lower(const qp *q, int zeros, int count, double *restrict x) {
    for (int first = zeros / LANES * LANES; first < count; first += LANES) {
        const int end = first + LANES < count ? first + LANES : count;
        for (int i = first; first && i < end; ++i) x[i] -= dot(q->L + (ptrdiff_t)i * q->stride, x, first);
        for (int i = first + 1; i < end; ++i) {
            const double *restrict row = q->L + (ptrdiff_t)i * q->stride;
            double s = x[i];
            for (int j = first; j < i; ++j) s -= row[j] * x[j];
            x[i] = s;
        }
    }
}

/* Solve L' x = x for the rows before a position. */
static void solve_upper(const qp *q, int count, double *restrict x) {
    for (int i = count; i < padded(count); ++i) x[i] = 0.0;
    for (int first = padded(count) - LANES; first >= 0; first -= LANES) {
        const double *restrict rows = q->L + (ptrdiff_t)first * q->stride;
        const int end = count - first < LANES ? count - first : LANES;
        for (int i = end - 1; i > 0; --i) axpy(x + first, -x[first + i], rows + i * q->stride + first, LANES);
        for (int j = 0; j < first; j += LANES) {
            double s[LANES];
            copy(s, x + j, LANES);
            for (int i = 0; i < end; ++i)
                for (int l = 0; l < LANES; ++l) s[l] -= x[first + i] * rows[i * q->stride + j + l];
            copy(x + j, s, LANES);
        }
    }
}

/* Solve L D L' x = x for the rows before a position. */
static void solve_members(qp *q, int zeros, int count, double *restrict x) {
    if (!q->kept) {
        int weakest;
        if (q->stale) (void)condition_members(q, count, &weakest);
        q->space->solve(q, count, x);
        return;
    }
    solve_lower(q, zeros, count, x);
    for (int i = zeros; i < count; ++i) x[i] /= q->D[i];
    solve_upper(q, count, x);
}

/* y -= M' x for the rows before a position. */
static void subtract_members(qp *q, const double *restrict x, int members, double *restrict y) {
    if (!q->kept) {
        q->space->combine(q, x, members, q->sum);
        axpy(y, -1.0, q->sum, q->ld);
        return;
    }
    for (int i = 0; i < members; ++i) axpy(y, -x[i], moved(q, i), extent_of(q, i));
}

/* M w for the rows before a position. */
static void project_on_members(qp *q, const double *restrict w, int members, double *restrict components) {
    if (!q->kept) {
        q->space->project(q, w, members, components);
        return;
    }
    for (int i = 0; i < members; ++i) components[i] = dot(moved(q, i), w, extent_of(q, i));
}

/* m of the row at a position. */
static const double *row_over_w(qp *q, int position) {
    if (q->kept) return moved(q, position);
    zero(q->parts, position);
    q->parts[position] = 1.0;
    q->space->combine(q, q->parts, position + 1, q->moved);
    return q->moved;
}

/* The pivot of a row as the square of what the rows before leave of it: a difference of squares loses half of the
 * digits. The combination of those rows that is nearest to it is left in `trial`. */
RARE static double careful_pivot(qp *q, int position) {
    double *restrict r = q->trial, *restrict error = q->direction, *restrict rest = q->shift;
    const double *restrict m = row_over_w(q, position);
    if (q->kept) {
        copy(r, q->L + (ptrdiff_t)position * q->stride, padded(position));
        solve_upper(q, position, r);
    } else {
        project_on_members(q, m, position, r);
        solve_members(q, 0, position, r);
    }
    copy(rest, m, q->ld);
    subtract_members(q, r, position, rest);
    project_on_members(q, rest, position, error);
    for (int i = 0; i < position; ++i) error[i] -= compliance(q, q->member[i]) * r[i];
    solve_members(q, 0, position, error);
    for (int i = 0; i < position; ++i) r[i] += error[i];
    copy(rest, m, q->ld);
    subtract_members(q, r, position, rest);
    double pivot = dot(rest, rest, q->ld) + compliance(q, q->member[position]);
    for (int i = 0; i < position; ++i) pivot += compliance(q, q->member[i]) * r[i] * r[i];
    return pivot;
}

/* The same where L is not kept. */
RARELY static int extend_conditioned(qp *q, int position) {
    const double whole = q->square[q->member[position]] + compliance(q, q->member[position]);
    const int full = position == q->capacity - 1;
    int weakest;
    if (!full && condition_members(q, position + 1, &weakest) > SMALL_PIVOT) return 1;
    (void)condition_members(q, position, &weakest);
    q->D[position] = careful_pivot(q, position);
    q->delicate = 1;
    if (full || !(q->D[position] > NO_SHARE * whole)) return 0;
    (void)condition_members(q, position + 1, &weakest);
    return 1;
}

/* Extend L D L' by the row at a position, from those before; 0 if it depends on them, see careful_pivot. */
static int extend(qp *q, int position) {
    if (!q->kept) return extend_conditioned(q, position);
    const double *restrict m = moved(q, position);
    const int extent = extent_of(q, position);
    double *restrict ell = q->L + (ptrdiff_t)position * q->stride;
    for (int i = 0; i < position; ++i) ell[i] = dot(moved(q, i), m, extent);
    for (int i = position; i < padded(position); ++i) ell[i] = 0.0;
    solve_lower(q, 0, position, ell);
    const int row = q->member[position];
    q->square[row] = dot(m, m, extent);
    const double whole = q->square[row] + compliance(q, row);
    double pivot = whole;
    for (int i = 0; i < position; ++i) {
        const double y = ell[i];
        ell[i] = y / q->D[i];
        pivot -= y * ell[i];
    }
    const int full = position == q->capacity - 1;
    if (full || !(pivot > SMALL_PIVOT * whole)) {
        pivot = careful_pivot(q, position);
        q->delicate = 1;
    }
    q->D[position] = pivot;
    return pivot > NO_PIVOT * whole && !full;
}

#endif
