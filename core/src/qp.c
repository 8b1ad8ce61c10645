/* Dense strictly convex quadratic programs by a dual active-set method, with soft rows and warm starts.
 *
 *   min v'Hv/2 + g'v + sum_i l1_i s_i + l2_i s_i^2    lower <= (v, increments of v, rows v) <= upper + s,  s >= 0
 *
 * A row with infinite l1 is hard. Slacks are no variables: a multiplier between 0 and l1 holds a soft row at its
 * limit, one above l1 lets it give way by (multiplier - l1) / (2 l2), and with l2 = 0 it stays at l1.
 * With U'U = H and m = U'^-1 a for each row a of the working set, the multipliers solve (M M' + E) mu = M w - t, where
 * w is the minimiser so far in the coordinates U v, and E the compliance of rows that give way. M M' + E = L D L'.
 *
 * Source: Goldfarb and Idnani (1983); Arnstroem, Bemporad and Axehill (2022) for L D L' in place of Q R.
 */

typedef enum row_state {
    INACTIVE,
    AT_LOWER,  /* multiplier <= 0 */
    AT_UPPER,  /* 0 <= multiplier <= l1 */
    GIVING,    /* soft, multiplier >= l1, l2 > 0 */
    SATURATED  /* soft, multiplier = l1, l2 = 0: not in the working set */
} row_state;

typedef struct qp {
    int n, ld;             /* variables; length of a row, padded */
    int band;              /* inputs of a stage, if increments v_j - v_{j - band} are limited; else 0 */
    int rows, dense;       /* all rows: n bounds, n increments if limited, then the dense ones from `dense` on */
    int capacity, stride;  /* of the working set; of L */
    const double *hessian, *inverse, *transpose; /* see condense.c */
    const double *matrix;  /* dense rows, ld apart */
    int *extent;           /* (dense rows,): length to which a row is not zero, padded */
    double *lower, *upper, *l1, *l2, *weight; /* (rows,): weight is 1 / norm */
    double *floor, *ceiling, *value;          /* (rows,): limits that are still to be watched, and a'v */
    int *state, saturated;                    /* (rows,): row_state; how many are saturated */
    int count;             /* members of the working set */
    int *member, *place;   /* row of each; where its m lies */
    double *mu, *moved, *L, *D;
    int pending;           /* 1 while the row at position `count` waits to join */
    double *base, *w, *v;  /* minimiser without the working set, and with it, in U v; in v */
    double *direction, *trial, *spare;
    int *conflict, conflicts, *scratch;
    int iterations;
} qp;

typedef struct qp_limits {
    int iterations;
    double tolerance, seconds;
} qp_limits;

static void take_qp(arena *a, qp *q, int n, int band, int dense, int limited) {
    q->n = n;
    q->ld = padded(n);
    q->band = limited ? band : 0;
    q->dense = limited ? 2 * n : n;
    q->rows = q->dense + dense;
    q->capacity = n + dense + 1; /* only rows that give way can be more than n; one may be pending */
    q->stride = padded(q->capacity);
    const int rows = padded(q->rows);
    double **const per_row[] = {&q->lower, &q->upper, &q->l1, &q->l2, &q->weight, &q->floor, &q->ceiling, &q->value};
    for (size_t i = 0; i < sizeof per_row / sizeof *per_row; ++i) *per_row[i] = take_doubles(a, rows);
    q->extent = take_ints(a, dense);
    q->state = take_ints(a, rows);
    q->member = take_ints(a, q->capacity);
    q->place = take_ints(a, q->capacity);
    q->conflict = take_ints(a, q->capacity);
    q->scratch = take_ints(a, q->capacity);
    q->moved = take_doubles(a, (ptrdiff_t)q->capacity * q->ld);
    q->L = take_doubles(a, (ptrdiff_t)q->capacity * q->stride);
    double **const per_member[] = {&q->mu, &q->D, &q->direction, &q->trial, &q->spare};
    for (size_t i = 0; i < sizeof per_member / sizeof *per_member; ++i) *per_member[i] = take_doubles(a, q->stride);
    q->base = take_doubles(a, q->ld);
    q->w = take_doubles(a, q->ld);
    q->v = take_doubles(a, q->ld);
    if (!a->base) return;
    for (int i = 0; i < rows; ++i) {
        q->lower[i] = q->floor[i] = -INFINITY;
        q->upper[i] = q->ceiling[i] = q->l1[i] = INFINITY;
        q->weight[i] = i < q->n ? 1.0 : 0.70710678118654752440;
    }
}

