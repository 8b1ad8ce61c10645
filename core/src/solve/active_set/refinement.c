/* The minimiser over the working set, and what rounding has done to it. */
#ifndef RUMO_REFINEMENT_C
#define RUMO_REFINEMENT_C

#include "solve/active_set/working_set.c"

/* Relative residuals of the optimality conditions: those that need no refinement, and the most that a solution has. */
#define FINE 1e-12
#define ACCEPTABLE 1e-6
/* Of a Hessian whose variables leave each other less than this share of their curvature, no residual shows how far off v is. */
#define SHARP 1e-6
/* A step of refinement that a solution may be off by, in units of v, and one that need not be taken. */
#define TRUSTED 1e-7
#define NEGLIGIBLE 1e-8
/* As many steps of refinement at most. */
#define MOST_STEPS 20
/* A step after which states are not what inputs lead to any more, in units of v. */
#define FAR_OFF 10.0
/* A distance in units of v that no rounding explains, after refinement. */
#define DISTINCT 1e-8

/* One Newton step on the optimality conditions of the working set, if they are not met: by their size, or because little moves
 * variables far. Returns their largest residual. */
static double refine(qp *q) {
    double *restrict step = q->shift, *restrict off = q->trial;
    const double slope = q->space->slope(q, step);
    double beside = 0.0, left = 0.0;
    for (int i = 0; i < q->count; ++i) {
        const int row = q->member[i];
        off[i] = deviation(q, i, q->value[row]);
        /* A row that gives way easily may as well be off by its price. */
        const double distance = fabs(off[i]) * q->weight[row], soft = compliance(q, row);
        beside = larger(beside, soft > 0.0 ? smaller(distance, fabs(off[i] / (soft * q->mu[i]))) : distance);
    }
    const double largest = larger(slope, beside);
    q->last_step = 0.0;
    const int too_long = !(q->stretch * sqrt(dot(step, step, q->ld)) <= NEGLIGIBLE);
    if (!(largest > q->fine || too_long) || !isfinite(largest)) return largest;

    /* [H A'; A -E] (dv, dmu) = -(slope, off), in the coordinates of w */
    for (int j = 0; j < q->ld; ++j) step[j] = -step[j];
    double *restrict along = q->direction;
    for (int again = 0;; ++again) {
        project_on_members(q, step, q->count, along);
        left = 0.0;
        for (int i = 0; i < q->count; ++i) {
            const int row = q->member[i];
            off[i] = deviation(q, i, q->value[row]) + along[i];
            left = larger(left, fabs(deviation(q, i, q->value[row] + along[i])) * q->weight[row]);
        }
        /* Taking members out of a long step leaves rounding of its length in it: once more. */
        if (again > 1 || (again && !(left > q->tolerance))) break;
        solve_members(q, 0, q->count, off);
        subtract_members(q, off, q->count, step);
        for (int i = 0; i < q->count; ++i) q->mu[i] += off[i];
    }
    q->last_step = q->space->correct(q, step);
    q->evaluated = 1;
    /* Where states are huge, rounding alone moves rows: they are off by no more than the step that mends them. */
    return larger(slope, smaller(beside, q->last_step + left));
}

/* When residuals have to be refined: at once where so little is left of a curvature that its factor has lost digits, see
 * factorise.c, else where they are large or move variables far. */
static inline void set_fine(qp *q, double share, double stretch) {
    q->fine = share < SHARP ? 0.0 : FINE;
    q->stretch = stretch;
}

/* Refine until there is nothing left to gain; returns the longest step. */
static double refine_on(qp *q) {
    q->kkt_residual = refine(q);
    double longest = q->last_step;
    for (int i = 0; i < MOST_STEPS && q->last_step > 0.0 && !is_over(q->end); ++i) {
        const double residual = q->kkt_residual, step = q->last_step;
        q->kkt_residual = refine(q);
        longest = larger(longest, q->last_step);
        if (!(q->kkt_residual < 0.9 * residual || q->last_step < 0.5 * step)) break;
    }
    return longest;
}

/* The same; and after steps so long that what they were added to has lost its digits, again from w alone. Where that does not
 * help, a solution is not to be trusted. */
static void polish(qp *q) {
    double longest = refine_on(q);
    for (int i = 0; longest > FAR_OFF && i < MOST_STEPS && !is_over(q->end); ++i) {
        q->evaluated = 0;
        evaluate_at_w(q);
        longest = refine_on(q);
    }
    if (longest > FAR_OFF) q->last_step = longest;
}

/* Whether the optimality conditions hold as accurately as a solution needs. */
static int is_trusted(const qp *q) { return q->kkt_residual < ACCEPTABLE && q->last_step < TRUSTED; }

/* The member whose multiplier refinement has carried farthest out of its range, or -1. */
static int astray(const qp *q, int *at_l1) {
    double worst = 0.0;
    int found = -1;
    for (int i = 0; i < q->count; ++i) {
        const int row = q->member[i], state = q->state[row];
        const double below = state == AT_UPPER ? -q->mu[i] : state == GIVING ? q->l1[row] - q->mu[i] : -INFINITY;
        const double above = state == AT_UPPER ? q->mu[i] - q->l1[row] : state == AT_LOWER ? q->mu[i] : -INFINITY;
        /* A row that gives way shows in its value what its multiplier may hide. */
        const double inside = state == GIVING ? (q->upper[row] - q->value[row]) * q->weight[row] : 0.0;
        const double beyond = larger(below, above), excess = larger(inside, pull(q, i, larger(beyond, 0.0)));
        const double end = state == GIVING || (state == AT_UPPER && above > below) ? q->l1[row] : 0.0;
        const double own = larger(fabs(q->mu[i]), end);
        if (!(excess > larger(worst, DISTINCT) && (inside > DISTINCT || beyond > 1e-9 * own))) continue;
        worst = excess;
        found = i;
        *at_l1 = state == GIVING || (state == AT_UPPER && above > below);
    }
    return found;
}

#endif
