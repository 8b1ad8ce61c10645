/* The extended Kalman filter: predicted by Newton's method on the scheme's equations, corrected by one measurement after the
 * other. Its problem has one interval, no delay, and the measurements for outputs.
 *
 * A belief is x (n,), its covariance's factors (n, n), see ud.c, and how often in a row each measurement was refused (m,). */
#ifndef RUMO_FILTER_C
#define RUMO_FILTER_C

#include "base/arena.h"
#include "base/copies.c"
#include "estimate/ud.c"
#include "rules.c"
#include "stages/along.c"
#include "stages/roll_out.c"

struct rumo_filter {
    dims s;
    rumo_problem problem;
    rumo_filter_data data;
    stage_maps stages;
    double *dx, *du, *inner;   /* (2, ldx), (nu,), (ni, lanes): see roll_out() */
    double *A, *H;             /* (n, n), (m, n) */
    double *W, *weights;       /* (n, 2 n), (2 n,): see orthogonalise() */
    double *weighted;          /* (2 n,) */
    double *f, *gain, *moved;  /* (n,) */
    double *taken;             /* (m,): innovations where they are used, else NaN */
};

static void lay_out_filter(arena *a, rumo_filter *f, const rumo_problem *p, const rumo_filter_data *data) {
    copy_rumo_problem(a, &f->problem, p, &p->sizes);
    copy_rumo_filter_data(a, &f->data, data, &p->sizes);
    const dims s = f->s = dims_of(&p->sizes);
    lay_out_stages(a, &f->stages, &f->problem, p);
    f->dx = alloc_doubles(a, 2 * (ptrdiff_t)s.ldx);
    f->du = alloc_doubles(a, s.nu);
    f->inner = alloc_doubles(a, (ptrdiff_t)s.ni * s.lanes);
    f->A = alloc_doubles(a, (ptrdiff_t)s.nx * s.nx);
    f->H = alloc_doubles(a, (ptrdiff_t)s.ny * s.nx);
    f->W = alloc_doubles(a, 2 * (ptrdiff_t)s.nx * s.nx);
    f->weights = alloc_doubles(a, 2 * s.nx);
    f->weighted = alloc_doubles(a, 2 * s.nx);
    f->f = alloc_doubles(a, s.nx);
    f->gain = alloc_doubles(a, s.nx);
    f->moved = alloc_doubles(a, s.nx);
    f->taken = alloc_doubles(a, s.ny);
}

RARE static size_t filter_size(const rumo_problem *p, const rumo_filter_data *data) {
    rumo_filter f;
    arena a = {NULL, 0};
    (void)alloc(&a, sizeof f);
    lay_out_filter(&a, &f, p, data);
    return a.used + ALIGNMENT;
}

RARE static rumo_filter *create_filter(const rumo_problem *p, const rumo_filter_data *data, void *memory) {
    arena a = {aligned(memory), 0};
    rumo_filter *f = (rumo_filter *)alloc(&a, sizeof *f);
    lay_out_filter(&a, f, p, data);
    return f;
}

/* Whether a problem that is one by itself is a filter's: measurements do not depend on algebraic variables. */
RARE static rumo_fault check_filter(const rumo_problem *p, const rumo_filter_data *data) {
    const rumo_sizes *s = &p->sizes;
    if (s->horizon > 1) return (rumo_fault){RUMO_TOO_LARGE, "", "horizon", -1};
    if (s->parameters < 1) return (rumo_fault){RUMO_TOO_SMALL, "", "parameters", -1};
    if (p->elimination.blocks == 0) return (rumo_fault){RUMO_TOO_SMALL, "elimination", "blocks", -1};
    for (int e = 0; e < p->Cx.count; ++e)
        if (p->Cx.column[e] >= s->states) return (rumo_fault){RUMO_OUT_OF_RANGE, "Cx", "column", e};
    return check_rumo_filter_data("", data, s);
}

static void filter_covariance(const rumo_filter *f, const double *belief, double *P) {
    product_of_factors(f->s.nx, belief + f->s.nx, P);
}

/* The state after a share of a sample (the last parameter), outputs there, and the derivatives of both. 0 if there is none. */
static int predict_state(rumo_filter *f, double *x, const double *u, const double *p) {
    stage_maps *m = &f->stages;
    const dims *s = &f->s;
    const int np = f->problem.sizes.parameters;
    if (!all_finite(x, s->nx) || !all_finite(u, s->nu) || !all_finite(p, np)) return 0;
    copy(m->guess_x, x, s->nx);
    copy(m->guess_x + s->nx, x, s->nx);
    copy(m->guess_u, u, s->nu);
    guess_inner(m, x);
    to_lanes(p, np, np, 1, s->lanes, m->p_lanes);
    if (!roll_out(m, u, f->dx, f->du, f->inner, INFINITY)) return 0;
    advance_guess_stage(m, 0, f->dx, f->dx + s->ldx); /* what is left to correct, and too little to linearise again */
    for (int r = 0; r < s->nx; ++r) x[r] = m->guess_x[s->nx + r] + f->dx[s->ldx + r];
    zero(f->A, s->nx * s->nx);
    for (int r = 0; r < s->nx; ++r)
        for (int e = m->map.start[r]; e < m->end_of_A[r]; ++e)
            f->A[r * s->nx + m->map.column[e]] = m->maps[(ptrdiff_t)e * s->lanes];
    zero(f->H, s->ny * s->nx);
    for (int r = 0; r < s->ny; ++r)
        for (int e = m->Cx.start[r]; e < m->Cx.start[r + 1]; ++e)
            f->H[r * s->nx + m->Cx.column[e]] = entry(m, &m->Cx, e, 0);
    return 1;
}

