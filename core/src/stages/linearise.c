/* From a guess to a quadratic program that lacks only the measurement. */
#ifndef RUMO_LINEARISE_C
#define RUMO_LINEARISE_C

#include "base/clock.h"
#include "controller.h"
#include "guard/gate.c"
#include "stages/compose.c"
#include "stages/eliminate.c"
#include "stages/inner.c"
#include "stages/tape.c"
#include "solve/dense/condense.c"
#include "solve/active_set/working_set.c"

/* A constraint that all inputs' ranges move by less than this share of its scale is not imposed. */
#define NO_INFLUENCE 1e-10

/* A guess of a state at rest, with the last input decided. */
static void start_guess(rumo_controller *ctl, const double *x) {
    const dims *s = &ctl->s;
    for (int k = 0; k <= s->N; ++k) copy(ctl->guess_x + k * s->nx, x, s->nx);
    rest(&ctl->guard, ctl->guess_u);
    guess_inner(ctl, x);
    ctl->last_step = NAN;
    ctl->prepared = ctl->balanced = 0;
    clear_members(&ctl->q);
}

/* Input j of stage k, given the values of blocks and what comes before the first of them. */
static inline double blocked_input(const dims *s, const rumo_blocking *held, const double *before,
                                   const double *values, int k, int j) {
    const int own = block_at(s, held, k) * s->nu + j;
    const double share = share_at(s, held, k);
    return share < 1.0 ? share * values[own] + (1.0 - share) * (own < s->nu ? before[j] : values[own - s->nu])
                       : values[own];
}

/* Where inputs are held over blocks, hold those of the guess as well. */
static void hold_guess(rumo_controller *ctl) {
    const dims *s = &ctl->s;
    if (unblocked(s)) return;
    zero(ctl->guess_values, s->n);
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu; ++j)
            ctl->guess_values[block_at(s, &ctl->condensed.held, k) * s->nu + j] += ctl->condensed.held.part[k] * ctl->guess_u[k * s->nu + j];
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu; ++j)
            ctl->guess_u[k * s->nu + j] = blocked_input(s, &ctl->condensed.held, last_decided(&ctl->guard), ctl->guess_values, k, j);
}

/* The guess, number k in lane k. */
static void load_guess(rumo_controller *ctl) {
    const dims s = ctl->s;
    const int stride = s.lanes + LANES;
    for (int k = 0; k < stride; ++k) {
        const double *x = ctl->guess_x + (k < s.N ? k : s.N) * s.nx;
        for (int r = 0; r < s.nx; ++r) ctl->x_lanes[r * stride + k] = x[r];
    }
    to_lanes(ctl->guess_u, s.nu, s.nu, s.N, s.lanes, ctl->u_lanes);
}

/* Linearise all stages at the guess: model, constraints and derivatives, and the unknowns eliminated. */
APART static int linearize_stages(rumo_controller *ctl) {
    const dims s = dims_of(&ctl->problem.sizes);
    const rumo_problem *p = &ctl->problem;
    hold_guess(ctl);
    load_guess(ctl);
    for (int j = 0; j < s.m; ++j) {
        const guess_lanes in = at_substep(ctl, j);
        double *result = results_of(ctl, j);
        double *inside = ctl->terms + (ptrdiff_t)p->defect_first * s.lanes;
        if (j + 1 == s.m) {
            evaluate(&p->tape, &in, s.lanes, ctl->registers, ctl->terms);
            if (!all_finite(ctl->terms, p->sizes.slots * s.lanes)) return 0;
        } else {
            evaluate_inner(&p->inner_tape, &in, s.lanes, ctl->registers, ctl->terms);
            if (!all_finite(inside, (p->Cx.first - p->defect_first) * s.lanes)) return 0;
        }
        if (s.explicit_scheme && j + 1 < s.m) {
            copy(ctl->on_the_way, inside, s.nx * s.lanes);
            zero(inside, s.nx * s.lanes); /* it is where the next substep begins */
        }
        if (!ctl->balanced) {
            balance(&p->elimination, &p->M, ctl->terms, s.lanes, s.nw, ctl->block_of, ctl->unit);
            ctl->balanced = 1;
        }
        eliminate(&p->elimination, ctl->unit, ctl->terms, s.lanes, ctl->work, result);
        if (!all_finite(result, p->elimination.entries * s.lanes)) return 0;
        if (s.m == 1) break;
        if (j == 0) {
            start_composition(&p->composition, result, s.lanes, ctl->maps);
            continue;
        }
        compose(&p->composition, result, ctl->maps, s.lanes, ctl->other_maps);
        double *const composed = ctl->other_maps;
        ctl->other_maps = ctl->maps;
        ctl->maps = composed;
    }
    return s.m == 1 || all_finite(ctl->maps, p->composition.entries * s.lanes);
}

