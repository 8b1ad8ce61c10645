/* The linear systems of a step h: of gamma / h M - J and (alpha + i beta) / h M - J, where M has 1 for each state. */
#ifndef RUMO_LINEAR_SYSTEM_C
#define RUMO_LINEAR_SYSTEM_C

#include "integrate/dense_system.c"
#include "integrate/sparse_system.c"

/* Of a step so short that nothing but the algebraic equations counts. */
#define NO_TIME 1e100

static int is_sparse(const rumo_integrator *q) { return q->system.factor.unknowns > 0; }

static int factor_system(rumo_integrator *q, double a, double c, double d) {
    ++q->work.factors;
    return is_sparse(q) ? factor_sparse(q, a, c, d) : factor_dense(q, a, c, d);
}

/* For a step; 0 if that is not possible. */
static int factor_for_step(rumo_integrator *q, double h) {
    if (q->factored == h) return 1;
    q->factored = factor_system(q, RADAU_GAMMA / h, RADAU_ALPHA / h, RADAU_BETA / h) ? h : 0.0;
    return q->factored > 0.0;
}

/* For the algebraic equations alone, with a real system that leaves states as they are. */
static int factor_for_root(rumo_integrator *q) {
    q->factored = 0.0;
    return is_sparse(q) ? factor_system(q, NO_TIME, NO_TIME, NO_TIME) : factor_system(q, NO_TIME, 0.0, 0.0);
}

/* right (3, ld) becomes the solutions: of the real system, and real and imaginary part of that of the complex one. */
static void solve_all(rumo_integrator *q, double *right) {
    ++q->work.solutions;
    if (is_sparse(q)) {
        solve_sparse(q, right);
    } else {
        solve_dense_real(q, right);
        solve_dense_complex(q, right + q->ld);
    }
}

/* The same of the real system alone; the rest of `right` is lost. */
static void solve_real(rumo_integrator *q, double *right) {
    ++q->work.solutions;
    if (is_sparse(q)) solve_sparse(q, right);
    else solve_dense_real(q, right);
}

#endif