/* Output r there. */
static double predicted_output(const rumo_filter *f, int r) {
    const stage_maps *m = &f->stages;
    return linearised(m, f->problem.y_first, r, &m->Cx, &m->Cu, 0, f->dx + f->s.ldx, NULL, 0.0);
}

/* The state after a share of a sample, in place, with its derivatives (n, n), outputs (m,) there and theirs (m, n) by that
 * state; 0 if there is none. */
static int filter_linearise(rumo_filter *f, double *x, const double *u, const double *p, double *A, double *y, double *H) {
    const int n = f->s.nx, m = f->s.ny;
    if (!predict_state(f, x, u, p)) return 0;
    copy(A, f->A, n * n);
    copy(H, f->H, m * n);
    for (int r = 0; r < m; ++r) y[r] = predicted_output(f, r);
    return all_finite(x, n) && all_finite(y, m);
}

/* P = A P A' + Q, and no variance below its floor. */
static void predict_covariance(rumo_filter *f, double *ud, double share) {
    const int n = f->s.nx, k = 2 * n;
    load_product(n, k, f->A, ud, f->W, f->weights);
    for (int i = 0; i < n; ++i) {
        double *const row = f->W + (ptrdiff_t)i * k, variance = 0.0;
        for (int j = 0; j < n; ++j) variance += row[j] * row[j] * f->weights[j];
        f->weights[n + i] = larger(share * f->data.process[i], f->data.floor[i] - variance);
        zero(row + n, n);
        row[n + i] = 1.0;
    }
    orthogonalise(n, k, f->W, f->weights, ud, f->weighted);
}

/* P += weight P h h' P, from U' h. */
static void inflate(rumo_filter *f, double *ud, double weight) {
    const int n = f->s.nx, k = n + 1;
    covariance_along(n, ud, f->f, f->gain);
    for (int i = 0; i < n; ++i) {
        double *const row = f->W + (ptrdiff_t)i * k;
        copy(row, ud + (ptrdiff_t)i * n, n);
        zero(row, i);
        row[i] = 1.0;
        row[n] = f->gain[i];
        f->weights[i] = ud[i * n + i];
    }
    f->weights[n] = weight;
    orthogonalise(n, k, f->W, f->weights, ud, f->weighted);
}

/* Which innovations are used, each judged by itself. What was refused too often shows that the filter is wrong: its covariance
 * grows along what the measurement sees, until that is no outlier any more. */
static void judge(rumo_filter *f, double *ud, double *refused, const double *y, double *report) {
    const dims *s = &f->s;
    double *const innovation = report, *const deviation = report + s->ny, *const used = report + 2 * s->ny;
    const double width = *f->data.width;
    for (int r = 0; r < s->ny; ++r) {
        const double turn = f->data.turns[r];
        double left = y[r] - predicted_output(f, r);
        f->taken[r] = innovation[r] = deviation[r] = NAN;
        used[r] = 0.0;
        if (!isfinite(left)) continue;
        if (turn > 0.0) left -= turn * floor(left / turn + 0.5);
        const double seen = variance_along(s->nx, ud, f->H + (ptrdiff_t)r * s->nx, f->f), wanted = (left / width) * (left / width);
        double variance = seen + f->data.noise[r];
        innovation[r] = left;
        if (wanted > variance) {
            refused[r] += 1.0;
            if (refused[r] <= f->data.patience || seen == 0.0) {
                deviation[r] = sqrt(variance);
                continue;
            }
            inflate(f, ud, (wanted - variance) / (seen * seen));
            variance = wanted;
        }
        refused[r] = 0.0;
        used[r] = 1.0;
        deviation[r] = sqrt(variance);
        f->taken[r] = left;
    }
}

/* One measurement after the other: their noise is independent. Two numbers: the normalised innovation squared of all, and the
 * logarithm of the determinant of their covariance. */
static void correct(rumo_filter *f, double *x, double *ud, double *sums) {
    const int n = f->s.nx;
    sums[0] = sums[1] = 0.0;
    zero(f->moved, n);
    for (int r = 0; r < f->s.ny; ++r) {
        const double *const h = f->H + (ptrdiff_t)r * n;
        double left = f->taken[r];
        if (isnan(left)) continue;
        for (int j = 0; j < n; ++j) left -= h[j] * f->moved[j];
        (void)variance_along(n, ud, h, f->f);
        const double variance = correct_factor(n, ud, f->f, f->data.noise[r], f->gain), share = left / variance;
        for (int j = 0; j < n; ++j) f->moved[j] += share * f->gain[j];
        sums[0] += share * left;
        sums[1] += log(variance);
    }
    for (int j = 0; j < n; ++j) x[j] += f->moved[j];
}

/* 0 where the model has no finite value; `after` is nothing to go by then. The report is (3 m + 2,): innovations, their
 * deviations, which are used, the normalised innovation squared of these, and the logarithm of the determinant of their covariance. */
static int filter_advance(rumo_filter *f, const double *before, const double *u, const double *p, const double *y,
                          double *after, double *report) {
    const int n = f->s.nx, m = f->s.ny, size = n + n * n + m;
    double *const x = after, *const ud = after + n, *const refused = ud + n * n;
    memcpy(after, before, (size_t)size * sizeof *after);
    if (!predict_state(f, x, u, p)) return 0;
    predict_covariance(f, ud, p[f->problem.sizes.parameters - 1]);
    judge(f, ud, refused, y, report);
    correct(f, x, ud, report + 3 * m);
    return all_finite(after, size);
}

#endif