static inline double *moved(const qp *q, int position) { return q->moved + (ptrdiff_t)q->place[position] * q->ld; }

/* y += scale a, for row a. */
static void add_row(const qp *q, int row, double scale, double *restrict y) {
    if (row < q->n) {
        y[row] += scale;
    } else if (row < q->dense) {
        const int j = row - q->n;
        y[j] += scale;
        if (j >= q->band) y[j - q->band] -= scale;
    } else {
        axpy(y, scale, q->matrix + (ptrdiff_t)(row - q->dense) * q->ld, q->extent[row - q->dense]);
    }
}

/* y += sum of l1 a over the saturated rows. */
static void add_saturated(const qp *q, double *restrict y) {
    for (int r = q->dense, left = q->saturated; left > 0 && r < q->rows; ++r)
        if (q->state[r] == SATURATED) {
            add_row(q, r, q->l1[r], y);
            --left;
        }
}

/* y += U'^-1 x, for an x that is zero from `extent` on. */
static void add_transformed(const qp *q, const double *restrict x, int extent, double *restrict y) {
    const int end = extent < q->n ? extent : q->n;
    for (int i = 0; i < end; ++i) {
        const int start = i / LANES * LANES;
        axpy(y + start, x[i], q->transpose + (ptrdiff_t)i * q->ld + start, q->ld - start);
    }
}

/* m = U'^-1 a. */
static void transform(const qp *q, int row, double *restrict m) {
    zero(m, q->ld);
    if (row < q->dense) {
        const int j = row < q->n ? row : row - q->n;
        copy(m, q->transpose + (ptrdiff_t)j * q->ld, q->ld);
        if (row >= q->n && j >= q->band) axpy(m, -1.0, q->transpose + (ptrdiff_t)(j - q->band) * q->ld, q->ld);
    } else {
        add_transformed(q, q->matrix + (ptrdiff_t)(row - q->dense) * q->ld, q->extent[row - q->dense], m);
    }
}

static void watch(qp *q, int row, row_state state) {
    q->saturated += (state == SATURATED) - (q->state[row] == SATURATED);
    q->state[row] = (int)state;
    q->floor[row] = state == INACTIVE ? q->lower[row] : state == SATURATED ? q->upper[row] : -INFINITY;
    q->ceiling[row] = state == INACTIVE ? q->upper[row] : INFINITY;
}

static inline double compliance(const qp *q, int row) { return q->state[row] == GIVING ? 0.5 / q->l2[row] : 0.0; }

/* Value that a'v - compliance mu takes for a member. */
static inline double target_of(const qp *q, int row) {
    switch ((row_state)q->state[row]) {
    case AT_LOWER: return q->lower[row];
    case GIVING: return q->upper[row] - q->l1[row] * 0.5 / q->l2[row];
    default: return q->upper[row];
    }
}

/* Extend L D L' by the row at a position, from those before; 0 if it depends on them. What it found is left in L. */
static int extend(qp *q, int position) {
    const double *restrict m = moved(q, position);
    const double size = dot(m, m, q->ld);
    double *restrict ell = q->L + (ptrdiff_t)position * q->stride;
    for (int i = 0; i < position; ++i) ell[i] = dot(moved(q, i), m, q->ld);
    for (int i = position; i < padded(position); ++i) ell[i] = 0.0;
    double pivot = size + compliance(q, q->member[position]);
    const double whole = pivot;
    for (int i = 0; i < position; ++i) {
        const double *restrict row = q->L + (ptrdiff_t)i * q->stride;
        double s[LANES] = {0.0};
        int j = 0;
        for (; j + LANES <= i; j += LANES)
            for (int l = 0; l < LANES; ++l) s[l] += row[j + l] * ell[j + l];
        double rest = sum_of_lanes(s);
        for (; j < i; ++j) rest += row[j] * ell[j];
        ell[i] -= rest;
    }
    for (int i = 0; i < position; ++i) {
        const double y = ell[i];
        ell[i] = y / q->D[i];
        pivot -= y * ell[i];
    }
    q->D[position] = pivot;
    return pivot > 1e-11 * whole;
}

/* Solve L D L' x = x. */
static void solve_members(const qp *q, double *restrict x) {
    for (int i = 1; i < q->count; ++i) {
        const double *restrict row = q->L + (ptrdiff_t)i * q->stride;
        double s = 0.0;
        for (int j = 0; j < i; ++j) s += row[j] * x[j];
        x[i] -= s;
    }
    for (int i = 0; i < q->count; ++i) x[i] /= q->D[i];
    for (int i = q->count - 1; i > 0; --i) {
        const double *restrict row = q->L + (ptrdiff_t)i * q->stride;
        const double f = x[i];
        for (int j = 0; j < i; ++j) x[j] -= f * row[j];
    }
}

