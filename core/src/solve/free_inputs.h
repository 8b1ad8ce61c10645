/* Limits of the free inputs. */
#ifndef RUMO_FREE_INPUTS_H
#define RUMO_FREE_INPUTS_H

#include "base/arena.h"
#include "base/blocks.h"

typedef struct free_limits {
    const double *lower, *upper; /* (nb, nu); a view where inputs are not held */
} free_limits;

RARE static free_limits lay_out_limits(arena *a, const dims *s, const rumo_bounds *own) {
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

/* Whether changes of inputs are limited. */
static int limits_moves(const dims *s, const rumo_bounds *bounds) {
    int limited = 0;
    for (int j = 0; j < s->nu; ++j) limited |= isfinite(bounds->move_lower[j]) || isfinite(bounds->move_upper[j]);
    return limited;
}

#endif
