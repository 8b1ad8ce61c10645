/* Inputs kept at a bound, and out of the recursion.
 *
 * In closed loop, inputs that stay at their bounds are differences of large numbers: where a plant runs away from many of them,
 * their rows' factor has no digits left. The recursion over the other inputs alone has. The minimum with some inputs kept is the
 * lower for each that is let go since its multiplier has the wrong sign, and no higher for others kept where they have come to
 * their bounds: this comes to an end.
 */
#ifndef RUMO_PINS_C
#define RUMO_PINS_C

#include "solve/riccati/prepare.c"

/* How often inputs may be kept and let go. */
#define PINNINGS 30
/* From a bound, in units of the range: at it. */
#define AT_BOUND 1e-6
/* Iterations, and so many for each row that may hold, after which rounding leads in circles, or is about to. */
#define ENOUGH 200
#define ENOUGH_EACH 8
/* A slope, relative to the largest force, that says on which side of its bound an input belongs. */
#define WRONG_SIDE 1e-13

/* Keep inputs that are at a bound, or beyond it; whether there are any more. */
RARE static int pin_inputs(riccati *r) {
    const dims *s = &r->s;
    const qp *q = &r->q;
    int more = 0;
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu && begins(s, &r->problem->blocking, k); ++j) {
            const int row = j * s->lanes + k;
            int *pin = r->pins + k * s->nu + j;
            if (*pin) continue;
            if (q->value[row] > q->upper[row] - AT_BOUND) *pin = AT_UPPER;
            else if (q->value[row] < q->lower[row] + AT_BOUND) *pin = AT_LOWER;
            more |= *pin;
        }
    return more;
}

/* Let go of inputs that lessen something if they leave their bounds, by its slopes over them, or what is `sign` times it; whether
 * there are any. */
RARE static int let_go(riccati *r, double sign, double least) {
    const dims *s = &r->s;
    int fewer = 0;
    for (int i = s->d * s->nu; i < s->N * s->nu; ++i) {
        const double slope = sign * r->pin_slopes[i], limit = least * r->largest_force[i % s->nu];
        if (r->pins[i] == AT_UPPER ? slope <= limit : r->pins[i] != AT_LOWER || slope >= -limit) continue;
        r->pins[i] = 0;
        fewer = 1;
    }
    return fewer;
}

/* Let go of inputs that can mend rows that contradict each other. */
RARE static int give_way(riccati *r) {
    qp *q = &r->q;
    int fewer = 0;
    for (int i = 0; i < q->conflicts; ++i) {
        const int row = q->conflict[i];
        zero(r->pin_slopes, r->s.N * r->s.nu);
        q->member[0] = row;
        riccati_transform(q, 0);
        fewer |= let_go(r, q->value[row] < q->lower[row] ? -1.0 : 1.0, 0.0);
    }
    return fewer;
}

/* What is kept becomes members of the working set again: each once, since one that has been kept last may be a member too, and
 * as many as there is room for. What depends on others is not needed. */
RARE static void unpin(riccati *r) {
    const dims *s = &r->s;
    qp *q = &r->q;
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu; ++j) {
            const int i = k * s->nu + j, row = j * s->lanes + k;
            const int member = q->state[row] == AT_LOWER || q->state[row] == AT_UPPER;
            if (!r->pins[i] || member || q->count == q->capacity - 1) continue;
            watch(q, row, (row_state)r->pins[i]);
            q->member[q->count] = row;
            q->mu[q->count++] = -r->pin_slopes[i];
        }
    r->pinned = r->shift = 0;
    factorise_stages(r);
    renew_members(q, riccati_becomes);
}

/* Solve with the working set as it is, but not in circles: then ILL_CONDITIONED. So many `iterations` of the budget are over,
 * which become more. */
static rumo_status try_solving(riccati *r, const budget *limits, int *iterations) {
    const int most = ENOUGH + ENOUGH_EACH * (r->q.capacity - 1), left = limits->iterations - *iterations;
    const budget own = {left < most ? left : most, limits->tolerance, limits->end};
    const rumo_status status = solve_qp(&r->q, &own);
    *iterations += r->q.iterations;
    const int led_in_circles = status == RUMO_BUDGET_EXCEEDED && r->q.iterations >= most && !is_over(limits->end);
    return led_in_circles ? RUMO_ILL_CONDITIONED : status;
}

/* Solve with what is kept at bounds, keep others, and let go, until all multipliers have the right sign; 0 if that fails.
 * So many `iterations` of the budget are over, which become more. */
RARE static int solve_pinned(riccati *r, const budget *limits, int *iterations) {
    qp *q = &r->q;
    int solved = 0;
    memset(r->pins, 0, (size_t)(r->s.N * r->s.nu) * sizeof *r->pins);
    if (!all_finite(q->value, q->rows)) zero(q->value, q->rows); /* the guess */
    int changed = pin_inputs(r);
    r->pinned = 1;
    for (int i = 0; i < PINNINGS && changed; ++i) {
        clear_members(q);
        watch_members(q);
        if (!factorise_stages(r)) break;
        const rumo_status status = try_solving(r, limits, iterations);
        if (status == RUMO_BUDGET_EXCEEDED) break;
        if (status == RUMO_ILL_CONDITIONED) changed = pin_inputs(r);
        if (status == RUMO_SOLVER_FAILED) changed = give_way(r);
        if (status != RUMO_OPTIMAL) continue;
        q->space->slope(q, q->shift);
        pin_inputs(r);
        solved = !let_go(r, 1.0, WRONG_SIDE);
        if (solved) break;
    }
    q->conflicts = 0; /* with inputs kept */
    if (!solved) {
        clear_members(q);
        memset(r->pins, 0, (size_t)(r->s.N * r->s.nu) * sizeof *r->pins);
    }
    unpin(r);
    return solved;
}

/* Where the working set has led in circles, or to no solution that can be trusted: with inputs kept at bounds; and if that
 * fails, afresh, for as long as the budget lasts, since what seems to be a circle may only be long. */
RARE static rumo_status solve_otherwise(riccati *r, const budget *limits, int *iterations) {
    if (solve_pinned(r, limits, iterations)) return RUMO_OPTIMAL;
    const budget left = {limits->iterations - *iterations, limits->tolerance, limits->end};
    if (left.iterations <= 0 || is_over(left.end)) return RUMO_BUDGET_EXCEEDED;
    watch_members(&r->q);
    const rumo_status status = solve_qp(&r->q, &left);
    *iterations += r->q.iterations;
    return status;
}

#endif
