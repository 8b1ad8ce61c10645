/* Dense strictly convex quadratic programs by a dual active-set method, with soft rows and warm starts.
 *
 * All multipliers stay within the ranges of their rows' states, and the minimiser over the working set moves with
 * them: to the minimum over the set unless a multiplier reaches the end of its range, whose row then changes its state
 * or leaves; and once there, the row that is farthest beyond its limits joins.
 *
 * Source: Goldfarb and Idnani (1983).
 */

/* A violation below this (in units of v) may come from rounding: the minimiser is refined before it is believed. */
#define DOUBTFUL 1e-6
/* Rows that cannot hold together within this distance from the origin are infeasible. */
#define REMOTE 1e6

typedef struct qp_limits {
    int iterations;
    double tolerance, seconds;
} qp_limits;

/* Values of all rows at v. */
static void update_values(qp *q) {
    const double *restrict v = q->v;
    double *restrict value = q->value;
    copy(value, v, q->n);
    if (q->band) {
        for (int j = 0; j < q->band; ++j) value[q->n + j] = v[j];
        for (int j = q->band; j < q->n; ++j) value[q->n + j] = v[j] - v[j - q->band];
    }
    for (int r = q->dense; r < q->rows; ++r)
        value[r] = dot(q->matrix + (ptrdiff_t)(r - q->dense) * q->ld, v, q->extent[r - q->dense]);
}

static void update_solution(qp *q) {
    zero(q->v, q->ld);
    add_solution(q, q->w, q->v);
    update_values(q);
}

