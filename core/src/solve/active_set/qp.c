/* Strictly convex quadratic programs by a dual active-set method, with soft rows and warm starts.
 *
 * All multipliers stay within the ranges of their rows' states, and the minimiser over the working set moves with
 * them: to the minimum over the set unless a multiplier reaches the end of its range, whose row then changes its state
 * or leaves; and once there, the row that is farthest beyond its limits joins.
 *
 * Source: Goldfarb and Idnani (1983).
 */
#ifndef RUMO_QP_C
#define RUMO_QP_C

#include "base/clock.h"
#include "solve/active_set/refinement.c"
#include "solve/stage_solver.h"

/* A violation below this (in units of v) may come from rounding: the minimiser is refined before it is believed. */
#define DOUBTFUL 1e-6
/* Rows that cannot hold together within this distance from the origin are infeasible. */
#define REMOTE 1e6
/* After so many iterations L D L' is computed anew, and whether the multipliers prove infeasibility. */
#define MANY_UPDATES 50

/* The row that is farthest beyond its limits (the first such row if `first`) and how far, or -1. */
static int most_violated(const qp *q, int first, double *violated_by) {
    double worst = q->tolerance;
    int found = -1;
    for (int i = 0; i < q->rows; i += LANES) {
        double violation[LANES], largest = 0.0;
        for (int l = 0; l < LANES; ++l) {
            const double below = q->floor[i + l] - q->value[i + l], above = q->value[i + l] - q->ceiling[i + l];
            violation[l] = (below > above ? below : above) * q->weight[i + l];
        }
        for (int l = 0; l < LANES; ++l) largest = violation[l] > largest ? violation[l] : largest;
        if (!(largest > worst)) continue;
        for (int l = 0; l < LANES && !(first && found >= 0); ++l)
            if (violation[l] > worst) {
                worst = violation[l];
                found = i + l;
            }
        if (first) break;
    }
    *violated_by = worst;
    return found;
}

/* A distance in units of v that no one notices. */
#define UNNOTICED 1e-10

/* A step of the multipliers along a direction, and the member that stops it (-1: none). */
typedef struct dual_step {
    double length;
    int blocking, at_l1;
} dual_step;

static dual_step longest_step(const qp *q, const double *direction, double sign, int members, double length,
                              int first) {
    dual_step step = {length, -1, 0};
    double largest = 0.0, fastest = 0.0, greatest = 0.0;
    /* Multipliers compare as those of rows of norm 1. */
    for (int i = 0; i < members; ++i) {
        fastest = larger(fastest, fabs(direction[i]) * q->norm[q->member[i]]);
        greatest = larger(greatest, fabs(q->mu[i]) * q->norm[q->member[i]]);
    }
    for (int i = 0; i < members; ++i) {
        const int row = q->member[i];
        const double p = sign * direction[i], size = fabs(p) * q->norm[row], l1 = q->l1[row];
        const row_state state = (row_state)q->state[row];
        if (!(size > 1e-13 * fastest)) continue;
        double limit;
        int at_l1 = 0;
        if (state == AT_LOWER) {
            if (p < 0.0) continue;
            limit = 0.0;
        } else if (state == AT_UPPER) {
            at_l1 = p > 0.0;
            limit = at_l1 ? l1 : 0.0;
            if (isinf(limit)) continue;
        } else { /* GIVING */
            if (p > 0.0) continue;
            limit = l1;
            at_l1 = 1;
        }
        double reached = (limit - q->mu[i]) / p;
        if (reached < 0.0) reached = 0.0;
        /* Beyond its end, but by rounding; of a multiplier next to much larger ones, one that no one would notice. */
        const double beyond = (length - reached) * size;
        const int own = beyond <= 1e-13 * larger(fabs(q->mu[i]), fabs(limit)) * q->norm[row];
        if (beyond <= 1e-13 * greatest && (own || pull(q, i, (length - reached) * p) < UNNOTICED)) continue;
        if (!(reached < length) || reached > step.length) continue;
        /* Among ties, the largest entry is the safest to take out. */
        const int tie = step.blocking >= 0 && reached == step.length;
        const int better = tie && (first ? row < q->member[step.blocking] : size > largest);
        if (reached < step.length || better) {
            step = (dual_step){reached, i, at_l1};
            largest = size;
        }
    }
    return step;
}

/* Change multipliers, and the minimiser with them. */
static void move_multipliers(qp *q, const double *restrict direction, int members, double length) {
    double *restrict change = q->parts;
    for (int i = 0; i < members; ++i) {
        change[i] = length * direction[i];
        q->mu[i] += change[i];
    }
    move_w(q, change, members);
}

