/* The structured solver's part that needs no measurement. */
#ifndef RUMO_RICCATI_PREPARE_C
#define RUMO_RICCATI_PREPARE_C

#include "solve/riccati/space.c"

/* Products of two entries of the same output. */
RARE static int most_terms(const dims *s, const rumo_pattern *Cx, const rumo_pattern *Cu) {
    const int of_v = unblocked(s) ? 1 : 2;
    int most = 0;
    for (int i = 0; i < s->ny; ++i) {
        int entries = 0;
        for (int e = 0; e < Cx->count; ++e) entries += Cx->row[e] == i;
        for (int e = 0; e < Cu->count; ++e) entries += of_v * (Cu->row[e] == i);
        most += entries * (entries + 1) / 2;
    }
    return most;
}

RARE static void place_terms(const dims *s, const layout *p, riccati *r) {
    const node_rows *n = &r->outputs;
    r->term_count = 0;
    for (int i = 0; i < s->ny; ++i)
        for (int a = n->start[i]; a < n->start[i + 1]; ++a)
            for (int b = n->start[i]; b < n->start[i + 1]; ++b)
                if (n->entry[b] <= n->entry[a])
                    r->terms[r->term_count++] = (curvature_term){r->output_curvature + (ptrdiff_t)i * s->lanes, n->value[a],
                                                                 n->value[b], n->entry[a] * p->ld + n->entry[b]};
}

RARE static void riccati_lay_out(arena *a, void *self, const rumo_problem *own, const rumo_problem *given) {
    riccati *const r = (riccati *)self;
    const dims s = r->s = dims_of(&given->sizes);
    const layout p = layout_of(&s);
    const ptrdiff_t lanes = s.lanes, nodes = (ptrdiff_t)(s.N + 1) * p.ld, square = (ptrdiff_t)in_fours(p.zeta) * p.ld;
    r->problem = own;
    r->limits = lay_out_limits(a, &s, &own->numbers.bounds);
    r->stages = alloc_doubles(a, lanes * (p.rows + p.columns) * p.ld);
    r->scaled = alloc_doubles(a, (1 + s.rows * s.nu) * lanes);
    r->laid = (laid_entries *)alloc(a, (size_t)most_laid(&s, &p) * sizeof *r->laid);
    r->gains = alloc_doubles(a, (ptrdiff_t)s.N * s.nu * p.ld);
    r->roots = alloc_doubles(a, padded(s.N * s.nu * s.nu));
    r->kept = alloc_doubles(a, p.ld);
    r->of_v = alloc_doubles(a, p.ld);
    r->unit = alloc_doubles(a, s.nu * p.ld);
    double **const squares[] = {&r->P, &r->next_P, &r->covariance, &r->half, &r->closed};
    for (size_t i = 0; i < sizeof squares / sizeof *squares; ++i) *squares[i] = alloc_doubles(a, square);
    double **const by_nodes[] = {&r->Pc, &r->zeta, &r->nodes};
    for (size_t i = 0; i < sizeof by_nodes / sizeof *by_nodes; ++i) *by_nodes[i] = alloc_doubles(a, nodes);
    r->T = alloc_doubles(a, (ptrdiff_t)p.zeta * p.ld);
    r->H = alloc_doubles(a, s.nu * p.ld);
    r->factor = alloc_doubles(a, s.nu * s.nu);
    double **const by_input[] = {&r->inverse, &r->input_slope, &r->largest_curvature, &r->largest_force, &r->largest_slope};
    for (size_t i = 0; i < sizeof by_input / sizeof *by_input; ++i) *by_input[i] = alloc_doubles(a, s.nu);
    r->move_curvature = alloc_doubles(a, s.N * s.nu);
    r->pins = alloc_ints(a, s.N * s.nu);
    r->pin_slopes = alloc_doubles(a, s.N * s.nu);
    r->output_curvature = alloc_doubles(a, s.ny * lanes);
    r->terms = (curvature_term *)alloc(a, (size_t)most_terms(&s, &given->Cx, &given->Cu) * sizeof *r->terms);
    r->zeta_lanes = alloc_doubles(a, p.zeta * lanes);
    r->slope_lanes = alloc_doubles(a, p.zeta * lanes);
    double **const by_lanes[] = {&r->change_lanes, &r->moves};
    for (size_t i = 0; i < sizeof by_lanes / sizeof *by_lanes; ++i) *by_lanes[i] = alloc_doubles(a, s.nu * lanes);
    r->force = alloc_doubles(a, lanes);
    r->row = alloc_doubles(a, p.ld);
    r->out = alloc_doubles(a, p.ld);
    for (int i = 0; i < 2; ++i) r->reach_products[i] = alloc_doubles(a, (ptrdiff_t)s.nx * p.ld);
    double **const by_free_input[] = {&r->best, &r->other, &r->inputs};
    for (size_t i = 0; i < sizeof by_free_input / sizeof *by_free_input; ++i) *by_free_input[i] = alloc_doubles(a, s.n);
    lay_out_node_rows(a, &s, s.ny, given->Cx.count, given->Cu.count, &r->outputs);
    lay_out_node_rows(a, &s, s.nc, given->D.count, given->E.count, &r->constraints);
    alloc_qp(a, &r->q, &riccati_space, s.n, (2 * s.nu + s.nc) * s.lanes, 2 * s.nu * s.lanes);
    r->pi = alloc_doubles(a, (ptrdiff_t)r->q.room * p.ld);
    r->gamma = alloc_doubles(a, r->q.room);
    if (r->q.room < r->q.capacity) lay_out_chain(a, r, &s, &p);
    r->conflict = (rumo_conflict *)alloc(a, (size_t)r->q.capacity * sizeof *r->conflict);
    if (a->base) lay_out_inputs(&s, &p, &own->blocking, r);
}

