/* The horizon as a program of the active-set method: rows are bounds, changes and constraints of all stages, that of stage k in
 * lane k. */
#ifndef RUMO_SPACE_C
#define RUMO_SPACE_C

#include "solve/riccati/chain.c"
#include "solve/riccati/norms.c"
#include "solve/riccati/sweeps.c"

static int riccati_transform(qp *q, int position) {
    riccati *const r = (riccati *)q;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const stage_limit of = limited_by(r, q->member[position]);
    const int place = place_of(q, position), path = of.kind == RUMO_PATH_CONSTRAINT;
    double *pi = r->pi + (ptrdiff_t)place * p.ld, *gamma = r->gamma + place;
    zero(r->row, p.ld);
    if (path) add_node_row(&r->constraints, of.index, of.k, 1.0, r->row);
    else r->row[p.v + of.index] = 1.0;
    const double size = sweep_row(r, of.k, of.kind == RUMO_MOVE_BOUND ? of.index : -1, moved(q, position), pi, gamma);
    if (path && !(size > NO_INFLUENCE * r->problem->numbers.constraint_scales[of.index])) return 0;
    q->extent[place] = padded(inputs_at(&s, &r->problem->blocking, of.k));
    q->base[place] = *gamma + dot(pi, r->zeta + s.d * p.ld, p.ld);
    return 1;
}

/* Lanes of zeta at the ends of stages to nodes, and back. */
static void to_nodes(const dims *s, const layout *p, const double *restrict lanes, double *restrict nodes) {
    turn(lanes + s->d, s->lanes, p->zeta, s->N - s->d, nodes + (s->d + 1) * p->ld, p->ld);
}

static void from_nodes(const dims *s, const layout *p, const double *restrict nodes, double *restrict lanes) {
    turn(nodes + (s->d + 1) * p->ld, p->ld, s->N - s->d, p->zeta, lanes + s->d, s->lanes);
}

/* Values of all rows along zeta, which is kept in lanes too. */
static void riccati_values(riccati *r) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    qp *q = &r->q;
    from_nodes(&s, &p, r->zeta, r->zeta_lanes);
    for (int j = 0; j < s.nu; ++j) {
        const double *v = r->zeta_lanes + (ptrdiff_t)(p.v + j) * s.lanes;
        double *change = r->change_lanes + (ptrdiff_t)j * s.lanes;
        copy(q->value + j * s.lanes, v, s.lanes);
        change[s.d] = v[s.d] - r->zeta[s.d * p.ld + p.v + j];
        for (int k = s.d + 1; k < s.N; ++k) change[k] = v[k] - v[k - 1];
        if (r->limited) copy(q->value + (s.nu + j) * s.lanes, change, s.lanes);
    }
    for (int i = 0; i < s.nc; ++i) {
        double *value = q->value + q->first_soft + i * s.lanes;
        zero(value, s.lanes);
        add_node_values(&r->constraints, i, r->zeta_lanes, s.lanes, value);
    }
}

/* Slopes at the nodes of cost and forces along zeta: outputs' errors, changes of inputs, members and saturated rows. */
static void slope_at_nodes(riccati *r, int members) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const stage_maps *m = r->maps;
    qp *q = &r->q;
    zero(r->slope_lanes, p.zeta * s.lanes);
    double *force = r->force;
    for (int i = 0; i < s.ny; ++i) {
        const double *y = m->terms + (ptrdiff_t)(r->problem->y_first + i) * s.lanes;
        zero(force, s.lanes);
        add_node_values(&r->outputs, i, r->zeta_lanes, s.lanes, force);
        for (int k = s.d; k < s.N; ++k) {
            const double error = force[k] + y[k] - r->known->reference[(k + 1) * s.ny + i];
            force[k] = r->output_curvature[i * s.lanes + k] * error;
        }
        add_node_forces(&r->outputs, i, force, s.lanes, r->slope_lanes);
    }
    const double *forces = q->forces;
    gather_forces(q, members);
    for (int i = 0; (members || q->saturated) && i < s.nc; ++i)
        add_node_forces(&r->constraints, i, forces + q->first_soft + i * s.lanes, s.lanes, r->slope_lanes);
    for (int j = 0; j < s.nu; ++j) {
        double *by_v = r->slope_lanes + (ptrdiff_t)(p.v + j) * s.lanes;
        const double *bound = forces + j * s.lanes, *by_change = forces + (s.nu + j) * s.lanes;
        double later = 0.0;
        for (int k = s.N - 1; k >= s.d; --k) {
            const double change = r->moves[j * s.lanes + k] + r->change_lanes[j * s.lanes + k];
            const double now = r->move_curvature[k * s.nu + j] * change + (r->limited ? by_change[k] : 0.0);
            by_v[k] += bound[k] + now - later;
            later = now;
        }
    }
    to_nodes(&s, &p, r->slope_lanes, r->nodes);
}

