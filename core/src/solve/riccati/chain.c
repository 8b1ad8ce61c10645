/* Working sets of any size, without m and L of each member: everything by sweeps, in time and memory linear in N.
 *
 * w is to the stages in closed loop what noise is to a chain of random vectors, and a member what a measurement is: of
 * something that is a sum of noise, M w. Then M M' + E is the covariance of the measurements, with the compliance of a row as
 * noise of its own, and a Kalman filter factors it: L D L' with D the variances of what is new in each measurement, and L
 * from the gains.
 *
 * Source: Kailath, Sayed and Hassibi (2000), Linear Estimation, for the factors that a filter makes.
 */
#ifndef RUMO_CHAIN_C
#define RUMO_CHAIN_C

#include "solve/riccati/factorise.c"

/* A compliance that is more than rounding next to what inputs do to a row. */
#define DISTINCT_COMPLIANCE 1e-13

RARE static void lay_out_chain(arena *a, riccati *r, const dims *s, const layout *p) {
    chain *c = &r->chain;
    c->size = p->zeta + s->nu;
    c->ld = padded(c->size);
    c->loop = alloc_doubles(a, (ptrdiff_t)s->N * p->zeta * c->ld);
    c->noise = alloc_doubles(a, (ptrdiff_t)s->N * s->nu * c->ld);
    c->S = alloc_doubles(a, (ptrdiff_t)(s->N + 1) * c->size * c->ld);
    c->half = alloc_doubles(a, (ptrdiff_t)p->zeta * c->ld);
    c->gain = alloc_doubles(a, (ptrdiff_t)r->q.places * c->ld);
    c->pivot = alloc_doubles(a, r->q.places);
    c->share = alloc_doubles(a, r->q.places);
    double **const vectors[] = {&c->now, &c->next, &c->from};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; ++i) *vectors[i] = alloc_doubles(a, c->ld);
    c->position = alloc_ints(a, r->q.places);
    c->held = alloc_ints(a, r->q.places);
}

static inline double *loop_of(const chain *c, const layout *p, int k) { return c->loop + (ptrdiff_t)k * p->zeta * c->ld; }

static inline double *noise_of(const chain *c, const dims *s, int k) { return c->noise + (ptrdiff_t)k * s->nu * c->ld; }

/* Columns of a stage in closed loop. */
static void lay_link(riccati *r, const dims *s, const layout *p, int k) {
    chain *c = &r->chain;
    double *restrict loop = loop_of(c, p, k), *restrict noise = noise_of(c, s, k);
    const double *restrict gains = r->gains + (ptrdiff_t)k * s->nu * p->ld, *restrict roots = r->roots + (ptrdiff_t)k * s->nu * s->nu;
    const double *restrict fresh = columns_of_stage(r, p, k) + p->moving * p->ld;
    const int begin = begins(s, &r->problem->blocking, k);
    close_loop(r, k);
    for (int i = 0; i < p->zeta; ++i) {
        copy(loop + i * c->ld, r->closed + i * p->ld, p->zeta);
        for (int j = 0; j < s->nu; ++j)
            loop[i * c->ld + p->zeta + j] = begin ? gains[j * p->ld + i] - r->unit[j * p->ld + i] : 0.0;
    }
    zero(noise, s->nu * c->ld);
    for (int i = 0; begin && i < s->nu; ++i)
        for (int j = 0; j <= i; ++j) {
            const double root = roots[j * s->nu + i];
            for (int l = 0; l < p->zeta; ++l) noise[i * c->ld + l] += root * fresh[j * p->ld + l];
            noise[i * c->ld + p->zeta + j] = root;
        }
}

/* y += scale a, for a row's a over what is at its stage's end. */
static void add_limit(const riccati *r, const layout *p, const stage_limit *of, double scale, double *restrict y) {
    if (of->kind == RUMO_PATH_CONSTRAINT) add_node_row(&r->constraints, of->index, of->k, scale, y);
    else y[(of->kind == RUMO_INPUT_BOUND ? p->v : p->zeta) + of->index] += scale;
}

static double limited_value(const riccati *r, const layout *p, const stage_limit *of, const double *restrict x) {
    const node_rows *n = &r->constraints;
    double value = 0.0;
    if (of->kind != RUMO_PATH_CONSTRAINT) return x[(of->kind == RUMO_INPUT_BOUND ? p->v : p->zeta) + of->index];
    for (int e = n->start[of->index]; e < n->start[of->index + 1]; ++e) value += n->value[e][of->k] * x[n->entry[e]];
    return value;
}

