/* What an interval's equations have for unknowns besides the state at its end, number k in lane k.
 *
 * The rows are those of the last substep: algebraic variables at the end, then what the scheme has inside; and then all
 * unknowns of the substeps before, one after the other. They are guessed, solved for and shifted like the states.
 */

/* Unknown r of a substep. The state at the end of the last one is not among the rows: r >= nx there. */
static inline ptrdiff_t inner_row(const dims *s, int substep, int r) {
    const ptrdiff_t row = substep + 1 == s->m ? r - s->nx : s->nw - s->nx + (ptrdiff_t)substep * s->nw + r;
    return row * s->lanes;
}

/* All that the model is told about the guess at a substep. */
static guess_lanes at_substep(const rumo_controller *c, int substep) {
    const dims *s = &c->s;
    const ptrdiff_t lanes = s->lanes, stride = s->lanes + LANES;
    guess_lanes in = {{c->x_lanes + 1, c->x_lanes, c->u_lanes, c->p_lanes, c->guess_inner},
                      {stride, stride, lanes, lanes, lanes}};
    if (substep > 0) {
        in.first[1] = s->explicit_scheme ? c->on_the_way : c->guess_inner + inner_row(s, substep - 1, 0);
        in.stride[1] = lanes;
    }
    if (substep + 1 < s->m && s->explicit_scheme) { /* residual F - 0 = F */
        in.first[0] = c->zeros;
        in.stride[0] = 0;
    } else if (substep + 1 < s->m) {
        in.first[0] = c->guess_inner + inner_row(s, substep, 0);
        in.stride[0] = lanes;
        in.first[4] = c->guess_inner + inner_row(s, substep, s->nx);
    }
    return in;
}

/* Rows (count, width) to lanes; lanes beyond them repeat the last row. */
static void to_lanes(const double *restrict rows, ptrdiff_t stride, int width, int count, int lanes, double *restrict to) {
    for (int k = 0; k < lanes; ++k) {
        const double *row = rows + (k < count ? k : count - 1) * stride;
        for (int r = 0; r < width; ++r) to[(ptrdiff_t)r * lanes + k] = row[r];
    }
}

/* A guess for a state at rest. */
static void guess_inner(rumo_controller *c, const double *x) {
    const dims *s = &c->s;
    for (int i = 0; i < s->ni; ++i) {
        const int signal = c->problem.inner_signals[i];
        const double value = signal < s->nx ? x[signal] : c->problem.algebraic_guess[signal - s->nx];
        for (int k = 0; k < s->lanes; ++k) c->guess_inner[(ptrdiff_t)i * s->lanes + k] = value;
    }
}

/* Copy the algebraic variables into the plan's numbers. */
static void show_algebraic(const rumo_controller *c) {
    const dims *s = &c->s;
    for (int k = 0; k < s->N; ++k)
        for (int i = 0; i < s->nz; ++i) plan_z(c)[k * s->nz + i] = c->inner[(ptrdiff_t)i * s->lanes + k];
}

/* Make other values those of the plan. */
static void take_inner(const rumo_controller *c, const double *inner) {
    copy(c->inner, inner, c->s.ni * c->s.lanes);
    show_algebraic(c);
}

/* From the deviations of states and inputs to the unknowns of the plan. */
static void expand_inner(rumo_controller *c) {
    const dims *s = &c->s;
    const int lanes = s->lanes;
    if (s->ni == 0) return;
    to_lanes(c->dx, s->ldx, s->nx, s->N, lanes, c->dx_lanes);
    to_lanes(c->du, s->nu, s->nu, s->N, lanes, c->du_lanes);
    for (int j = 0; j < s->m; ++j) {
        const double *result = results_of(c, j);
        for (int r = j + 1 == s->m ? s->nx : 0; r < s->nw; ++r) {
            const ptrdiff_t row = inner_row(s, j, r);
            double *restrict value = c->inner + row;
            copy(value, c->guess_inner + row, lanes);
            for (int e = c->of_unknowns.start[r]; e < c->of_unknowns.start[r + 1]; ++e) {
                const int column = c->of_unknowns.column[e];
                const double *restrict a = result + (ptrdiff_t)e * lanes;
                const double *restrict d = column < s->nx           ? c->dx_lanes + (ptrdiff_t)column * lanes
                                           : column < s->nx + s->nu ? c->du_lanes + (ptrdiff_t)(column - s->nx) * lanes
                                                                    : NULL;
                for (int k = 0; k < lanes; ++k) value[k] += d ? a[k] * d[k] : a[k];
            }
        }
        for (int r = 0; r < s->nx && j + 1 < s->m; ++r)
            for (int k = 0; k < lanes; ++k)
                c->dx_lanes[(ptrdiff_t)r * lanes + k] =
                    c->inner[inner_row(s, j, r) + k] - c->guess_inner[inner_row(s, j, r) + k];
    }
    show_algebraic(c);
}

/* On the straight line between the states at two stages. */
static inline double between(const double *x, int nx, int signal, double node) {
    return (1.0 - node) * x[signal] + node * x[nx + signal];
}

/* One sample later: values of states keep their distance from the straight line between the ends of their interval. */
static void shift_inner(const rumo_controller *c) {
    const dims *s = &c->s;
    for (int i = 0; i < s->ni; ++i) {
        const double *from = c->inner + (ptrdiff_t)i * s->lanes, node = c->problem.inner_nodes[i];
        double *to = c->previous_inner + (ptrdiff_t)i * s->lanes;
        const int signal = c->problem.inner_signals[i];
        for (int k = 0; k < s->lanes; ++k) {
            const int here = k < s->N ? k : s->N - 1, j = c->problem.shift.intervals[here];
            to[k] = from[j];
            if (signal >= s->nx) continue;
            const double moved = between(c->previous_x + here * s->nx, s->nx, signal, node) +
                                 (from[j] - between(plan_x(c) + j * s->nx, s->nx, signal, node));
            if (isfinite(moved)) to[k] = moved;
        }
    }
}