/* Change the state of a member whose multiplier has reached the end of its range. */
static void leave(qp *q, int position, int at_l1) {
    const int row = q->member[position], waiting = q->pending && position == q->count;
    const row_state state = (row_state)q->state[row];
    const double limit = at_l1 ? q->l1[row] : 0.0;
    release(q, position, limit);
    if (!at_l1 || (state == GIVING && limit == 0.0)) {
        watch(q, row, INACTIVE);
    } else if (state == AT_UPPER && q->l2[row] == 0.0) {
        watch(q, row, SATURATED);
    } else {
        watch(q, row, state == GIVING ? AT_UPPER : GIVING);
        if (!waiting) refactor(q, position);
        return;
    }
    if (waiting) q->pending = 0;
    else drop(q, position);
}

/* Derivative of the dual function with respect to a member's multiplier. */
static inline double dual_slope(const qp *q, int position) {
    return deviation(q, position, member_value(q, position));
}

/* Minimise over the working set by moving the multipliers; 1 once there, 0 if one of them stopped it. */
static int follow_members(qp *q, int first, double *gain) {
    double *restrict slope = q->trial, *restrict direction = q->direction;
    const int settled = q->delicate || !q->kept ? 0 : q->settled;
    if (!q->kept) evaluate_at_w(q);
    zero(direction, settled);
    for (int i = settled; i < q->count; ++i) slope[i] = direction[i] = dual_slope(q, i);
    solve_members(q, settled, q->count, direction);
    const dual_step step = longest_step(q, direction, 1.0, q->count, 1.0, first);
    double rise = 0.0;
    for (int i = settled; i < q->count; ++i) rise += slope[i] * direction[i];
    *gain = step.length * (1.0 - 0.5 * step.length) * rise;
    move_multipliers(q, direction, q->count, step.length);
    if (step.blocking < 0) {
        q->settled = q->count;
        return 1;
    }
    leave(q, step.blocking, step.at_l1);
    return 0;
}

/* Whether the hard rows among members cannot hold together: their combination p, which has the signs of multipliers, is
 * next to zero, and that of their limits is not. They are noted. */
RARE static int contradict(qp *q, const double *restrict p) {
    double *restrict parts = q->spare;
    double size = 0.0, violation, room = 0.0, limit = 0.0;
    q->conflicts = 0;
    const int members = q->count + q->pending;
    for (int i = 0; i < members; ++i) size = larger(size, fabs(p[i]) * q->norm[q->member[i]]);
    for (int i = 0; i < members; ++i) {
        const int row = q->member[i], lower = q->state[row] == AT_LOWER;
        const double part = fabs(p[i]) * q->norm[row];
        const int matters = part > 1e-9 * size && (lower || isinf(q->l1[row]));
        parts[i] = matters ? p[i] : 0.0;
        if (!matters) continue;
        q->conflict[q->conflicts++] = row;
        limit += p[i] * (lower ? q->lower[row] : q->upper[row]);
        room += q->tolerance * part;
    }
    room += REMOTE * q->space->size_of(q, parts, members, &violation);
    violation -= limit;
    if (violation > room) return 1;
    q->conflicts = 0;
    return 0;
}

/* The waiting row depends on the members, as careful_pivot has found: move the multipliers along the ray that leaves
 * stationarity as it is, until one of them stops it. 0 if none does: then the rows of the ray cannot hold together. */
static int follow_ray(qp *q, int first, double *gain) {
    double *restrict p = q->trial;
    const int members = q->count + 1;
    for (int i = 0; i < q->count; ++i) p[i] = -p[i];
    p[q->count] = 1.0;
    double slope = 0.0, size = 0.0;
    if (!q->kept) evaluate_at_w(q);
    for (int i = 0; i < members; ++i) {
        slope += p[i] * dual_slope(q, i);
        size = larger(size, fabs(p[i]) * q->norm[q->member[i]]);
    }
    double sign = slope < 0.0 ? -1.0 : 1.0;
    dual_step step = longest_step(q, p, sign, members, INFINITY, first);
    const int neutral = fabs(slope) <= q->tolerance * size;
    if (neutral) {
        /* Rounding chose the sign: the rows hold together, and one of them can leave, on the other side if nothing
         * would come of it here. */
        const dual_step back = longest_step(q, p, -sign, members, INFINITY, first);
        const int idle = step.length == 0.0 && (step.at_l1 || step.blocking == q->count);
        const int idle_back = back.length == 0.0 && (back.at_l1 || back.blocking == q->count);
        if (back.blocking >= 0 && (idle || (back.length < step.length && !idle_back))) {
            step = back;
            sign = -sign;
        }
    }
    for (int i = 0; i < members; ++i) p[i] *= sign;
    *gain = 0.0;
    /* A row that is only almost dependent may find its own minimum before anything stops it, and joins. */
    const int full = q->count == q->capacity - 1;
    const int joins = !full && !neutral && step.length * q->D[q->count] > fabs(slope);
    if (step.blocking >= 0 && !joins) {
        *gain = step.length * sign * slope;
        move_multipliers(q, p, members, step.length);
        leave(q, step.blocking, step.at_l1);
        return 1;
    }
    if (contradict(q, p) || full) return 0;
    q->D[q->count] = larger(q->D[q->count], 1e-300);
    ++q->count;
    q->stale = 1;
    q->pending = 0;
    return 1;
}

