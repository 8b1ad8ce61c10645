/* A guard by itself, for controllers whose solver is somewhere else. */
#ifndef RUMO_ALONE_C
#define RUMO_ALONE_C

#include "base/arena.h"
#include "base/copies.c"
#include "guard/follow.c"
#include "guard/gate.c"
#include "guard/stray.c"
#include "guard/turns.c"
#include "rules.c"

static void lay_out_alone(arena *a, rumo_guard *g, const rumo_guard_data *data) {
    rumo_guard_data own;
    copy_rumo_guard_data(a, &own, data, &data->sizes);
    lay_out_guard(a, g, &own, oldest_reading(&data->sensors, data->sizes.states));
    g->u = alloc_doubles(a, g->s.N * g->s.nu);
    g->x = alloc_doubles(a, (g->s.N + 1) * g->s.nx);
    g->inner = alloc_doubles(a, (ptrdiff_t)g->s.ni * g->s.lanes);
    g->rows = alloc_doubles(a, (ptrdiff_t)g->s.N * g->s.ni);
    g->next_rows = alloc_doubles(a, (ptrdiff_t)g->s.N * g->s.ni);
}

static size_t guard_size(const rumo_guard_data *data) {
    rumo_guard g;
    arena a = {NULL, 0};
    (void)alloc(&a, sizeof g);
    lay_out_alone(&a, &g, data);
    return a.used + ALIGNMENT;
}

static rumo_guard *create_guard(const rumo_guard_data *data, const rumo_settings *settings, void *memory) {
    arena a = {aligned(memory), 0};
    rumo_guard *g = (rumo_guard *)alloc(&a, sizeof *g);
    lay_out_alone(&a, g, data);
    configure_guard(g, settings);
    reset_guard(g);
    return g;
}

static double *guard_applied(rumo_guard *g) { return g->applied; }

static long long *guard_counts(rumo_guard *g) { return g->counts; }

static rumo_fault update_guard(rumo_guard *g, const rumo_bounds *given) {
    rumo_bounds merged;
    merge_rumo_bounds(&merged, given, &g->data.bounds, &g->data.sizes);
    const rumo_fault fault = check_bounds(&merged, &g->data.sizes);
    if (!fault.error) assign_rumo_bounds(&g->data.bounds, &merged, &g->data.sizes);
    return fault;
}

static rumo_status admit(rumo_guard *g, const double *measured, const double *reference, int count, const double *reach) {
    double *x = unwound(g, measured);
    const rumo_status status = finite_sample(g, all_finite(reference, count));
    if (status != RUMO_OPTIMAL) return status;
    if (!plausible(g, x, reach)) return RUMO_BAD_MEASUREMENT;
    bring_to_now(g, x);
    return RUMO_OPTIMAL;
}

static const double *taken(const rumo_guard *g) { return g->taken; }

static const double *health(const rumo_guard *g) { return g->health; }

static int is_surprised(const rumo_guard *g) { return g->surprised; }

/* How the state after a sample depends on that before it, A (nx, nx). */
static void expect(rumo_guard *g, const double *A) {
    const int nx = g->s.nx;
    if (!begin_expecting(g)) return;
    for (int r = 0; r < nx; ++r) {
        double change = g->x[r] - g->next_x[r];
        for (int j = 0; j < nx; ++j) change += A[r * nx + j] * (g->next_x[j] - g->x[j]);
        expect_reading(g, r, A[r * nx + r], change);
    }
    if (g->oldest) {
        copy(dependence_of(g, 0), A, nx * nx);
        expect_old_readings(g);
    }
    g->monitor.fresh = 0;
}

static const double *unwind(rumo_guard *g, const double *x) { return unwound(g, x); }

static void drop_guess(rumo_guard *g) { g->has_guess = g->resting = 0; }

static void guard_state(const rumo_guard *g, rumo_guard_state *state) {
    *state = (rumo_guard_state){g->has_guess, g->u, g->x, g->rows, NULL, NULL, NULL};
    if (!g->has_next) return;
    state->next_u = g->next_u;
    state->next_x = g->next_x;
    state->next_inner = g->next_rows;
}

/* And back: see inner_to_lanes(). */
static void inner_to_rows(const dims *s, const double *lanes, double *rows) {
    for (int i = 0; i < s->ni; ++i)
        for (int k = 0; k < s->N; ++k) rows[k * s->ni + i] = lanes[i * s->lanes + k];
}

/* A candidate counts if it is one that can be applied, and every number of it is finite. */
static rumo_status follow_candidate(rumo_guard *g, const double *u, const double *x, const double *inner,
                                    rumo_status *cause) {
    const dims *s = &g->s;
    const int usable = *cause <= RUMO_BUDGET_EXCEEDED;
    const int solved = usable && u && all_finite(u, s->N * s->nu) && all_finite(x, (s->N + 1) * s->nx) &&
                       all_finite(inner, s->N * s->ni);
    if (solved) {
        copy(g->u, u, s->N * s->nu);
        copy(g->x, x, (s->N + 1) * s->nx);
        inner_to_lanes(s, inner, g->inner);
    } else if (*cause < RUMO_BUDGET_EXCEEDED) {
        *cause = RUMO_SOLVER_FAILED;
    }
    const rumo_status status = follow(g, solved, *cause);
    inner_to_rows(s, g->inner, g->rows);
    if (g->has_next) inner_to_rows(s, g->next_inner, g->next_rows);
    return status;
}

#endif
