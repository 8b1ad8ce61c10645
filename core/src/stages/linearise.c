/* From a guess to linear stages. */
#ifndef RUMO_LINEARISE_C
#define RUMO_LINEARISE_C

#include "base/blocks.h"
#include "base/clock.h"
#include "stages/compose.c"
#include "stages/eliminate.c"
#include "stages/inner.c"
#include "stages/stages.h"

/* The values of the blocks (nb, nu) of inputs (N, nu). */
static void values_of_blocks(const stage_maps *m, const double *u, double *values) {
    const dims *s = &m->s;
    const rumo_blocking *held = &m->problem->blocking;
    if (unblocked(s)) {
        copy(values, u + s->d * s->nu, s->n);
        return;
    }
    zero(values, s->n);
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu; ++j) values[block_at(s, held, k) * s->nu + j] += held->part[k] * u[k * s->nu + j];
}

/* Where inputs are held over blocks, hold those of the guess as well. */
static void hold_guess(stage_maps *m, const double *last) {
    const dims *s = &m->s;
    const rumo_blocking *held = &m->problem->blocking;
    if (unblocked(s)) return;
    values_of_blocks(m, m->guess_u, m->guess_values);
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu; ++j)
            m->guess_u[k * s->nu + j] = blocked_input(s, held, last, m->guess_values, k, j);
}

/* The guess, number k in lane k. */
static void load_guess(stage_maps *m) {
    const dims s = dims_of(&m->problem->sizes);
    to_lanes(m->guess_x, s.nx, s.nx, s.N + 1, s.lanes + LANES, m->x_lanes);
    to_lanes(m->guess_u, s.nu, s.nu, s.N, s.lanes, m->u_lanes);
}

/* Linearise all stages at the guess: model, constraints and derivatives, and the unknowns eliminated. `last` is the input
 * before the first free one. 0 if that gives no numbers, or if the clock comes to `end` before. */
APART static int linearise(stage_maps *m, const double *last, double end) {
    const rumo_problem *p = m->problem;
    const dims s = dims_of(&p->sizes);
    copy(m->guess_last, last, s.nu);
    hold_guess(m, last);
    load_guess(m);
    for (int j = 0; j < s.m; ++j) {
        if (is_over(end)) return 0;
        const guess_lanes in = at_substep(m, j);
        double *result = results_of(m, j);
        double *inside = m->terms + (ptrdiff_t)p->defect_first * s.lanes;
        if (j + 1 == s.m) {
            if (!evaluate(&p->tape, &in, s.lanes, m->registers, m->terms)) return 0;
        } else {
            if (!evaluate_inner(&p->inner_tape, &in, s.lanes, m->registers, m->terms)) return 0;
        }
        if (s.explicit_scheme && j + 1 < s.m) {
            copy(m->on_the_way, inside, s.nx * s.lanes);
            zero(inside, s.nx * s.lanes); /* it is where the next substep begins */
        }
        if (is_wide(m)) {
            if (!factor_equations(&m->equations, m->terms, j, m->correction, end)) return 0;
            continue;
        }
        if (!eliminate(&p->elimination, m->patterns, m->terms, s.lanes, m->lack, m->work, result, end)) return 0;
        if (s.m == 1) break;
        if (j == 0) {
            start_composition(&p->composition, result, s.lanes, m->maps);
            continue;
        }
        compose(&p->composition, result, m->maps, s.lanes, m->other_maps);
        double *const composed = m->other_maps;
        m->other_maps = m->maps;
        m->maps = composed;
    }
    return s.m == 1 || all_finite(m->maps, p->composition.entries * s.lanes);
}

#endif