/* Let a violated row join: from zero, or from l1 if it was saturated. */
static void enter(qp *q, int row) {
    const double l1 = q->l1[row];
    if (q->state[row] == SATURATED) stage_row(q, row, AT_UPPER, l1);
    else if (q->value[row] > q->upper[row]) stage_row(q, row, l1 == 0.0 ? GIVING : AT_UPPER, 0.0);
    else stage_row(q, row, AT_LOWER, 0.0);
}

/* w for the multipliers that were kept. If those of a wild program lead far off, there is no way back: start afresh. A row that
 * waits to join since the budget of a solution ran out has waited for another program. */
static void start_warm(qp *q) {
    if (q->pending) watch(q, q->member[q->count], INACTIVE);
    q->pending = 0;
    start_at_minimum(q);
    if (!q->count) return;
    const double expected = dot(q->w, q->w, q->ld) + q->span;
    move_w(q, q->mu, q->count);
    if (dot(q->w, q->w, q->ld) <= REMOTE * REMOTE * expected) return;
    clear_members(q);
    watch_members(q);
    start_at_minimum(q);
}

/* What keeps the minimiser over the working set from being the solution: a row beyond its limits, or a member whose
 * multiplier is out of its range; -1 for none. */
typedef struct obstacle {
    int row, member, at_l1;
} obstacle;

static obstacle find_obstacle(qp *q, int first) {
    obstacle found = {-1, -1, 0};
    double worst;
    found.row = most_violated(q, first, &worst);
    if (worst >= DOUBTFUL) return found;
    polish(q);
    found.row = most_violated(q, first, &worst);
    if (found.row < 0) found.member = astray(q, &found.at_l1);
    return found;
}

static void mend(qp *q, const obstacle *found) {
    if (found->row >= 0) enter(q, found->row);
    if (found->member < 0) return;
    q->settled = 0;
    leave(q, found->member, found->at_l1);
}

/* No solution, as the rows noted prove; without any, rounding has taken over. Multipliers that have gone far off are no start
 * for another. */
RARE static rumo_status give_up(qp *q) {
    clear_members(q);
    return q->conflicts ? RUMO_SOLVER_FAILED : RUMO_ILL_CONDITIONED;
}

/* Nothing is left to change. */
static rumo_status conclude_qp(qp *q) {
    if (!all_finite(q->value, q->rows)) return give_up(q);
    if (is_trusted(q)) return RUMO_OPTIMAL;
    return is_over(q->end) ? RUMO_BUDGET_EXCEEDED : RUMO_ILL_CONDITIONED; /* refinement may have lacked time */
}

/* Solve from the present working set, whose multipliers are within their ranges. The minimiser is in q->w, and evaluated;
 * where the budget ends early, it is the one of the last working set. */
static rumo_status solve_qp(qp *q, const budget *limits) {
    int stalled = 0, fresh = 0;
    double gained = 0.0;
    q->tolerance = limits->tolerance;
    q->end = limits->end;
    q->iterations = q->conflicts = 0;
    start_warm(q);
    for (;;) {
        const int first = stalled > 2 * q->count + 20; /* lowest index first: no cycles */
        double gain = 0.0;
        obstacle found = {-1, -1, 0};
        if (is_over(q->end)) break;
        if (q->pending) {
            if (extend(q, q->count)) {
                ++q->count;
                q->pending = 0;
                continue;
            }
            if (!follow_ray(q, first, &gain)) return give_up(q);
        } else if (follow_members(q, first, &gain) && (!q->delicate || follow_members(q, first, &gain))) {
            evaluate_at_w(q);
            if (!all_finite(q->value, q->rows)) return give_up(q);
            found = find_obstacle(q, first);
            if (q->kkt_residual > FINE && !fresh) { /* updates of L D L' have cost too many digits */
                refactor(q, 0);
                fresh = 1;
                continue;
            }
            if (found.row < 0 && found.member < 0) return conclude_qp(q);
        }
        if (q->iterations >= limits->iterations) break;
        ++q->iterations;
        mend(q, &found);
        fresh = 0;
        q->kkt_residual = 0.0;
        if (q->iterations % MANY_UPDATES == 0) {
            if (contradict(q, q->mu)) return give_up(q);
            refactor(q, 0);
        }
        stalled = gain > 1e-14 * gained ? 0 : stalled + 1;
        gained += gain;
    }
    evaluate_at_w(q);
    return RUMO_BUDGET_EXCEEDED;
}

#endif
