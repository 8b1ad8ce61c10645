/* The rows that are taken to hold: how they join, leave, and are taken over from one program to the next. */
#ifndef RUMO_WORKING_SET_C
#define RUMO_WORKING_SET_C

#include "solve/active_set/gram.c"

/* w -= M' x for the rows before a position. */
static void move_w(qp *q, const double *restrict x, int members) {
    subtract_members(q, x, members, q->w);
    q->evaluated = 0;
}

/* Values at w, if they are not those already. */
static void evaluate_at_w(qp *q) {
    if (!q->evaluated) q->space->evaluate(q);
    q->evaluated = 1;
}

/* w of the minimum without members. */
static void start_at_minimum(qp *q) {
    q->space->start(q);
    q->evaluated = 0;
}

/* Put a row behind the working set, where it waits to join, unless no variable moves it. */
static void stage_row(qp *q, int row, row_state state, double mu) {
    if (q->count == q->room) q->kept = 0;
    q->stale = 1;
    q->member[q->count] = row;
    q->mu[q->count] = mu;
    q->norm[row] = 1.0 / q->weight[row];
    q->pending = q->space->transform(q, q->count);
    if (!q->kept) q->square[row] = dot(moved(q, q->count), moved(q, q->count), q->ld);
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
    for (int i = position + 1; q->kept && i < q->count; ++i) w[i] = q->L[(ptrdiff_t)i * q->stride + position];
    move_back(q, position, q->count - 1 + q->pending);
    if (!q->kept) {
        --q->count;
        q->stale = 1;
        return;
    }
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

/* The multiplier of a member becomes that, and the minimiser moves with it. */
static void release(qp *q, int position, double multiplier) {
    const double change = q->mu[position] - multiplier;
    /* What rounding has left needs no sweep. */
    if (fabs(change) > (q->kept ? 0.0 : 1e-14 * fabs(q->mu[position]))) {
        axpy(q->w, change, row_over_w(q, position), q->ld);
        q->evaluated = 0;
    }
    q->mu[position] = multiplier;
}

/* The first row from a position on that depends on those before (on others, where L is not kept), or -1; the factors are then
 * those of the rows before it. */
static int next_dependent(qp *q, int position) {
    if (!q->kept) {
        int weakest;
        return condition_members(q, q->count, &weakest) > NO_SHARE ? -1 : weakest;
    }
    for (; position < q->count; ++position) {
        if (is_over(q->end)) return -1; /* no one will ask for the factors */
        if (!extend(q, position)) return position;
    }
    return -1;
}

/* Factor the rows from a position on again. One that now depends on the others waits to join; if another waits
 * already, it is let go, and will be found again. */
static void refactor(qp *q, int position) {
    if (position == 0) q->delicate = 0;
    for (int i = position; (i = next_dependent(q, i)) >= 0;) {
        move_back(q, i, q->count - 1 + q->pending);
        --q->count;
        q->settled = 0;
        if (q->pending) {
            const int last = q->count + 1;
            release(q, last, 0.0);
            watch(q, q->member[last], INACTIVE);
        }
        q->pending = 1;
    }
}

/* Keep m and L from an empty working set on. */
static void keep_members(qp *q) {
    for (int i = 0; i < q->capacity; ++i) q->place[i] = i;
    q->kept = 1;
}

/* Start from an empty working set. */
static void clear_members(qp *q) {
    keep_members(q);
    for (int r = 0; r < q->rows; ++r) q->state[r] = INACTIVE;
    q->count = q->pending = q->saturated = q->settled = q->delicate = 0;
}

/* A row joins without being asked whether it depends on others. */
static void add_member(qp *q, int row, row_state state, double mu) {
    q->member[q->count] = row;
    q->mu[q->count++] = mu;
    q->norm[row] = 1.0 / q->weight[row];
    watch(q, row, state);
}

/* A row joins, where m and L are kept, unless it depends on others. */
static void take_over(qp *q, int row, row_state state, double mu) {
    stage_row(q, row, state, mu);
    if (q->pending && extend(q, q->count)) ++q->count;
    else if (q->pending) q->state[row] = INACTIVE;
    q->pending = 0;
}

/* Factor what is not kept, without rows that depend on others. */
static void drop_dependent(qp *q) {
    for (int i; !is_over(q->end) && (i = next_dependent(q, 0)) >= 0;) {
        release(q, i, 0.0);
        watch(q, q->member[i], INACTIVE);
        drop(q, i);
    }
}

/* Take the working set over to other rows, where `becomes` says what a row is there, -1 for nothing and never more than it
 * was, as far as they are independent, and as far as there is time. Limits may still change: see watch_members. */
static void renew_members(qp *q, int (*becomes)(const qp *, int row)) {
    const int members = q->count;
    int *restrict row = q->conflict, *restrict state = q->scratch;
    for (int i = 0; i < members; ++i) {
        row[i] = q->member[i];
        state[i] = q->state[row[i]];
        q->spare[i] = q->mu[i];
    }
    if (!q->kept && members <= q->room / 2) keep_members(q);
    q->saturated = 0;
    for (int r = 0; r < q->rows; ++r) {
        const int moved_to = q->state[r] == SATURATED ? becomes(q, r) : -1;
        q->state[r] = INACTIVE;
        if (moved_to < 0) continue;
        q->state[moved_to] = SATURATED;
        ++q->saturated;
    }
    q->count = q->pending = q->settled = q->delicate = 0;
    for (int i = 0; i < members && !is_over(q->end); ++i) {
        const int moved_to = becomes(q, row[i]);
        if (moved_to < 0) continue;
        if (q->kept) {
            take_over(q, moved_to, (row_state)state[i], q->spare[i]);
        } else {
            add_member(q, moved_to, (row_state)state[i], q->spare[i]);
        }
    }
    if (!q->kept) drop_dependent(q);
}

/* Let the watch on all rows agree with their limits and states; members that have lost their limit leave. */
static void watch_members(qp *q) {
    copy(q->floor, q->lower, q->rows);
    copy(q->ceiling, q->upper, q->rows);
    for (int i = q->count - 1; i >= 0; --i) {
        const int row = q->member[i], limited = isfinite(q->state[row] == AT_LOWER ? q->lower[row] : q->upper[row]);
        watch(q, row, limited ? (row_state)q->state[row] : INACTIVE);
        if (!limited) drop(q, i);
    }
    for (int r = q->first_soft, left = q->saturated; left > 0 && r < q->rows; ++r)
        if (q->state[r] == SATURATED) {
            watch(q, r, isfinite(q->upper[r]) ? SATURATED : INACTIVE);
            --left;
        }
}

#endif
