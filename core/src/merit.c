/* What a guess is worth, and what a step from it promises: the cost with the prices of soft limits, and how much is lacking
 * of what has to hold, the dynamics and hard limits.
 *
 * Cost and a price for what is lacking are an exact penalty function of the nonlinear problem, as long as the price is above
 * all multipliers. Source: Nocedal and Wright (2006), section 18.5; Byrd, Nocedal and Waltz (2008) for the price. */
#ifndef RUMO_MERIT_C
#define RUMO_MERIT_C

#include "controller.h"
#include "stages/along.c"
#include "stages/defects.c"
#include "stages/linearise.c"

typedef struct worth {
    double cost, lack;
} worth;

static double priced(worth w, double price) { return w.cost + price * w.lack; }

/* By how much input i of the blocks changes from the one before. */
static double move_at(const rumo_controller *ctl, const double *values, int i) {
    return values[i] - (i < ctl->s.nu ? last_decided(&ctl->guard)[i] : values[i - ctl->s.nu]);
}

/* Path constraint r of stage k less its limit, at the guess. */
static double constraint_at(const rumo_controller *ctl, int k, int r) {
    const rumo_problem *p = &ctl->problem;
    return ctl->stages.terms[(ptrdiff_t)(p->G_first + r) * ctl->s.lanes + k] - p->numbers.constraint_limits[k * ctl->s.nc + r];
}

/* The cost of changes of the inputs, from block to block. */
static double cost_of_moves(const rumo_controller *ctl, const double *values) {
    const dims *s = &ctl->s;
    const double *weights = ctl->problem.numbers.move_weights;
    double sum = 0.0;
    for (int i = 0; i < s->n; ++i) {
        const double move = move_at(ctl, values, i);
        sum += weights[i] * move * move;
    }
    return sum;
}

/* Add what output r of stage k costs, being `error` away from what is wanted. */
static void add_error(const rumo_controller *ctl, int k, int r, double error, worth *w) {
    w->cost += ctl->problem.numbers.output_weights[k * ctl->s.ny + r] * error * error;
}

/* Add what it costs that path constraint r of stage k is above its limit. */
static void add_excess(const rumo_controller *ctl, int k, int r, double excess, worth *w) {
    const rumo_numbers *numbers = &ctl->problem.numbers;
    if (!ctl->problem.imposed[k * ctl->s.nc + r] || excess <= 0.0) return;
    if (isinf(numbers->l1[r])) w->lack += excess / numbers->constraint_scales[r];
    else w->cost += (numbers->l1[r] + numbers->l2[r] * excess) * excess;
}

/* Of the guess, once the stages are linearised there. */
static worth worth_of_guess(const rumo_controller *ctl, const double *reference) {
    const dims *s = &ctl->s;
    const stage_maps *m = &ctl->stages;
    const rumo_problem *p = &ctl->problem;
    worth w = {cost_of_moves(ctl, m->guess_values), 0.0};
    for (int r = 0; r < s->nx; ++r) {
        const double *c = defects_of(m, r), unit = m->reach[r] > 0.0 ? m->reach[r] : 1.0;
        for (int k = 0; c && k < s->N; ++k) w.lack += fabs(c[k]) / unit;
    }
    for (int r = 0; r < s->ny; ++r)
        for (int k = 0; k < s->N; ++k)
            add_error(ctl, k, r, m->terms[(ptrdiff_t)(p->y_first + r) * s->lanes + k] - reference[(k + 1) * s->ny + r], &w);
    for (int r = 0; r < s->nc; ++r)
        for (int k = 0; k < s->N; ++k) add_excess(ctl, k, r, constraint_at(ctl, k, r), &w);
    return w;
}

/* Of the plan, if all were as linearised: then the dynamics hold. */
static worth promise_of_step(const rumo_controller *ctl, const double *reference) {
    const dims *s = &ctl->s;
    const stage_maps *m = &ctl->stages;
    const stage_step *step = &ctl->step;
    values_of_blocks(m, plan_u(ctl), ctl->values);
    worth w = {cost_of_moves(ctl, ctl->values), 0.0};
    for (int k = 0; k < s->N; ++k) {
        const double *dx = step->dx + (ptrdiff_t)(k + 1) * s->ldx, *du = step->du + k * s->nu;
        for (int r = 0; r < s->ny; ++r) {
            const double wanted = reference[(k + 1) * s->ny + r];
            add_error(ctl, k, r, linearised(m, ctl->problem.y_first, r, &m->Cx, &m->Cu, k, dx, du, wanted), &w);
        }
        for (int r = 0; r < s->nc; ++r) add_excess(ctl, k, r, step->constraints[k * s->nc + r], &w);
    }
    return w;
}

/* Promises that are rounding, over the merit. */
#define NO_PROMISE 1e-12

/* A price at which a step takes off at least a share of what is lacking, whatever it costs otherwise. */
#define SHARE_OF_LACK 0.1

static double price_for(worth now, worth promised, double price) {
    const double less = now.lack - promised.lack;
    if (!(less > 0.0)) return price;
    const double needed = (promised.cost - now.cost) / ((1.0 - SHARE_OF_LACK) * less);
    return needed > price ? 2.0 * needed : price;
}

/* The merit of the guess, and by how much less a step from it promises, at *price, which is raised to what that needs. */
typedef struct promise {
    double merit, less;
    int promises; /* more than rounding */
} promise;

static promise promise_at(const rumo_controller *ctl, const double *reference, double *price) {
    const worth now = worth_of_guess(ctl, reference), promised = promise_of_step(ctl, reference);
    *price = price_for(now, promised, *price);
    const double merit = priced(now, *price), less = merit - priced(promised, *price);
    return (promise){merit, less, less > NO_PROMISE * fabs(merit)};
}

#endif
