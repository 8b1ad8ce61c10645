/* Along the stages: back with the slope of a function of zeta, forward with w. */
#ifndef RUMO_SWEEPS_C
#define RUMO_SWEEPS_C

#include "solve/riccati/horizon.c"
#include "solve/riccati/products.h"

/* From a slope by zeta_{k+1}, h, to that by zeta_k, in its place, with what is `there` by itself unless that is NULL;
 * `by_inputs` are those by new inputs, and what they are over w goes to m; in open loop without m. Returns the slope by the
 * constant term. */
static WITHIN double back_stage(const riccati *r, const dims *s, const layout *p, int k, double *restrict h,
                                const double *restrict there, double *restrict by_inputs, double *restrict m) {
    const double *restrict rows = rows_of_stage(r, p, k), *restrict gains = r->gains + (ptrdiff_t)k * s->nu * p->ld;
    const double *restrict roots = r->roots + (ptrdiff_t)k * s->nu * s->nu;
    double *restrict out = r->out;
    combine_rows(h, rows, p->ld, p->rows, out, 0);
    for (int j = 0; j < s->nu; ++j) by_inputs[j] = out[p->B + j] + (unblocked(s) ? h[p->v + j] : 0.0);
    for (int l = 0; l < p->ld; l += VEC) {
        vec sum = load(out + l) * load(r->kept + l);
        if (there) sum += load(there + l);
        for (int j = 0; m && j < s->nu; ++j) sum += by_inputs[j] * load(gains + j * p->ld + l);
        store(h + l, sum);
    }
    if (!m || !begins(s, &r->problem->blocking, k)) return out[p->c];
    m += block_at(s, &r->problem->blocking, k) * s->nu;
    for (int j = 0; j < s->nu; ++j) {
        m[j] = 0.0;
        for (int i = 0; i <= j; ++i) m[j] += roots[i * s->nu + j] * by_inputs[i];
    }
    return out[p->c];
}

/* The value of an input that is kept, else 0. */
static inline double kept_at(const riccati *r, const dims *s, int k, int j) {
    const int pin = r->pins[k * s->nu + j], row = j * s->lanes + k;
    return pin == AT_UPPER ? r->q.upper[row] : pin == AT_LOWER ? r->q.lower[row] : 0.0;
}

/* Slopes by inputs that are kept are no residuals. */
static inline void set_slopes_apart(riccati *r, const dims *s, int k, double *restrict slope) {
    for (int j = 0; j < s->nu; ++j) {
        r->pin_slopes[k * s->nu + j] = slope[j];
        if (r->pins[k * s->nu + j]) slope[j] = 0.0;
    }
}

/* U'^-1 of a function's slopes at the nodes d + 1 .. N, as a row over w; with those of the constant terms if `affine`. Returns
 * the largest slope by an input, in closed loop, relative to the largest force along that input or to what it takes to move one
 * by a millionth. */
static double sweep_back(riccati *r, int affine, double *restrict m) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    double *restrict h = r->row, *restrict slope = r->input_slope, *restrict force = r->largest_force,
                     *restrict largest = r->largest_slope, worst = 0.0;
    for (int i = (s.d + 1) * p.ld; affine && i < (s.N + 1) * p.ld; ++i) r->nodes[i] += r->Pc[i];
    copy(h, r->nodes + (ptrdiff_t)s.N * p.ld, p.ld);
    zero(m + r->q.n, r->q.ld - r->q.n);
    zero(largest, s.nu);
    for (int j = 0; j < s.nu; ++j) force[j] = 1e-6 * r->largest_curvature[j];
    for (int k = s.N - 1; k >= s.d; --k) {
        for (int j = 0; j < s.nu; ++j) force[j] = larger(force[j], fabs(h[p.v + j]));
        back_stage(r, &s, &p, k, h, r->nodes + (ptrdiff_t)k * p.ld, slope, m);
        if (r->pinned) set_slopes_apart(r, &s, k, slope);
        if (begins(&s, &r->problem->blocking, k))
            for (int j = 0; j < s.nu; ++j) largest[j] = larger(largest[j], fabs(slope[j]));
    }
    for (int j = 0; j < s.nu; ++j) worst = larger(worst, largest[j] / force[j]);
    return worst;
}