static void riccati_evaluate(qp *q) {
    riccati *const r = (riccati *)q;
    sweep_forward(r, q->w);
    riccati_values(r);
}

static void riccati_start(qp *q) {
    riccati *const r = (riccati *)q;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    zero(r->zeta_lanes, p.zeta * s.lanes);
    zero(r->change_lanes, s.nu * s.lanes);
    if (r->pinned) {
        zero(q->w, q->ld);
        riccati_evaluate(q);
    }
    slope_at_nodes(r, 0);
    sweep_back(r, !r->pinned, q->w);
    for (int i = 0; i < q->ld; ++i) q->w[i] = -q->w[i];
}

static double riccati_correct(qp *q, const double *step) {
    riccati *const r = (riccati *)q;
    axpy(q->w, 1.0, step, q->ld);
    const double largest = sweep_step(r, step);
    riccati_values(r);
    return largest;
}

static double riccati_slope(qp *q, double *rest) {
    riccati *const r = (riccati *)q;
    slope_at_nodes(r, 1);
    return sweep_back(r, 0, rest);
}

/* By a sweep back in open loop: what a row does through the feedback that it is given in w is no measure of it. */
static double riccati_size_of(qp *q, const double *parts, int members, double *at_zero) {
    riccati *const r = (riccati *)q;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    double *h = r->row, *by_inputs = r->input_slope, size = 0.0;
    zero(r->nodes, (s.N + 1) * p.ld);
    for (int i = 0; i < members; ++i) {
        const stage_limit of = limited_by(r, q->member[i]);
        double *node = r->nodes + (ptrdiff_t)(of.k + 1) * p.ld;
        if (of.kind == RUMO_PATH_CONSTRAINT) add_node_row(&r->constraints, of.index, of.k, parts[i], node);
        else node[p.v + of.index] += parts[i];
        if (of.kind == RUMO_MOVE_BOUND && of.k > s.d) node[p.v + of.index - p.ld] -= parts[i];
    }
    zero(h, p.ld);
    *at_zero = 0.0;
    for (int k = s.N - 1; k >= s.d; --k) {
        axpy(h, 1.0, r->nodes + (ptrdiff_t)(k + 1) * p.ld, p.ld);
        *at_zero += back_stage(r, &s, &p, k, h, NULL, by_inputs, NULL);
        for (int j = 0; begins(&s, &r->problem->blocking, k) && j < s.nu; ++j) {
            if (r->pinned && r->pins[k * s.nu + j]) *at_zero += by_inputs[j] * kept_at(r, &s, k, j);
            else size += fabs(by_inputs[j]);
        }
    }
    *at_zero += dot(h, r->zeta + s.d * p.ld, p.ld);
    return size;
}

static const qp_space riccati_space = {.start = riccati_start,         .evaluate = riccati_evaluate, .correct = riccati_correct,
                                       .transform = riccati_transform, .slope = riccati_slope,       .size_of = riccati_size_of,
                                       .condition = chain_condition,   .solve = chain_solve,         .combine = chain_combine,
                                       .project = chain_project};

#endif