/* Put a row behind the working set, where it waits to join. */
static void stage_row(qp *q, int row, row_state state, double mu) {
    q->member[q->count] = row;
    q->mu[q->count] = mu;
    watch(q, row, state);
    transform(q, row, moved(q, q->count));
    q->pending = 1;
}

/* Take the member at a position out, and update L D L' (rank one). */
static void drop(qp *q, int position) {
    const int last = q->count - 1 + q->pending, free_place = q->place[position];
    double *restrict w = q->spare;
    double a = q->D[position];
    for (int i = position + 1; i < q->count; ++i) w[i] = q->L[(ptrdiff_t)i * q->stride + position];
    for (int i = position; i < last; ++i) {
        q->member[i] = q->member[i + 1];
        q->place[i] = q->place[i + 1];
        q->mu[i] = q->mu[i + 1];
    }
    q->place[last] = free_place;
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
}

/* Factor the rows from a position on again. One that now depends on the others waits to join; if another does
 * already, it is let go, and will be found again. */
static void refactor(qp *q, int position) {
    for (int i = position; i < q->count;) {
        if (extend(q, i)) {
            ++i;
            continue;
        }
        const int row = q->member[i], place = q->place[i], last = q->count - 1 + q->pending;
        const double mu = q->mu[i];
        for (int k = i; k < last; ++k) {
            q->member[k] = q->member[k + 1];
            q->place[k] = q->place[k + 1];
            q->mu[k] = q->mu[k + 1];
        }
        q->member[last] = row;
        q->place[last] = place;
        q->mu[last] = mu;
        --q->count;
        if (q->pending) watch(q, row, INACTIVE);
        q->pending = 1;
    }
}

/* w = base - M'mu. */
static void update_minimiser(qp *q) {
    copy(q->w, q->base, q->ld);
    for (int i = 0; i < q->count + q->pending; ++i) axpy(q->w, -q->mu[i], moved(q, i), q->ld);
}

/* v += U^-1 x. */
static void add_solution(const qp *q, const double *restrict x, double *restrict v) {
    for (int i = 0; i < q->n; ++i) axpy(v, x[i], q->inverse + (ptrdiff_t)i * q->ld, padded(i + 1));
}

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

static void move_to_minimiser(qp *q) {
    update_minimiser(q);
    zero(q->v, q->ld);
    add_solution(q, q->w, q->v);
    update_values(q);
}

/* The row that is farthest beyond its limits (the first such row if `first`), or -1. */
static int most_violated(const qp *q, double tolerance, int first) {
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
        for (int l = 0; l < LANES; ++l)
            if (violation[l] > worst) {
                worst = violation[l];
                found = i + l;
                if (first) return found;
            }
    }
    return found;
}

/* A step of the multipliers along a direction, and the member that stops it (-1: none). */
typedef struct dual_step {
    double length;
    int blocking, at_l1;
} dual_step;

static dual_step longest_step(const qp *q, const double *direction, int members, double length, int first) {
    dual_step step = {length, -1, 0};
    double largest = 0.0, scale = 0.0;
    for (int i = 0; i < members; ++i) scale = fmax(scale, fabs(direction[i]));
    for (int i = 0; i < members; ++i) {
        const int row = q->member[i];
        const double p = direction[i], l1 = q->l1[row];
        const row_state state = (row_state)q->state[row];
        if (!(fabs(p) > 1e-13 * scale)) continue;
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
        const int better = tie && (first ? row < q->member[step.blocking] : fabs(p) > largest);
        if (reached < step.length || better) {
            step = (dual_step){reached, i, at_l1};
            largest = fabs(p);
        }
    }
    return step;
}

/* Change the state of a member whose multiplier has reached the end of its range. */
static void leave(qp *q, int position, int at_l1) {
    const int row = q->member[position], waiting = q->pending && position == q->count;
    const row_state state = (row_state)q->state[row];
    if (!at_l1 || (state == GIVING && q->l1[row] == 0.0)) {
        watch(q, row, INACTIVE);
    } else if (state == AT_UPPER && q->l2[row] == 0.0) {
        watch(q, row, SATURATED);
        axpy(q->base, -q->l1[row], moved(q, position), q->ld);
    } else {
        watch(q, row, state == GIVING ? AT_UPPER : GIVING);
        q->mu[position] = q->l1[row];
        if (!waiting) refactor(q, position);
        return;
    }
    if (waiting) q->pending = 0;
    else drop(q, position);
}