/* What changes of the inputs cost, by their squares. */
RARE static void curve_moves(riccati *r) {
    const dims *s = &r->s;
    const rumo_numbers *p = &r->problem->numbers;
    for (int k = s->d; k < s->N; ++k)
        for (int j = 0; j < s->nu && begins(s, &r->problem->blocking, k); ++j) {
            const double weight = p->move_weights[block_at(s, &r->problem->blocking, k) * s->nu + j];
            r->move_curvature[k * s->nu + j] = 2.0 * weight * p->input_scales[j] * p->input_scales[j] + 2.0 * r->damping;
        }
}

RARE static void riccati_damp(void *self, double damping) {
    riccati *const r = (riccati *)self;
    if (damping != r->damping) r->norms_at = -1; /* of the closed loop, which is another */
    r->damping = damping;
    curve_moves(r);
}

/* What the solver keeps in another form. */
RARE static void riccati_renumber(void *self) {
    riccati *const r = (riccati *)self;
    const dims *s = &r->s;
    const rumo_numbers *p = &r->problem->numbers;
    qp *q = &r->q;
    const int limited = limits_moves(s, &p->bounds);
    const int fresh = q->weight[0] == 0.0 || r->limited != limited;
    r->limited = limited;
    q->first_soft = (limited ? 2 : 1) * s->nu * s->lanes;
    q->rows = q->first_soft + s->nc * s->lanes;
    for (int i = 0; fresh && i < q->places; ++i) {
        q->lower[i] = q->floor[i] = -INFINITY;
        q->upper[i] = q->ceiling[i] = q->l1[i] = INFINITY;
        q->l2[i] = 0.0;
        q->weight[i] = i < s->nu * s->lanes ? 1.0 : 0.70710678118654752440;
    }
    for (int k = s->d; k < s->N; ++k) {
        for (int i = 0; i < s->ny; ++i) r->output_curvature[i * s->lanes + k] = 2.0 * p->output_weights[k * s->ny + i];
    }
    curve_moves(r);
    for (int i = 0; i < s->nc * s->lanes; ++i) {
        q->l1[q->first_soft + i] = p->l1[i / s->lanes];
        q->l2[q->first_soft + i] = p->l2[i / s->lanes];
    }
    if (fresh) r->norms_at = -1;
    limit_free_inputs(s, &r->problem->blocking, &p->bounds, &r->limits);
}

