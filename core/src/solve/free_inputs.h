/* Limits of the free inputs. */
#ifndef RUMO_FREE_INPUTS_H
#define RUMO_FREE_INPUTS_H

#include "base/admissible.h"
#include "base/arena.h"
#include "base/blocks.h"
#include "solve/stage_solver.h"

typedef struct free_limits {
    const double *lower, *upper; /* (nb, nu); a view where inputs are not held */
} free_limits;

RARE static free_limits lay_out_limits(arena *a, const dims *s, const rumo_bounds *own) {
    if (unblocked(s) && !a->base) return (free_limits){NULL, NULL};
    if (unblocked(s)) return (free_limits){own->input_lower + s->d * s->nu, own->input_upper + s->d * s->nu};
    double *lower = alloc_doubles(a, s->n), *upper = alloc_doubles(a, s->n);
    return (free_limits){lower, upper};
}

/* Where inputs are held over intervals, all limits of these. */
RARE static void limit_free_inputs(const dims *s, const rumo_blocking *held, const rumo_bounds *bounds, free_limits *limits) {
    if (unblocked(s)) return;
    double *lower = (double *)limits->lower, *upper = (double *)limits->upper;
    for (int i = 0; i < s->n; ++i) {
        lower[i] = -INFINITY;
        upper[i] = INFINITY;
    }
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu; ++j) {
            const int own = block_at(s, held, k) * s->nu + j, i = k * s->nu + j;
            /* An input on the way from one block's value to the next is within limits if both are. */
            const int first = share_at(s, held, k) < 1.0 && own >= s->nu ? own - s->nu : own;
            for (int member = first; member <= own; member += s->nu) {
                lower[member] = fmax(lower[member], bounds->input_lower[i]);
                upper[member] = fmin(upper[member], bounds->input_upper[i]);
            }
        }
}

/* The last input decided, before the first free one. */
static inline const double *last_known(const dims *s, const stage_known *known) {
    return known->decided + (decided_inputs(s) - 1) * s->nu;
}

/* Put v, deviations from the guess, within bounds and move bounds; u (nb, nu) is scratch. */
RARE static void clip_free_inputs(const dims *s, const rumo_numbers *numbers, const free_limits *limits, const double *guess,
                                  const double *last, double *u, double *v) {
    const double *scale = numbers->input_scales;
    for (int i = 0; i < s->n; ++i) u[i] = guess[i] + scale[i % s->nu] * v[i];
    make_admissible(s->nu, last, limits->lower, limits->upper, numbers->block_lower, numbers->block_upper, s->nu, u, s->nb);
    for (int i = 0; i < s->n; ++i) v[i] = (u[i] - guess[i]) / scale[i % s->nu];
}

/* Whether inputs are worse than the guess: by how far they violate hard limits, else by cost. */
static inline int is_worse(double beyond, double cost, double beyond_guess, double cost_guess) {
    return fabs(beyond - beyond_guess) > RUMO_SLACK_TOLERANCE ? beyond > beyond_guess : !(cost <= cost_guess);
}

/* Whether changes of inputs are limited. */
static int limits_moves(const dims *s, const rumo_bounds *bounds) {
    int limited = 0;
    for (int j = 0; j < s->nu; ++j) limited |= isfinite(bounds->move_lower[j]) || isfinite(bounds->move_upper[j]);
    return limited;
}

#endif