/* The waiting row depends on the members: move the multipliers along the ray that leaves stationarity as it is, until
 * one of them stops it. 0 if none does: then the rows of the ray cannot hold together. */
static int follow_ray(qp *q, int first, double *moved_by) {
    double *restrict p = q->trial;
    const double *restrict ell = q->L + (ptrdiff_t)q->count * q->stride;
    const int members = q->count + 1;
    for (int i = 0; i < q->count; ++i) p[i] = -ell[i];
    for (int i = q->count - 1; i > 0; --i) {
        const double *restrict row = q->L + (ptrdiff_t)i * q->stride;
        for (int j = 0; j < i; ++j) p[j] -= p[i] * row[j];
    }
    p[q->count] = 1.0;
    update_minimiser(q);
    double slope = 0.0, size = 1.0;
    for (int i = 0; i < members; ++i) {
        const int row = q->member[i];
        slope += p[i] * (dot(moved(q, i), q->w, q->ld) - compliance(q, row) * q->mu[i] - target_of(q, row));
        size = fmax(size, fabs(p[i]));
    }
    if (slope < 0.0)
        for (int i = 0; i < members; ++i) p[i] = -p[i];
    const dual_step step = longest_step(q, p, members, INFINITY, first);
    if (step.blocking < 0) {
        q->conflicts = 0;
        for (int i = 0; i < members; ++i)
            if (fabs(p[i]) > 1e-9 * size) q->conflict[q->conflicts++] = q->member[i];
        return 0;
    }
    for (int i = 0; i < members; ++i) q->mu[i] += step.length * p[i];
    *moved_by = step.length * size;
    leave(q, step.blocking, step.at_l1);
    return 1;
}

/* Minimise over the working set by moving the multipliers; 1 once there, 0 if one of them stopped it. */
static int follow_members(qp *q, int first, double *moved_by) {
    double *restrict goal = q->trial, *restrict direction = q->direction;
    *moved_by = 0.0;
    if (!q->count) return 1;
    for (int i = 0; i < q->count; ++i) goal[i] = dot(moved(q, i), q->base, q->ld) - target_of(q, q->member[i]);
    solve_members(q, goal);
    for (int i = 0; i < q->count; ++i) direction[i] = goal[i] - q->mu[i];
    const dual_step step = longest_step(q, direction, q->count, 1.0, first);
    if (step.blocking < 0) {
        copy(q->mu, goal, q->count);
        return 1;
    }
    for (int i = 0; i < q->count; ++i) {
        q->mu[i] += step.length * direction[i];
        *moved_by = fmax(*moved_by, fabs(step.length * direction[i]) / (1e-300 + fabs(goal[i])));
    }
    leave(q, step.blocking, step.at_l1);
    return 0;
}

/* Let a violated row join: from zero, or from l1 if it was saturated. */
static void enter(qp *q, int row) {
    const double l1 = q->l1[row];
    if (q->state[row] == SATURATED) {
        stage_row(q, row, AT_UPPER, l1);
        axpy(q->base, l1, moved(q, q->count), q->ld);
    } else if (q->value[row] > q->upper[row]) {
        stage_row(q, row, l1 == 0.0 ? GIVING : AT_UPPER, 0.0);
    } else {
        stage_row(q, row, AT_LOWER, 0.0);
    }
}

/* One Newton step on the optimality conditions of the working set; the largest residual found, relative. */
static double refine(qp *q, const double *restrict gradient) {
    double *restrict residual = q->w, largest = 0.0, size = 1e-300;
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
    for (int i = 0; i < q->count; ++i) {
        const int row = q->member[i];
        const double off = q->value[row] - compliance(q, row) * q->mu[i] - target_of(q, row);
        largest = fmax(largest, fabs(off) * q->weight[row]);
        q->trial[i] = off;
    }
    if (!(largest > 1e-12) || !isfinite(largest)) return largest;

    /* [H A'; A -E] (dv, dmu) = -(residual, off), in the coordinates of w */
    double *restrict step = q->base; /* is not needed any more */
    zero(step, q->ld);
    for (int i = 0; i < q->n; ++i) residual[i] = -residual[i];
    add_transformed(q, residual, q->n, step);
    for (int i = 0; i < q->count; ++i) q->trial[i] += dot(moved(q, i), step, q->ld);
    solve_members(q, q->trial);
    for (int i = 0; i < q->count; ++i) {
        axpy(step, -q->trial[i], moved(q, i), q->ld);
        q->mu[i] += q->trial[i];
    }
    add_solution(q, step, q->v);
    update_values(q);
    return largest;
}