static void riccati_forget(void *self) {
    riccati *const r = (riccati *)self;
    clear_members(&r->q);
    r->norms_at = -1;
}

/* The row that a member is after the horizon has been prepared again, `shift` stages on. */
static int riccati_becomes(const qp *q, int row) {
    const riccati *r = (const riccati *)q;
    const stage_limit of = limited_by(r, row);
    const int k = of.k - r->shift;
    if (k < r->s.d || (of.kind == RUMO_PATH_CONSTRAINT && !r->problem->imposed[k * r->s.nc + of.index])) return -1;
    return row - r->shift;
}

/* A limit that held at the end of the horizon holds there again, as a first guess: it leaves for less than it costs to join. */
static void repeat_last(riccati *r) {
    qp *q = &r->q;
    for (int i = 0, members = q->count; q->kept && i < members && q->count < q->room; ++i) {
        const int before = q->member[i], row = before + r->shift;
        const stage_limit of = limited_by(r, row);
        if (of.k != r->s.N - 1) continue;
        if (of.kind == RUMO_PATH_CONSTRAINT && !r->problem->imposed[of.k * r->s.nc + of.index]) continue;
        take_over(q, row, (row_state)q->state[before], q->mu[i]);
    }
}

/* By a sweep back from the stage; over more stages than the gate asks for, only as far as there is time. */
static void riccati_reach(void *self, int stages, double *restrict reach) {
    riccati *const r = (riccati *)self;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const int from = p.B / 4 * 4, width = in_fours(p.c);
    const double *rows = rows_of_stage(r, &p, stages - 1);
    double *restrict sum = r->half;
    zero(sum, s.nx * p.ld);
    for (int k = stages - 1; k >= s.d; --k) {
        if (stages > RUMO_GATE_STAGES && is_over(r->q.end)) break;
        double *next = r->reach_products[k % 2];
        if (k < stages - 1) {
            product(rows, p.ld, 1, s.nx, rows_of_stage(r, &p, k), p.ld, p.rows, next, width, nothing_else);
            rows = next;
        }
        /* Whole vectors, from the one with the first column of G on. */
        for (int i = 0; i < s.nx && begins(&s, &r->problem->blocking, k); ++i)
            add_sizes(sum + i * p.ld + from, rows + i * p.ld + from, width - from);
    }
    for (int i = 0; i < s.nx; ++i) {
        reach[i] = 0.0;
        for (int j = 0; j < s.nu; ++j) reach[i] += sum[i * p.ld + p.B + j];
    }
}

OUTSIDE static int riccati_prepare(void *self, const stage_maps *m, int shift, double end) {
    riccati *const r = (riccati *)self;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    if (!r->maps) {
        place_entries(&s, &p, m, r);
        place_node_rows(&s, &p, m, &m->Cx, &m->Cu, &r->outputs);
        place_node_rows(&s, &p, m, &m->D, &m->E, &r->constraints);
        place_terms(&s, &p, r);
    }
    r->maps = m;
    mix_node_rows(&s, m, &m->Cu, r->problem->numbers.input_scales, &r->outputs);
    mix_node_rows(&s, m, &m->E, r->problem->numbers.input_scales, &r->constraints);
    lay_stages(r, m);
    r->q.end = end;
    if (!factorise_stages(r)) return 0;
    const int all = r->norms_at < 0;
    refresh_norms(r, all ? s.N - s.d : (s.N - s.d + NORM_SAMPLES - 1) / NORM_SAMPLES);
    if (all && is_over(end)) r->norms_at = -1;
    r->shift = shift && unblocked(&s) && r->problem->shift.same_rows;
    renew_members(&r->q, riccati_becomes);
    if (r->shift) repeat_last(r);
    return !is_over(end);
}

#endif