/* The row that is farthest beyond its limits (the first such row if `first`) and how far, or -1. */
static int most_violated(const qp *q, double tolerance, int first, double *violated_by) {
    double worst = tolerance;
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

/* A step of the multipliers along a direction, and the member that stops it (-1: none). */
typedef struct dual_step {
    double length;
    int blocking, at_l1;
} dual_step;

static dual_step longest_step(const qp *q, const double *direction, double sign, int members, double length, int first) {
    dual_step step = {length, -1, 0};
    double largest = 0.0, scale = 0.0;
    /* Multipliers compare as those of rows of norm 1. */
    for (int i = 0; i < members; ++i) scale = fmax(scale, fabs(direction[i]) / q->weight[q->member[i]]);
    for (int i = 0; i < members; ++i) {
        const int row = q->member[i];
        const double p = sign * direction[i], size = fabs(p) / q->weight[row], l1 = q->l1[row];
        const row_state state = (row_state)q->state[row];
        if (!(size > 1e-13 * scale)) continue;
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
    for (int i = 0; i < members; ++i) {
        q->mu[i] += length * direction[i];
        axpy(q->w, -length * direction[i], moved(q, i), q->ld);
    }
}

/* Change the state of a member whose multiplier has reached the end of its range. */
static void leave(qp *q, int position, int at_l1) {
    const int row = q->member[position], waiting = q->pending && position == q->count;
    const row_state state = (row_state)q->state[row];
    const double limit = at_l1 ? q->l1[row] : 0.0;
    axpy(q->w, q->mu[position] - limit, moved(q, position), q->ld);
    q->mu[position] = limit;
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
    return deviation(q, position, dot(moved(q, position), q->w, q->ld));
}

/* Minimise over the working set by moving the multipliers; 1 once there, 0 if one of them stopped it. */
static int follow_members(qp *q, int first, double *gain) {
    double *restrict slope = q->trial, *restrict direction = q->direction;
    for (int i = 0; i < q->count; ++i) slope[i] = direction[i] = dual_slope(q, i);
    solve_members(q, q->count, direction);
    const dual_step step = longest_step(q, direction, 1.0, q->count, 1.0, first);
    double rise = 0.0;
    for (int i = 0; i < q->count; ++i) rise += slope[i] * direction[i];
    *gain = step.length * (1.0 - 0.5 * step.length) * rise;
    move_multipliers(q, direction, q->count, step.length);
    if (step.blocking < 0) return 1;
    leave(q, step.blocking, step.at_l1);
    return 0;
}

/* Whether rows cannot hold together: a combination p of them is next to zero, that of their limits is not. */
RARE static int contradict(const qp *q, const double *restrict p, double slope, double tolerance) {
    double *restrict sum = q->shift;
    double room = 0.0;
    zero(sum, q->ld);
    for (int i = 0; i <= q->count; ++i) {
        add_row(q, q->member[i], p[i], sum);
        room += tolerance * fabs(p[i]) / q->weight[q->member[i]];
    }
    for (int j = 0; j < q->n; ++j) room += REMOTE * fabs(sum[j]);
    return slope > room;
}

/* The waiting row depends on the members, as careful_pivot has found: move the multipliers along the ray that leaves
 * stationarity as it is, until one of them stops it. 0 if none does: then the rows of the ray cannot hold together. */
static int follow_ray(qp *q, double tolerance, int first, double *gain) {
    double *restrict p = q->trial;
    const int members = q->count + 1;
    for (int i = 0; i < q->count; ++i) p[i] = -p[i];
    p[q->count] = 1.0;
    double slope = 0.0, size = 0.0;
    for (int i = 0; i < members; ++i) {
        slope += p[i] * dual_slope(q, i);
        size = fmax(size, fabs(p[i]) / q->weight[q->member[i]]);
    }
    double sign = slope < 0.0 ? -1.0 : 1.0;
    dual_step step = longest_step(q, p, sign, members, INFINITY, first);
    const int neutral = fabs(slope) <= tolerance * size;
    if (neutral) {
        /* Rounding chose the sign: the rows hold together, and one of them can leave. */
        const dual_step back = longest_step(q, p, -sign, members, INFINITY, first);
        const int longer = back.length > step.length || (back.length == step.length && step.at_l1);
        if (step.blocking < 0 || (back.blocking >= 0 && longer)) {
            step = back;
            sign = -sign;
        }
    }
    for (int i = 0; i < members; ++i) p[i] *= sign;
    *gain = 0.0;
    /* A row that is only almost dependent may find its own minimum before anything stops it, and joins. */
    const int full = q->count == q->capacity - 1, joins = !full && !neutral && step.length * q->D[q->count] > fabs(slope);
    if (step.blocking >= 0 && !joins) {
        *gain = step.length * sign * slope;
        move_multipliers(q, p, members, step.length);
        leave(q, step.blocking, step.at_l1);
        return 1;
    }
    if (contradict(q, p, fabs(slope), tolerance)) {
        q->conflicts = 0;
        for (int i = 0; i < members; ++i)
            if (fabs(p[i]) / q->weight[q->member[i]] > 1e-9 * size) q->conflict[q->conflicts++] = q->member[i];
        return 0;
    }
    if (full) return 0;
    q->D[q->count] = fmax(q->D[q->count], 1e-300);
    ++q->count;
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

/* residual = gradient of the Lagrangian; returns its size relative to that of its parts. */
static double stationarity(const qp *q, const double *restrict gradient, double *restrict residual) {
    double size = 1e-300, largest = 0.0;
    zero(residual, q->ld);
    for (int i = 0; i < q->n; ++i) {
        const double *restrict row = q->hessian + (ptrdiff_t)i * q->ld;
        const int start = padded(i + 1);
        double s = 0.0;
        for (int j = i; j < start && j < q->n; ++j) s += row[j] * q->v[j];
        s += dot(row + start, q->v + start, q->ld - start);
        for (int j = i + 1; j < start && j < q->n; ++j) residual[j] += row[j] * q->v[i];
        axpy(residual + start, q->v[i], row + start, q->ld - start);
        residual[i] += s;
    }
    for (int i = 0; i < q->n; ++i) size = fmax(size, fmax(fabs(residual[i]), fabs(gradient[i])));
    for (int i = 0; i < q->n; ++i) residual[i] += gradient[i];
    add_saturated(q, residual);
    for (int i = 0; i < q->count; ++i) add_row(q, q->member[i], q->mu[i], residual);
    for (int i = 0; i < q->n; ++i) largest = fmax(largest, fabs(residual[i]) / size);
    return largest;
}

/* One Newton step on the optimality conditions of the working set; the largest residual found, relative. */
static double refine(qp *q, const double *restrict gradient) {
    double *restrict residual = q->residual, *restrict off = q->trial, *restrict step = q->shift;
    double largest = stationarity(q, gradient, residual);
    for (int i = 0; i < q->count; ++i) {
        const int row = q->member[i];
        off[i] = deviation(q, i, q->value[row]);
        /* A row that gives way easily may as well be off by its price. */
        const double price = compliance(q, row) > 0.0 ? fabs(off[i]) / (compliance(q, row) * fabs(q->mu[i])) : INFINITY;
        largest = fmax(largest, fmin(fabs(off[i]) * q->weight[row], price));
    }
    if (!(largest > 1e-12) || !isfinite(largest)) return largest;

    /* [H A'; A -E] (dv, dmu) = -(residual, off), in the coordinates of w */
    zero(step, q->ld);
    for (int i = 0; i < q->n; ++i) residual[i] = -residual[i];
    add_transformed(q, residual, q->n, step);
    for (int i = 0; i < q->count; ++i) off[i] += dot(moved(q, i), step, q->ld);
    solve_members(q, q->count, off);
    for (int i = 0; i < q->count; ++i) {
        axpy(step, -off[i], moved(q, i), q->ld);
        q->mu[i] += off[i];
    }
    axpy(q->w, 1.0, step, q->ld);
    add_solution(q, step, q->v);
    update_values(q);
    return largest;
}

/* Refine until there is nothing left to gain. */
static double polish(qp *q, const double *restrict gradient) {
    double residual = refine(q, gradient);
    for (int i = 0; i < 20 && residual > 1e-12; ++i) {
        const double before = residual;
        residual = refine(q, gradient);
        if (!(residual < 0.9 * before)) break;
    }
    return residual;
}

/* The member whose multiplier refinement has carried farthest out of its range, or -1. */
static int astray(const qp *q, int *at_l1) {
    double worst = 0.0, scale = 0.0;
    int found = -1;
    for (int i = 0; i < q->count; ++i) scale = fmax(scale, fabs(q->mu[i]) / q->weight[q->member[i]]);
    for (int i = 0; i < q->count; ++i) {
        const int row = q->member[i], state = q->state[row];
        const double below = state == AT_UPPER ? -q->mu[i] : state == GIVING ? q->l1[row] - q->mu[i] : -INFINITY;
        const double above = state == AT_UPPER ? q->mu[i] - q->l1[row] : state == AT_LOWER ? q->mu[i] : -INFINITY;
        const double excess = fmax(below, above) / q->weight[row];
        if (!(excess > fmax(worst, 1e-9 * scale))) continue;
        worst = excess;
        found = i;
        *at_l1 = state == GIVING || (state == AT_UPPER && above > below);
    }
    return found;
}

/* w for the present multipliers. */
static void start_minimiser(qp *q, const double *restrict gradient) {
    double *restrict total = q->residual;
    zero(q->w, q->ld);
    copy(total, gradient, q->n);
    add_saturated(q, total);
    for (int i = 0; i < q->n; ++i) total[i] = -total[i];
    add_transformed(q, total, q->n, q->w);
    for (int i = 0; i < q->count; ++i) axpy(q->w, -q->mu[i], moved(q, i), q->ld);
}

/* Solve from the present working set, whose multipliers are within their ranges. The minimiser is in q->v; where the
 * budget ends early, it is the one of the last working set. */
static rumo_status solve_qp(qp *q, const double *restrict gradient, const qp_limits *limits) {
    const double end = isfinite(limits->seconds) ? seconds_now() + limits->seconds : INFINITY;
    int stalled = 0, renewed = 0;
    double gained = 0.0, residual = INFINITY;
    q->iterations = q->conflicts = 0;
    start_minimiser(q, gradient);
    for (;;) {
        const int first = stalled > 2 * q->count + 20; /* lowest index first: no cycles */
        double gain = 0.0, worst;
        int row = -1, gone = -1, at_l1 = 0;
        if (q->pending) {
            if (extend(q, q->count)) {
                ++q->count;
                q->pending = 0;
                continue;
            }
            if (!follow_ray(q, limits->tolerance, first, &gain)) {
                clear_members(q); /* their multipliers have gone far off in vain */
                return RUMO_SOLVER_FAILED;
            }
        } else if (follow_members(q, first, &gain)) {
            update_solution(q);
            if (!all_finite(q->v, q->ld)) {
                clear_members(q); /* nothing here is worth a warm start */
                return RUMO_SOLVER_FAILED;
            }
            row = most_violated(q, limits->tolerance, first, &worst);
            if (worst < DOUBTFUL) {
                residual = polish(q, gradient);
                if (residual > 1e-12 && !renewed) { /* updates of L D L' have cost too many digits */
                    refactor(q, 0);
                    renewed = 1;
                    continue;
                }
                row = most_violated(q, limits->tolerance, first, &worst);
                if (row < 0) gone = astray(q, &at_l1);
            }
            if (row < 0 && gone < 0) break;
        }
        if (q->iterations >= limits->iterations || (isfinite(end) && seconds_now() > end)) {
            if (row < 0) update_solution(q);
            return RUMO_BUDGET_EXCEEDED;
        }
        ++q->iterations;
        if (row >= 0) enter(q, row);
        if (gone >= 0) leave(q, gone, at_l1);
        renewed = 0;
        if (q->iterations % 50 == 0) refactor(q, 0);
        stalled = gain > 1e-14 * gained ? 0 : stalled + 1;
        gained += gain;
    }
    return residual < 1e-6 && all_finite(q->v, q->ld) ? RUMO_OPTIMAL : RUMO_SOLVER_FAILED;
}
