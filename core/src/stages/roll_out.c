/* Where the guess's inputs lead: Newton's method for all intervals at once. */
#ifndef RUMO_ROLL_OUT_C
#define RUMO_ROLL_OUT_C

#include "stages/defects.c"
#include "stages/linearise.c"

/* Sweeps at most, and the defects that are none, over the largest size of a state. */
#define SWEEPS 20
#define ROLLED_OUT 1e-9

/* The largest defect of any state, over the largest size of that state, or over 1. */
static double largest_defect(const stage_maps *m) {
    const dims *s = &m->s;
    double worst = 0.0;
    for (int r = 0; r < s->nx; ++r) {
        const double *c = defects_of(m, r);
        double size = 1.0;
        for (int k = 0; k <= s->N; ++k) size = larger(size, fabs(m->guess_x[k * s->nx + r]));
        for (int k = 0; c && k < s->N; ++k) worst = larger(worst, fabs(c[k]) / size);
    }
    return worst;
}

/* Solve the dynamics from the guess's first state with its inputs, and linearise there; 0 if that comes to nothing, and the
 * guess is nothing to go by then. For working: dx ((N + 1) ldx,), du (N nu,) and inner (ni, lanes). */
RARE static int roll_out(stage_maps *m, const double *last, double *dx, double *du, double *inner, double end) {
    const dims *s = &m->s;
    zero(du, s->N * s->nu);
    zero(dx, s->ldx);
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
        if (!linearise(m, last, end)) return 0;
        if (largest_defect(m) <= ROLLED_OUT) return 1;
        for (int k = 0; k < s->N; ++k) advance_guess_stage(m, k, dx + (ptrdiff_t)k * s->ldx, dx + (ptrdiff_t)(k + 1) * s->ldx);
        expand_inner(m, dx, du, inner);
        copy(m->guess_inner, inner, s->ni * s->lanes);
        for (int k = 1; k <= s->N; ++k)
            for (int r = 0; r < s->nx; ++r) m->guess_x[k * s->nx + r] += dx[(ptrdiff_t)k * s->ldx + r];
        if (!all_finite(m->guess_x, (s->N + 1) * s->nx)) return 0;
    }
    return 0;
}

#endif