/* S a of a row at a node. */
static void covariance_with(const riccati *r, const layout *p, const stage_limit *of, const double *restrict S,
                            double *restrict y) {
    const chain *c = &r->chain;
    const node_rows *n = &r->constraints;
    if (of->kind != RUMO_PATH_CONSTRAINT) {
        copy(y, S + (ptrdiff_t)((of->kind == RUMO_INPUT_BOUND ? p->v : p->zeta) + of->index) * c->ld, c->ld);
        return;
    }
    zero(y, c->ld);
    for (int e = n->start[of->index]; e < n->start[of->index + 1]; ++e)
        axpy(y, n->value[e][of->k], S + (ptrdiff_t)n->entry[e] * c->ld, c->ld);
}

/* The covariance at a stage's end from that at its beginning. */
static double *advance_link(riccati *r, const dims *s, const layout *p, int k) {
    chain *c = &r->chain;
    const double *loop = loop_of(c, p, k), *noise = noise_of(c, s, k), *S = c->S + (ptrdiff_t)k * c->size * c->ld;
    double *next = c->S + (ptrdiff_t)(k + 1) * c->size * c->ld;
    const int size = r->limited ? c->size : p->zeta, width = in_fours(size);
    product(S, c->ld, 1, p->zeta, loop, c->ld, p->zeta, c->half, width, nothing_else);
    product(loop, 1, c->ld, size, c->half, c->ld, p->zeta, next, width, nothing_else);
    product(noise, 1, c->ld, size, noise, c->ld, s->nu, next, width, what_is_there);
    return next;
}

/* The stages in closed loop, and variances of all rows. */
static void lay_chain(riccati *r, const dims *s, const layout *p) {
    chain *c = &r->chain;
    if (c->laid) return;
    c->laid = 1;
    zero(c->S + (ptrdiff_t)s->d * c->size * c->ld, c->size * c->ld);
    for (int k = s->d; k < s->N; ++k) {
        lay_link(r, s, p, k);
        const double *S = advance_link(r, s, p, k);
        for (int row = k; row < r->q.rows; row += s->lanes) {
            const stage_limit of = limited_by(r, row);
            covariance_with(r, p, &of, S, c->from);
            r->q.square[row] = limited_value(r, p, &of, c->from);
        }
    }
    for (int row = 0; row < r->q.rows; ++row) c->held[row] = -1; /* neither a state nor none */
}

/* Where members are, by rows. */
static void place_members(riccati *r, int members) {
    int *position = r->chain.position;
    for (int row = 0; row < r->q.rows; ++row) position[row] = -1;
    for (int i = 0; i < members; ++i) position[r->q.member[i]] = i;
}

/* The first stage whose members are others than those in the gains, or as many as there are stages. */
static int first_changed(riccati *r, const dims *s) {
    const qp *q = &r->q;
    int *restrict held = r->chain.held, first = s->N;
    for (int row = 0; row < q->rows; ++row) {
        const int k = row % s->lanes, state = r->chain.position[row] < 0 ? INACTIVE : q->state[row];
        if (state != held[row] && k >= s->d && k < first) first = k;
        held[row] = state;
    }
    return first;
}

/* Take a row as known: what is left of the covariance. */
static void measure_row(riccati *r, const layout *p, int row, double *restrict S) {
    chain *c = &r->chain;
    const stage_limit of = limited_by(r, row);
    const double soft = compliance(&r->q, row), whole = r->q.square[row] + soft;
    double *restrict from = c->from, *restrict gain = c->gain + (ptrdiff_t)row * c->ld;
    covariance_with(r, p, &of, S, from);
    const double variance = larger(limited_value(r, p, &of, from), 0.0) + soft;
    /* A row that gives way depends on none. */
    c->share[row] = soft > DISTINCT_COMPLIANCE * whole ? 1.0 : whole > 0.0 ? variance / whole : 0.0;
    const int independent = c->share[row] > NO_SHARE;
    c->pivot[row] = independent ? variance : INFINITY; /* else its multiplier stays as it is */
    for (int l = 0; l < c->ld; ++l) gain[l] = independent ? from[l] / variance : 0.0;
    for (int i = 0; independent && i < c->size; ++i) axpy(S + (ptrdiff_t)i * c->ld, -gain[i], from, c->ld);
}