/* Start from an empty working set. */
static void clear_members(qp *q) {
    for (int i = 0; i < q->capacity; ++i) q->place[i] = i;
    for (int r = 0; r < q->rows; ++r) q->state[r] = INACTIVE;
    q->count = q->pending = q->saturated = 0;
}

/* Take the working set over to new rows, each `inputs` free inputs and `constraints` dense rows earlier (0: as it is),
 * as far as rows are imposed and independent. Limits may still change: see watch_members. */
static void renew_members(qp *q, int inputs, int constraints, const int *imposed) {
    const int members = q->count;
    int *restrict row = q->conflict, *restrict state = q->scratch;
    for (int i = 0; i < members; ++i) {
        row[i] = q->member[i];
        state[i] = q->state[row[i]];
        q->spare[i] = q->mu[i];
    }
    for (int r = 0; r < q->dense; ++r) q->state[r] = INACTIVE;
    q->saturated = 0;
    for (int r = q->dense; r < q->rows; ++r) {
        const int from = r + constraints;
        const int keep = from < q->rows && q->state[from] == SATURATED && imposed[r - q->dense];
        q->state[r] = keep ? SATURATED : INACTIVE;
        q->saturated += keep;
    }
    q->count = q->pending = 0;
    for (int i = 0; i < members; ++i) {
        const int part = row[i] < q->n ? 0 : row[i] < q->dense ? q->n : q->dense;
        const int moved_to = row[i] - (part == q->dense ? constraints : inputs);
        if (moved_to < part || (part == q->dense && !imposed[moved_to - part])) continue;
        stage_row(q, moved_to, (row_state)state[i], q->spare[i]);
        q->pending = 0;
        if (extend(q, q->count)) ++q->count;
        else q->state[moved_to] = INACTIVE;
    }
}

/* Let the watch on all rows agree with their limits and states. */
static void watch_members(qp *q) {
    copy(q->floor, q->lower, q->rows);
    copy(q->ceiling, q->upper, q->rows);
    for (int i = 0; i < q->count; ++i) watch(q, q->member[i], (row_state)q->state[q->member[i]]);
    for (int r = q->dense, left = q->saturated; left > 0 && r < q->rows; ++r)
        if (q->state[r] == SATURATED) {
            watch(q, r, SATURATED);
            --left;
        }
}

/* Solve from the present working set, whose multipliers are within their ranges. The minimiser is in q->v; where the
 * budget ends early, it is the one of the last working set. */
static rumo_status solve_qp(qp *q, const double *restrict gradient, const qp_limits *limits) {
    const double end = isfinite(limits->seconds) ? seconds_now() + limits->seconds : INFINITY;
    int stalled = 0;
    q->iterations = 0;
    q->conflicts = 0;
    zero(q->base, q->ld);
    double *restrict total = q->w;
    copy(total, gradient, q->n);
    add_saturated(q, total);
    for (int i = 0; i < q->n; ++i) total[i] = -total[i];
    add_transformed(q, total, q->n, q->base);
    for (;;) {
        const int first = stalled > 2 * q->count + 20; /* lowest index first: no cycles */
        double moved_by = 0.0;
        int row = -1;
        if (q->pending) {
            if (q->count < q->capacity - 1 && extend(q, q->count)) {
                ++q->count;
                q->pending = 0;
                continue;
            }
            if (!follow_ray(q, first, &moved_by)) return RUMO_SOLVER_FAILED;
        } else if (follow_members(q, first, &moved_by)) {
            move_to_minimiser(q);
            if (!all_finite(q->v, q->ld)) return RUMO_SOLVER_FAILED;
            row = most_violated(q, limits->tolerance, first);
            if (row < 0) break;
        }
        if (q->iterations >= limits->iterations || (isfinite(end) && seconds_now() > end)) {
            if (row < 0) move_to_minimiser(q);
            return RUMO_BUDGET_EXCEEDED;
        }
        ++q->iterations;
        if (row >= 0) enter(q, row);
        stalled = row >= 0 || moved_by > 1e-14 ? 0 : stalled + 1;
    }
    double residual = refine(q, gradient);
    if (residual > 1e-12) residual = refine(q, gradient);
    return residual < 1e-6 && all_finite(q->v, q->ld) ? RUMO_OPTIMAL : RUMO_SOLVER_FAILED;
}