/* The same for a single row, h at node k + 1, less `before` of v at node k: m, pi and gamma. Returns the size of what the
 * inputs do to it, in closed loop. */
static double sweep_row(riccati *r, int k, int before, double *restrict m, double *restrict pi, double *restrict gamma) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    double *restrict h = r->row, *restrict slope = r->input_slope, squares = 0.0;
    zero(m, r->q.ld);
    *gamma = 0.0;
    for (int i = k; i >= s.d; --i) {
        *gamma += back_stage(r, &s, &p, i, h, NULL, slope, m);
        for (int j = 0; r->pinned && j < s.nu; ++j) *gamma += slope[j] * kept_at(r, &s, i, j);
        if (r->pinned) copy(r->pin_slopes + i * s.nu, slope, s.nu);
        if (begins(&s, &r->problem->blocking, i))
            for (int j = 0; j < s.nu; ++j) squares += slope[j] * slope[j];
        if (i == k && before >= 0) h[p.v + before] -= 1.0;
    }
    copy(pi, h, p.ld);
    return sqrt(squares);
}

/* zeta at a stage's end from that at its beginning and v (nu,), with the constant term if `affine`. */
static WITHIN void forward_stage(const riccati *r, const dims *s, const layout *p, int k, const double *restrict zeta,
                                 const double *restrict v, int affine, double *restrict next) {
    const double *restrict columns = columns_of_stage(r, p, k);
    if (affine) copy(next, columns + (p->columns - 1) * p->ld, p->ld);
    combine_rows(zeta, columns, p->ld, s->nx, next, affine);
    if (!unblocked(s)) combine_rows(zeta + p->v, columns + s->nx * p->ld, p->ld, 2 * s->nu, next, 1);
    combine_rows(v, columns + p->moving * p->ld, p->ld, s->nu, next, 1);
}

/* The inputs of a stage in closed loop with w, v (nu,), if new ones begin there. */
static WITHIN void close_stage(const riccati *r, const dims *s, const layout *p, int k, const double *restrict zeta,
                               const double *restrict w, double *restrict v) {
    const double *gains = r->gains + (ptrdiff_t)k * s->nu * p->ld, *roots = r->roots + (ptrdiff_t)k * s->nu * s->nu;
    const int own = block_at(s, &r->problem->blocking, k) * s->nu;
    for (int j = 0; j < s->nu; ++j) v[j] = dot_of(gains + j * p->ld, zeta, p->ld);
    if (!begins(s, &r->problem->blocking, k)) return;
    for (int j = 0; j < s->nu; ++j)
        for (int i = j; i < s->nu; ++i) v[j] += roots[j * s->nu + i] * w[own + i];
}

/* zeta at all nodes after d, in closed loop with w. */
static void sweep_forward(riccati *r, const double *restrict w) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    double *v = r->input_slope;
    for (int k = s.d; k < s.N; ++k) {
        double *zeta = r->zeta + (ptrdiff_t)k * p.ld;
        close_stage(r, &s, &p, k, zeta, w, v);
        for (int j = 0; r->pinned && j < s.nu; ++j) v[j] += kept_at(r, &s, k, j);
        forward_stage(r, &s, &p, k, zeta, v, 1, zeta + p.ld);
    }
}

/* What a step of w adds to zeta; returns the largest change of v. A sum with w would lose it, where inputs at their bounds are
 * far from those of the closed loop. */
static double sweep_step(riccati *r, const double *restrict step) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    double *v = r->input_slope, *at = r->row, *next = r->out, largest = 0.0;
    zero(at, p.ld);
    for (int k = s.d; k < s.N; ++k) {
        close_stage(r, &s, &p, k, at, step, v);
        forward_stage(r, &s, &p, k, at, v, 0, next);
        axpy(r->zeta + (ptrdiff_t)(k + 1) * p.ld, 1.0, next, p.ld);
        for (int j = 0; j < s.nu; ++j) largest = larger(largest, fabs(next[p.v + j]));
        copy(at, next, p.ld);
    }
    return largest;
}

#endif
