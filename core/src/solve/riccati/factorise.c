/* The Riccati recursion, from the last stage back. */
#ifndef RUMO_RICCATI_FACTORISE_C
#define RUMO_RICCATI_FACTORISE_C

#include "solve/riccati/horizon.c"
#include "solve/riccati/node_rows.h"
#include "solve/riccati/products.h"

/* A difference of squares that leaves less than this share of the first is taken in another way. */
#define CANCELLED 1e-6

/* Lower half of P += the curvature of a stage's outputs at its end: 2 Q times the square of each row. */
static WITHIN void add_stage_cost(const riccati *r, int k, double *restrict P) {
    const curvature_term *const end = r->terms + r->term_count;
    for (const curvature_term *t = r->terms; t < end; ++t) P[t->at] += t->curvature[k] * t->first[k] * t->second[k];
}

/* Where inputs begin, H is the slope of the cost to go by them: (P G)'(F, G, c), and the cost of changing them. */
static WITHIN void curve_inputs(riccati *r, const layout *p, const dims *s, int k, const double *rows) {
    const double *restrict curvature = r->move_curvature + k * s->nu;
    double *restrict H = r->H, *restrict L = r->factor;
    const double *restrict later = r->T + p->v * p->ld + p->B; /* what is in no stored row */
    /* Whole rows, so that nothing is left of what may have been no number. */
    product(r->T + p->B, 1, p->ld, s->nu, rows, p->ld, p->rows, H, p->ld, nothing_else);
    for (int j = 0; j < s->nu; ++j) {
        for (int i = 0; i < j; ++i) L[j * s->nu + i] = H[j * p->ld + p->B + i] + (unblocked(s) ? later[i * p->ld + j] : 0.0);
        const double own = H[j * p->ld + p->B + j] + (unblocked(s) ? later[j * p->ld + j] : 0.0) + curvature[j];
        L[j * s->nu + j] = own;
        r->q.span += own;
        r->largest_curvature[j] = larger(r->largest_curvature[j], own);
    }
    for (int j = 0; j < s->nu; ++j)
        for (int l = 0; l < p->ld; l += VEC) {
            double *h = H + j * p->ld + l;
            store(h, load(h) * load(r->kept + l) - curvature[j] * load(r->unit + j * p->ld + l));
        }
}

/* Leave inputs that are kept out of it. */
RARE static void hold_inputs(riccati *r, const layout *p, int nu, int k) {
    for (int j = 0; j < nu; ++j) {
        if (!r->pins[k * nu + j]) continue;
        zero(r->H + j * p->ld, p->ld);
        for (int i = 0; i < nu; ++i) r->factor[i * nu + j] = r->factor[j * nu + i] = i == j;
    }
}

/* The best inputs, given zeta: the curvature along them is L D L', H becomes L^-1 H, and gains -D^-1 L^-1 H; 0 if it is not
 * definite. */
static WITHIN int solve_inputs(const layout *p, int nu, double *restrict H, double *restrict L, double *restrict inverse,
                               double *restrict gains) {
    for (int j = 0; j < nu; ++j) inverse[j] = L[j * nu + j];
    for (int j = 0; j < nu; ++j) {
        const double pivot = L[j * nu + j];
        if (!(pivot > 1e-14 * inverse[j])) return 0;
        inverse[j] = 1.0 / pivot;
        for (int i = j + 1; i < nu; ++i) {
            const double l = L[i * nu + j] * inverse[j];
            for (int q = j + 1; q <= i; ++q) L[i * nu + q] -= l * L[q * nu + j];
            axpy(H + i * p->ld, -l, H + j * p->ld, p->ld);
        }
        for (int i = j + 1; i < nu; ++i) L[i * nu + j] *= inverse[j];
        for (int l = 0; l < p->ld; l += VEC) store(gains + j * p->ld + l, -inverse[j] * load(H + j * p->ld + l));
    }
    return 1;
}

/* From -D^-1 L^-1 H to -K = -L'^-1 D^-1 L^-1 H, and L'^-1 D^-1/2. */
static WITHIN void finish_gains(riccati *r, const layout *p, int nu, double *restrict gains, double *restrict roots) {
    const double *restrict L = r->factor;
    for (int j = 0; j < nu; ++j)
        for (int i = 0; i < nu; ++i) roots[j * nu + i] = i == j ? sqrt(r->inverse[j]) : 0.0;
    for (int j = nu - 1; j >= 0; --j)
        for (int i = 0; i < j; ++i) {
            axpy(gains + i * p->ld, -L[j * nu + i], gains + j * p->ld, p->ld);
            for (int q = j; q < nu; ++q) roots[i * nu + q] -= L[j * nu + i] * roots[j * nu + q];
        }
}

/* Columns of the closed loop F - G K at a stage, in r->closed (zeta, ld). It finds sizes itself: passed to a call, they are no
 * constants. */
static void close_loop(riccati *r, int k) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const double *restrict columns = columns_of_stage(r, &p, k), *restrict fresh = columns + p.moving * p.ld;
    const double *restrict gains = r->gains + (ptrdiff_t)k * s.nu * p.ld;
    double *restrict closed = r->closed;
    zero(closed, p.zeta * p.ld);
    for (int i = 0; i < p.moving; ++i) copy(closed + moved_entry(&s, i) * p.ld, columns + i * p.ld, p.ld);
    if (begins(&s, &r->problem->blocking, k))
        product(gains, 1, p.ld, p.zeta, fresh, p.ld, s.nu, closed, p.ld, what_is_there);
}