static double chain_condition(qp *q, int members, int *weakest) {
    riccati *const r = (riccati *)q;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const chain *c = &r->chain;
    double least = 1.0;
    *weakest = -1;
    lay_chain(r, &s, &p);
    place_members(r, members);
    for (int k = first_changed(r, &s); k < s.N; ++k) {
        double *S = advance_link(r, &s, &p, k);
        for (int row = k; row < q->rows; row += s.lanes)
            if (c->position[row] >= 0) measure_row(r, &p, row, S);
    }
    for (int i = 0; i < members; ++i) {
        if (c->share[q->member[i]] >= least) continue;
        least = c->share[q->member[i]];
        *weakest = i;
    }
    return least;
}

/* From what is at a stage's beginning to its end. */
static void forward_link(const riccati *r, const dims *s, const layout *p, int k, const double *w) {
    const chain *c = &r->chain;
    combine_rows(c->now, loop_of(c, p, k), c->ld, p->zeta, c->next, 0);
    if (w) combine_rows(w + block_at(s, &r->problem->blocking, k) * s->nu, noise_of(c, s, k), c->ld, s->nu, c->next, 1);
}

/* Slopes by what is at a stage's end become those by its beginning; those by w are added to a sum. */
static void back_link(const riccati *r, const dims *s, const layout *p, int k, double *sum) {
    const chain *c = &r->chain;
    const double *loop = loop_of(c, p, k), *noise = noise_of(c, s, k);
    for (int j = 0; sum && j < s->nu; ++j)
        sum[block_at(s, &r->problem->blocking, k) * s->nu + j] += dot_of(noise + j * c->ld, c->now, c->ld);
    for (int i = 0; i < p->zeta; ++i) c->next[i] = dot_of(loop + i * c->ld, c->now, c->ld);
    zero(c->next + p->zeta, c->ld - p->zeta);
    copy(c->now, c->next, c->ld);
}

/* Along the chain: from w, x = M w; without it, x becomes L^-1 x. */
static void go_forward(riccati *r, const double *w, double *restrict x) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    chain *c = &r->chain;
    zero(c->now, c->ld);
    for (int k = s.d; k < s.N; ++k) {
        forward_link(r, &s, &p, k, w);
        for (int row = k; row < r->q.rows; row += s.lanes) {
            const int position = c->position[row];
            if (position < 0) continue;
            const stage_limit of = limited_by(r, row);
            const double value = limited_value(r, &p, &of, c->next);
            x[position] = w ? value : x[position] - value;
            if (!w) axpy(c->next, x[position], c->gain + (ptrdiff_t)row * c->ld, c->ld);
        }
        copy(c->now, c->next, c->ld);
    }
}

static void chain_solve(qp *q, int members, double *restrict x) {
    riccati *const r = (riccati *)q;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    chain *c = &r->chain;
    place_members(r, members);
    go_forward(r, NULL, x);
    zero(c->now, c->ld);
    for (int k = s.N - 1; k >= s.d; --k) {
        for (int row = q->rows - s.lanes + k; row >= 0; row -= s.lanes) {
            const int position = c->position[row];
            if (position < 0) continue;
            const stage_limit of = limited_by(r, row);
            x[position] = x[position] / c->pivot[row] - dot_of(c->gain + (ptrdiff_t)row * c->ld, c->now, c->ld);
            add_limit(r, &p, &of, x[position], c->now);
        }
        back_link(r, &s, &p, k, NULL);
    }
}

static void chain_combine(qp *q, const double *parts, int members, double *restrict sum) {
    riccati *const r = (riccati *)q;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    chain *c = &r->chain;
    lay_chain(r, &s, &p);
    place_members(r, members);
    zero(sum, q->ld);
    zero(c->now, c->ld);
    for (int k = s.N - 1; k >= s.d; --k) {
        for (int row = k; row < q->rows; row += s.lanes) {
            const int position = c->position[row];
            if (position < 0 || parts[position] == 0.0) continue;
            const stage_limit of = limited_by(r, row);
            add_limit(r, &p, &of, parts[position], c->now);
        }
        back_link(r, &s, &p, k, sum);
    }
}

static void chain_project(qp *q, const double *restrict w, int members, double *restrict components) {
    riccati *const r = (riccati *)q;
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    lay_chain(r, &s, &p);
    place_members(r, members);
    go_forward(r, w, components);
}

#endif
