/* The numbers of a problem: what follows from them, and other ones between two samples. */
#ifndef RUMO_NUMBERS_C
#define RUMO_NUMBERS_C

#include "base/blocks.h"
#include "base/copies.c"
#include "controller.h"
#include "rules.c"
#include "stages/inner.c"

/* The parameters (N, np), number k in lane k. */
static void spread_parameters(rumo_controller *ctl) {
    const int np = ctl->problem.sizes.parameters;
    to_lanes(ctl->problem.numbers.parameter_values, np, np, ctl->s.N, ctl->s.lanes, ctl->stages.p_lanes);
}

/* Whether the limits of interval k are those of a block: its own, and the one before where an input is on the way. */
static int limits_block(const dims *s, const rumo_blocking *held, int k, int block) {
    const int own = block_at(s, held, k);
    return own == block || (own == block + 1 && share_at(s, held, k) < 1.0);
}

/* Whether the limits of all intervals of each block leave it a value. */
RARE static rumo_fault check_blocks(const rumo_bounds *b, const rumo_problem *p) {
    const dims s = dims_of(&p->sizes);
    if (unblocked(&s)) return no_fault;
    for (int block = 0; block < s.nb; ++block)
        for (int j = 0; j < s.nu; ++j) {
            double lower = -INFINITY, upper = INFINITY;
            for (int k = s.d; k < s.N; ++k) {
                if (!limits_block(&s, &p->blocking, k, block)) continue;
                lower = fmax(lower, b->input_lower[k * s.nu + j]);
                upper = fmin(upper, b->input_upper[k * s.nu + j]);
                if (lower > upper) return (rumo_fault){RUMO_CROSSED, "", "input_lower", k * s.nu + j};
            }
        }
    return no_fault;
}

RARE static rumo_fault check_numbers(const rumo_numbers *numbers, const rumo_problem *p) {
    const rumo_sizes *s = &p->sizes;
    rumo_fault fault = check_rumo_numbers("", numbers, s);
    if (!fault.error) fault = check_bounds(&numbers->bounds, s);
    if (!fault.error)
        fault = check_limits("block_lower", numbers->block_lower, numbers->block_upper, s->blocks * s->inputs, 1);
    return fault.error ? fault : check_blocks(&numbers->bounds, p);
}

static int differ(const double *a, const double *b, int count) {
    return a != b && memcmp(a, b, (size_t)count * sizeof *a) != 0;
}

/* Whether a limit that was infinite is finite now, or the other way round. */
static int comes_or_goes(const double *a, const double *b, int count) {
    int any = 0;
    for (int i = 0; i < count; ++i) any |= isfinite(a[i]) != isfinite(b[i]);
    return any;
}

/* Other numbers, the plan and the guess kept; those that are NULL stay. Where one is wrong, nothing changes. Bounds and
 * limits hold from the next feedback on, all others from the next preparation; iterations made with others are made again. */
RARE static rumo_fault update_numbers(rumo_controller *ctl, const rumo_numbers *given) {
    const dims *s = &ctl->s;
    const rumo_sizes *sizes = &ctl->problem.sizes;
    rumo_numbers *old = &ctl->problem.numbers, fresh;
    merge_rumo_numbers(&fresh, given, old, sizes);
    const rumo_fault fault = check_numbers(&fresh, &ctl->problem);
    if (fault.error) return fault;
    const rumo_bounds *was = &old->bounds, *is = &fresh.bounds;
    const int bounded = s->N * s->nu;
    /* Multipliers are kept, but not where their rows come or go, or their units or ranges change. */
    const int scales = differ(fresh.input_scales, old->input_scales, s->nu);
    const int prices = differ(fresh.l1, old->l1, s->nc) || differ(fresh.l2, old->l2, s->nc);
    const int moves = comes_or_goes(was->move_lower, is->move_lower, s->nu) ||
                      comes_or_goes(was->move_upper, is->move_upper, s->nu);
    const int rows = moves || comes_or_goes(was->input_lower, is->input_lower, bounded) ||
                     comes_or_goes(was->input_upper, is->input_upper, bounded) ||
                     comes_or_goes(old->constraint_limits, fresh.constraint_limits, s->N * s->nc);
    const int given_parameters = given->parameter_values != NULL;
    const int linear = given_parameters || scales || moves ||
                       differ(fresh.output_weights, old->output_weights, s->N * s->ny) ||
                       differ(fresh.move_weights, old->move_weights, s->n) ||
                       differ(fresh.constraint_scales, old->constraint_scales, s->nc);
    assign_rumo_numbers(old, &fresh, sizes);
    solver_of(&ctl->problem.sizes)->renumber(&ctl->solving);
    if (given_parameters) spread_parameters(ctl);
    if (scales || prices || rows) solver_of(&ctl->problem.sizes)->forget(&ctl->solving);
    if (linear || ctl->has_stored) ctl->prepared = 0;
    return no_fault;
}

#endif