/* P as a sum of squares, where its difference of squares cancels: C'P C, with C = F - G K, and what changes of inputs cost
 * (Joseph). */
RARE static void square_stage(riccati *r, const dims *s, const layout *p, int k, double *restrict next) {
    const double *gains = r->gains + (ptrdiff_t)k * s->nu * p->ld;
    close_loop(r, k);
    product(r->closed, p->ld, 1, p->zeta, r->P, p->ld, p->zeta, r->half, p->ld, nothing_else);
    for (int i = 0; i < p->zeta; ++i)
        for (int l = 0; l < p->zeta; ++l) r->T[i * p->ld + l] = r->half[l * p->ld + i];
    product_lower(r->closed, p->ld, 1, 0, p->zeta, r->T, p->ld, p->zeta, next, 0);
    for (int j = 0; j < s->nu; ++j)
        for (int a = 0; a < p->zeta; ++a)
            for (int b = 0; b <= a; ++b)
                next[a * p->ld + b] += r->move_curvature[k * s->nu + j] * (gains[j * p->ld + a] - r->unit[j * p->ld + a]) *
                                       (gains[j * p->ld + b] - r->unit[j * p->ld + b]);
}

/* P at a stage's beginning, without the cost there: F'T, less the square that the best inputs take off; whether that cancels. */
static WITHIN int take_off(riccati *r, const dims *s, const layout *p, int k, const double *restrict rows,
                           const double *restrict gains, double *restrict next) {
    const double *restrict T = r->T;
    double *restrict before = r->out;
    int cancelled = 0;
    product_lower(rows, 1, p->ld, 0, s->nx, T, p->ld, s->rows, next, 0);
    zero(next + s->nx * p->ld, (p->zeta - s->nx) * p->ld);
    if (!unblocked(s))
        product_lower(rows + p->v, 1, p->ld, p->v, 2 * s->nu, T, p->ld, p->rows, next + p->v * p->ld, 0);
    if (!begins(s, &r->problem->blocking, k)) return 0;
    for (int i = 0; i < s->nx; ++i) before[i] = next[i * (p->ld + 1)];
    product_lower(r->H, 1, p->ld, 0, p->zeta, gains, p->ld, s->nu, next, 1);
    for (int j = 0; j < s->nu; ++j) next[(p->v + j) * (p->ld + 1)] += r->move_curvature[k * s->nu + j];
    for (int i = 0; i < s->nx; ++i) cancelled |= next[i * (p->ld + 1)] < CANCELLED * before[i];
    return cancelled;
}

/* One stage: from P at its end to P at its beginning, with the cost there, if there is a stage before; 0 if not definite. */
static int factorise_stage(riccati *r, int k) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const double *restrict rows = rows_of_stage(r, &p, k);
    double *T = r->T, *restrict next = r->next_P, *restrict Pc = r->Pc + (ptrdiff_t)(k + 1) * p.ld;
    double *restrict gains = r->gains + (ptrdiff_t)k * s.nu * p.ld, *restrict roots = r->roots + (ptrdiff_t)k * s.nu * s.nu;
    /* T = P (F, G, c), first the columns that H waits for. Where the rows of v are not stored, they are units in the columns of
     * G, and no one needs theirs of F. */
    const int from = p.B / VEC * VEC, fresh = begins(&s, &r->problem->blocking, k);
    const onto of_v = {0, r->P + from, r->of_v + from};
    product(r->P, p.ld, 1, p.zeta, rows + from, p.ld, p.rows, T + from, in_fours(p.c + 1) - from, of_v);
    if (k > s.d) product(r->P, p.ld, 1, unblocked(&s) ? p.v : p.zeta, rows, p.ld, p.rows, T, from, nothing_else);
    for (int i = 0; i < p.zeta; ++i) Pc[i] = T[i * p.ld + p.c];
    if (fresh) {
        curve_inputs(r, &p, &s, k, rows);
        if (r->pinned) hold_inputs(r, &p, s.nu, k);
        if (!solve_inputs(&p, s.nu, r->H, r->factor, r->inverse, gains)) return 0;
    }
    const int cancelled = k > s.d && take_off(r, &s, &p, k, rows, gains, next);
    if (fresh) finish_gains(r, &p, s.nu, gains, roots);
    for (int j = 0; r->pinned && j < s.nu; ++j)
        if (r->pins[k * s.nu + j]) roots[j * (s.nu + 1)] = 0.0;
    if (k == s.d) return 1;
    if (cancelled) square_stage(r, &s, &p, k, next);
    add_stage_cost(r, k - 1, next);
    mirror_lower(next, p.zeta, p.ld);
    r->next_P = r->P;
    r->P = next;
    return 1;
}

/* All stages; 0 if not definite, or if there is no time for them. */
static int factorise_stages(riccati *r) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    r->q.span = 0.0;
    r->chain.laid = 0;
    zero(r->largest_curvature, s.nu);
    zero(r->P, p.zeta * p.ld);
    add_stage_cost(r, s.N - 1, r->P);
    mirror_lower(r->P, p.zeta, p.ld);
    for (int k = s.N - 1; k >= s.d; --k)
        if (is_over(r->q.end) || !factorise_stage(r, k)) return 0;
    set_fine(&r->q, 1.0, largest_size(r->roots, padded(s.N * s.nu * s.nu)));
    return 1;
}

#endif