/* How far the guess is from satisfying the dynamics, over the reach of the inputs; but not where it is extrapolated. */
static double straying(const rumo_controller *ctl) {
    const dims *s = &ctl->s;
    double worst = 0.0;
    for (int r = 0; r < s->nx; ++r) {
        const int e = ctl->map.start[r + 1] - 1; /* the last entry of a row is c, if it has one */
        if (e < ctl->map.start[r] || ctl->map.column[e] != s->width - 1 || !(ctl->condensed.reach[r] > 0.0)) continue;
        double largest = 0.0;
        for (int k = 0; k + 1 < s->N; ++k) {
            const double size = fabs(ctl->maps[(ptrdiff_t)e * s->lanes + k]);
            largest = size > largest ? size : largest;
        }
        worst = fmax(worst, largest / ctl->condensed.reach[r]);
    }
    return worst;
}

/* Linearise, eliminate, condense, factor, and take over the working set of the step before, `shift` stages on. */
static int linearize(rumo_controller *ctl, int shift) {
    const dims s = dims_of(&ctl->problem.sizes);
    const double *scales = ctl->problem.numbers.input_scales;
    const int usable = linearize_stages(ctl);
    ctl->linearized_at = seconds_now();
    if (!usable) return 0;
    spread(&s, &ctl->map, ctl->map_row, ctl->maps, ctl->condensed.stages);
    respond(&s, &ctl->map, ctl->end_of_A, ctl->maps, scales, gate_stages(&s), &ctl->condensed);
    ctl->straying = straying(ctl);
    for (int k = s.d; k < s.N; ++k) {
        const int length = padded(inputs_at(&s, &ctl->condensed.held, k));
        for (int i = k * s.ny; i < (k + 1) * s.ny; ++i)
            measure(&s, &ctl->condensed, ctl->terms, k, i - k * s.ny, &ctl->Cx, &ctl->Cu, ctl->condensed.root_weights[i], scales,
                    ctl->condensed.outputs + (ptrdiff_t)i * s.ld);
        for (int i = k * s.nc; i < (k + 1) * s.nc; ++i) {
            double *row = ctl->condensed.rows + (ptrdiff_t)i * s.ld;
            measure(&s, &ctl->condensed, ctl->terms, k, i - k * s.nc, &ctl->D, &ctl->E, 1.0, scales, row);
            const double norm = sqrt(dot(row, row, length));
            ctl->imposed_now[i] = ctl->problem.imposed[i] && norm > NO_INFLUENCE * ctl->problem.numbers.constraint_scales[i - k * s.nc];
            ctl->q.weight[ctl->q.dense + i] = ctl->imposed_now[i] ? 1.0 / norm : 0.0;
        }
    }
    add_up_hessian(&s, ctl->problem.numbers.move_weights, scales, &ctl->condensed);
    if (!factorize(s.n, s.ld, ctl->condensed.hessian, ctl->condensed.factor, ctl->condensed.inverse, ctl->condensed.transpose)) return 0;
    shift &= unblocked(&s) && ctl->problem.shift.same_rows;
    renew_members(&ctl->q, shift * s.nu, shift * s.nc, ctl->imposed_now);
    return 1;
}

#endif
