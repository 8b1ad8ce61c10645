/* The minimiser over the working set in v, and what rounding has done to it. */
#ifndef RUMO_REFINEMENT_C
#define RUMO_REFINEMENT_C

#include "solve/active_set/working_set.c"

/* Relative residuals of the optimality conditions: those that need no refinement, and the most that a solution has. */
#define FINE 1e-12
#define ACCEPTABLE 1e-6
/* A distance in units of v that no rounding explains, after refinement. */
#define DISTINCT 1e-8

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

/* residual = gradient of the Lagrangian; returns its size relative to that of its parts, or to what it takes to move v
 * by a millionth. */
static double stationarity(const qp *q, const double *restrict gradient, double *restrict residual) {
    double size = 0.0, largest = 0.0;
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
        size = larger(size, 1e-6 * row[i]);
    }
    for (int i = 0; i < q->n; ++i) size = larger(size, larger(fabs(residual[i]), fabs(gradient[i])));
    for (int i = 0; i < q->n; ++i) residual[i] += gradient[i];
    add_saturated(q, residual);
    for (int i = 0; i < q->count; ++i) add_row(q, q->member[i], q->mu[i], residual);
    for (int i = 0; i < q->n; ++i) largest = larger(largest, fabs(residual[i]));
    return largest / size;
}

/* One Newton step on the optimality conditions of the working set; the largest residual found, relative. */
static double refine(qp *q, const double *restrict gradient) {
    double *restrict residual = q->residual, *restrict off = q->trial, *restrict step = q->shift;
    double largest = stationarity(q, gradient, residual);
    for (int i = 0; i < q->count; ++i) {
        const int row = q->member[i];
        off[i] = deviation(q, i, q->value[row]);
        /* A row that gives way easily may as well be off by its price. */
        const double distance = fabs(off[i]) * q->weight[row], soft = compliance(q, row);
        largest = larger(largest, soft > 0.0 ? smaller(distance, fabs(off[i] / (soft * q->mu[i]))) : distance);
    }
    if (!(largest > FINE) || !isfinite(largest)) return largest;

    /* [H A'; A -E] (dv, dmu) = -(residual, off), in the coordinates of w */
    zero(step, q->ld);
    for (int i = 0; i < q->n; ++i) residual[i] = -residual[i];
    add_transformed(q, residual, q->n, step);
    for (int i = 0; i < q->count; ++i) off[i] += dot(moved(q, i), step, q->ld);
    solve_members(q, 0, q->count, off);
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
    for (int i = 0; i < 20 && residual > FINE; ++i) {
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
    for (int i = 0; i < q->count; ++i) scale = larger(scale, fabs(q->mu[i]) * q->norm[q->member[i]]);
    for (int i = 0; i < q->count; ++i) {
        const int row = q->member[i], state = q->state[row];
        const double below = state == AT_UPPER ? -q->mu[i] : state == GIVING ? q->l1[row] - q->mu[i] : -INFINITY;
        const double above = state == AT_UPPER ? q->mu[i] - q->l1[row] : state == AT_LOWER ? q->mu[i] : -INFINITY;
        /* A row that gives way shows in its value what its multiplier may hide. */
        const int inside = state == GIVING && (q->upper[row] - q->value[row]) * q->weight[row] > DISTINCT;
        const double excess = larger(below, above) * q->norm[row];
        if (!(excess > worst && (inside || excess > 1e-9 * scale))) continue;
        worst = excess;
        found = i;
        *at_l1 = state == GIVING || (state == AT_UPPER && above > below);
    }
    return found;
}

#endif
