/* The rows that are taken to hold, and the factors of their Gram matrix.
 *
 * With U'U = H and m = U'^-1 a for each row a of the working set, the minimiser over the set is w = U v with
 * w = -U'^-1 (g + sum of l1 a over saturated rows) - M' mu, where M w - E mu = targets, and E is the compliance of
 * rows that give way. M M' + E = L D L'.
 *
 * Source: Arnstroem, Bemporad and Axehill (2022) for L D L' in place of the Q R of Goldfarb and Idnani (1983).
 */
#ifndef RUMO_WORKING_SET_C
#define RUMO_WORKING_SET_C

#include "solve/active_set/rows.c"

/* Pivots are squares of sines of angles between rows. Below the first share of 1 they are computed with care, below
 * the second, rows depend on each other. */
#define SMALL_PIVOT 1e-6
#define NO_PIVOT 1e-14

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
static void solve_members(const qp *q, int zeros, int count, double *restrict x) {
    solve_lower(q, zeros, count, x);
    for (int i = zeros; i < count; ++i) x[i] /= q->D[i];
    solve_upper(q, count, x);
}

/* rest = m of the row at a position less the combination r of the rows before it. */
static void subtract_combination(const qp *q, int position, const double *restrict r, double *restrict rest) {
    copy(rest, moved(q, position), q->ld);
    for (int i = 0; i < position; ++i) axpy(rest, -r[i], moved(q, i), q->ld);
}

/* The pivot of a row as the square of what the rows before leave of it: a difference of squares loses half of the
 * digits. The combination of those rows that is nearest to it is left in `trial`. */
RARE static double careful_pivot(qp *q, int position) {
    double *restrict r = q->trial, *restrict error = q->direction, *restrict rest = q->shift;
    copy(r, q->L + (ptrdiff_t)position * q->stride, padded(position));
    solve_upper(q, position, r);
    subtract_combination(q, position, r, rest);
    for (int i = 0; i < position; ++i)
        error[i] = dot(moved(q, i), rest, q->ld) - compliance(q, q->member[i]) * r[i];
    solve_members(q, 0, position, error);
    for (int i = 0; i < position; ++i) r[i] += error[i];
    subtract_combination(q, position, r, rest);
    double pivot = dot(rest, rest, q->ld) + compliance(q, q->member[position]);
    for (int i = 0; i < position; ++i) pivot += compliance(q, q->member[i]) * r[i] * r[i];
    return pivot;
}

