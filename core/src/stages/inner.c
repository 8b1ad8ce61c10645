/* What an interval's equations have for unknowns besides the state at its end, number k in lane k.
 *
 * The rows are those of the last substep: algebraic variables at the end, then what the scheme has inside; and then all
 * unknowns of the substeps before, one after the other. They are guessed, solved for and shifted like the states.
 */
#ifndef RUMO_INNER_C
#define RUMO_INNER_C

#include "stages/stages.h"

/* Unknown r of a substep. The state at the end of the last one is not among the rows: r >= nx there. */
static inline ptrdiff_t inner_row(const dims *s, int substep, int r) {
    const ptrdiff_t row = substep + 1 == s->m ? r - s->nx : s->nw - s->nx + (ptrdiff_t)substep * s->nw + r;
    return row * s->lanes;
}

/* All that the model is told about the guess at a substep. */
static guess_lanes at_substep(const stage_maps *m, int substep) {
    const dims *s = &m->s;
    const ptrdiff_t lanes = s->lanes, stride = s->lanes + LANES;
    guess_lanes in = {{m->x_lanes + 1, m->x_lanes, m->u_lanes, m->p_lanes, m->guess_inner},
                      {stride, stride, lanes, lanes, lanes}};
    if (substep > 0) {
        in.first[1] = s->explicit_scheme ? m->on_the_way : m->guess_inner + inner_row(s, substep - 1, 0);
        in.stride[1] = lanes;
    }
    if (substep + 1 < s->m && s->explicit_scheme) { /* residual F - 0 = F */
        in.first[0] = m->zeros;
        in.stride[0] = 0;
    } else if (substep + 1 < s->m) {
        in.first[0] = m->guess_inner + inner_row(s, substep, 0);
        in.stride[0] = lanes;
        in.first[4] = m->guess_inner + inner_row(s, substep, s->nx);
    }
    return in;
}

/* Rows (count, width) to lanes; lanes beyond them repeat the last row. */
static void to_lanes(const double *restrict rows, ptrdiff_t stride, int width, int count, int lanes, double *restrict to) {
    turn(rows, stride, count, width, to, lanes);
    for (int r = 0; r < width; ++r)
        for (int k = count; k < lanes; ++k) to[(ptrdiff_t)r * lanes + k] = rows[(count - 1) * stride + r];
}

/* A guess for a state at rest. */
static void guess_inner(stage_maps *m, const double *x) {
    const dims *s = &m->s;
    for (int i = 0; i < s->ni; ++i) {
        const int signal = m->problem->inner_signals[i];
        const double value = signal < s->nx ? x[signal] : m->problem->algebraic_guess[signal - s->nx];
        for (int k = 0; k < s->lanes; ++k) m->guess_inner[(ptrdiff_t)i * s->lanes + k] = value;
    }
}

/* From the deviations of states and inputs to the unknowns of the plan, by solving the equations again. */
static void solve_inner(const stage_maps *m, const double *dx, const double *du, double *restrict inner) {
    const dims *s = &m->s;
    double *const dw = m->equations.dw;
    for (int k = 0; k < s->lanes; ++k) {
        const int stage = k < s->N ? k : s->N - 1;
        for (int j = 0; j < s->m; ++j) {
            copy(m->known_lanes, j ? dw : dx + (ptrdiff_t)stage * s->ldx, s->nx);
            advance_unknowns(&m->equations, stage, j, m->known_lanes, du + stage * s->nu, dw);
            for (int r = j + 1 == s->m ? s->nx : 0; r < s->nw; ++r)
                inner[inner_row(s, j, r) + k] = m->guess_inner[inner_row(s, j, r) + k] + dw[r];
        }
    }
}

/* From the deviations of states and inputs to the unknowns of the plan. */
static void expand_inner(const stage_maps *m, const double *dx, const double *du, double *restrict inner) {
    const dims *s = &m->s;
    const int lanes = s->lanes;
    double *const known = m->known_lanes;
    if (s->ni == 0) return;
    if (is_wide(m)) {
        solve_inner(m, dx, du, inner);
        return;
    }
    to_lanes(dx, s->ldx, s->nx, s->N, lanes, known);
    to_lanes(du, s->nu, s->nu, s->N, lanes, known + (ptrdiff_t)s->nx * lanes);
    for (int j = 0; j < s->m; ++j) {
        const double *result = results_of(m, j);
        for (int r = j + 1 == s->m ? s->nx : 0; r < s->nw; ++r) {
            const ptrdiff_t row = inner_row(s, j, r);
            for (int first = 0; first < lanes; first += LANES) {
                double value[LANES];
                copy(value, m->guess_inner + row + first, LANES);
                for (int e = m->of_unknowns.start[r]; e < m->of_unknowns.start[r + 1]; ++e) {
                    const double *restrict a = result + (ptrdiff_t)e * lanes + first;
                    const double *restrict d = known + (ptrdiff_t)m->of_unknowns.column[e] * lanes + first;
                    for (int l = 0; l < LANES; ++l) value[l] += a[l] * d[l];
                }
                copy(inner + row + first, value, LANES);
            }
        }
        for (int r = 0; r < s->nx && j + 1 < s->m; ++r)
            for (int k = 0; k < lanes; ++k)
                known[(ptrdiff_t)r * lanes + k] = inner[inner_row(s, j, r) + k] - m->guess_inner[inner_row(s, j, r) + k];
    }
}

#endif