/* Extend L D L' by the row at a position, from those before; 0 if it depends on them, see careful_pivot. */
static int extend(qp *q, int position) {
    const double *restrict m = moved(q, position);
    double *restrict ell = q->L + (ptrdiff_t)position * q->stride;
    for (int i = 0; i < position; ++i) ell[i] = dot(moved(q, i), m, q->ld);
    for (int i = position; i < padded(position); ++i) ell[i] = 0.0;
    solve_lower(q, 0, position, ell);
    const double whole = dot(m, m, q->ld) + compliance(q, q->member[position]);
    double pivot = whole;
    q->whole[q->place[position]] = whole;
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

/* Put a row behind the working set, where it waits to join, unless no variable moves it. */
static void stage_row(qp *q, int row, row_state state, double mu) {
    q->member[q->count] = row;
    q->mu[q->count] = mu;
    q->norm[row] = 1.0 / q->weight[row];
    q->pending = q->space->transform(q, q->count);
    watch(q, row, q->pending ? state : IGNORED);
}

/* Move what is at a position behind all others, up to `last`. */
static void move_back(qp *q, int position, int last) {
    const int row = q->member[position], place = q->place[position];
    const double mu = q->mu[position];
    for (int i = position; i < last; ++i) {
        q->member[i] = q->member[i + 1];
        q->place[i] = q->place[i + 1];
        q->mu[i] = q->mu[i + 1];
    }
    q->member[last] = row;
    q->place[last] = place;
    q->mu[last] = mu;
}

/* Take the member at a position out, and update L D L' (rank one). */
static void drop(qp *q, int position) {
    double *restrict w = q->spare;
    double a = q->D[position];
    for (int i = position + 1; i < q->count; ++i) w[i] = q->L[(ptrdiff_t)i * q->stride + position];
    move_back(q, position, q->count - 1 + q->pending);
    for (int i = position + 1; i < q->count; ++i) {
        double *restrict from = q->L + (ptrdiff_t)i * q->stride, *restrict to = from - q->stride;
        for (int j = 0; j < position; ++j) to[j] = from[j];
        for (int j = position + 1; j < i; ++j) to[j - 1] = from[j];
    }
    for (int i = position + 1; i < q->count; ++i) {
        const double p = w[i], d = q->D[i], updated = d + a * p * p, beta = a * p / updated;
        a *= d / updated;
        q->D[i - 1] = updated;
        for (int k = i + 1; k < q->count; ++k) {
            double *entry = q->L + (ptrdiff_t)(k - 1) * q->stride + (i - 1);
            w[k] -= p * *entry;
            *entry += beta * w[k];
        }
    }
    --q->count;
    q->settled -= position < q->settled;
}

/* Factor the rows from a position on again. One that now depends on the others waits to join; if another waits
 * already, it is let go, and will be found again. */
static void refactor(qp *q, int position) {
    if (position == 0) q->delicate = 0;
    for (int i = position; i < q->count;) {
        if (extend(q, i)) {
            ++i;
            continue;
        }
        move_back(q, i, q->count - 1 + q->pending);
        --q->count;
        q->settled = 0;
        if (q->pending) {
            const int last = q->count + 1;
            axpy(q->w, q->mu[last], moved(q, last), q->ld);
            watch(q, q->member[last], INACTIVE);
        }
        q->pending = 1;
    }
}

/* Start from an empty working set. */
static void clear_members(qp *q) {
    for (int i = 0; i < q->capacity; ++i) q->place[i] = i;
    for (int r = 0; r < q->rows; ++r) q->state[r] = INACTIVE;
    q->count = q->pending = q->saturated = q->settled = q->delicate = 0;
}

/* Take the working set over to other rows, where `becomes` says what a row is there, -1 for nothing and never more than it
 * was, as far as they are independent. Limits may still change: see watch_members. */
static void renew_members(qp *q, int (*becomes)(const qp *, int row)) {
    const int members = q->count;
    int *restrict row = q->conflict, *restrict state = q->scratch;
    for (int i = 0; i < members; ++i) {
        row[i] = q->member[i];
        state[i] = q->state[row[i]];
        q->spare[i] = q->mu[i];
    }
    q->saturated = 0;
    for (int r = 0; r < q->rows; ++r) {
        const int moved_to = q->state[r] == SATURATED ? becomes(q, r) : -1;
        q->state[r] = INACTIVE;
        if (moved_to < 0) continue;
        q->state[moved_to] = SATURATED;
        ++q->saturated;
    }
    q->count = q->pending = q->settled = q->delicate = 0;
    for (int i = 0; i < members; ++i) {
        const int moved_to = becomes(q, row[i]);
        if (moved_to < 0) continue;
        stage_row(q, moved_to, (row_state)state[i], q->spare[i]);
        if (q->pending && extend(q, q->count)) ++q->count;
        else if (q->pending) q->state[moved_to] = INACTIVE;
        q->pending = 0;
    }
}

/* Let the watch on all rows agree with their limits and states. */
static void watch_members(qp *q) {
    copy(q->floor, q->lower, q->rows);
    copy(q->ceiling, q->upper, q->rows);
    for (int i = 0; i < q->count; ++i) watch(q, q->member[i], (row_state)q->state[q->member[i]]);
    for (int r = q->first_soft, left = q->saturated; left > 0 && r < q->rows; ++r)
        if (q->state[r] == SATURATED) {
            watch(q, r, SATURATED);
            --left;
        }
}

#endif
