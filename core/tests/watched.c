/* The core as a library that shows what its solvers were asked: the guess, what was known of the sample, and the step.
 *
 * Tests that judge plans need where they were linearised, which nobody else is told. */
#include "base/system.h"

#include "rumo_core.h"

#include "solve/solver.h"

/* The last two solutions, in turns: a further iteration may be dropped. */
static double *watched;
static long long solutions;

void watch_steps(double *numbers);
long long watched_solutions(void);

/* Of the next step: numbers (2, size), size as in show(); NULL for none. */
void watch_steps(double *numbers) {
    watched = numbers;
    solutions = 0;
}

long long watched_solutions(void) { return solutions; }

static double *put(double *to, const double *from, int count) {
    for (int i = 0; i < count; ++i) to[i] = from[i];
    return to + count;
}

/* Guess u (N, nu), x (N + 1, nx), other unknowns (ni, N); du (N, nu), dx (N + 1, nx); x (nx,), decided (max(d, 1), nu),
 * reference (N + 1, ny). */
static void show(const stage_maps *m, const stage_known *known, const stage_step *step) {
    const dims *s = &m->s;
    const int decided = s->d > 1 ? s->d : 1;
    const int size = 2 * s->N * s->nu + (2 * s->N + 3) * s->nx + s->ni * s->N + decided * s->nu + (s->N + 1) * s->ny;
    double *to = watched + (solutions++ % 2) * size;
    to = put(put(to, m->guess_u, s->N * s->nu), m->guess_x, (s->N + 1) * s->nx);
    for (int i = 0; i < s->ni; ++i) to = put(to, m->guess_inner + (ptrdiff_t)i * s->lanes, s->N);
    to = put(to, step->du, s->N * s->nu);
    for (int k = 0; k <= s->N; ++k) to = put(to, step->dx + (ptrdiff_t)k * s->ldx, s->nx);
    to = put(to, known->x, s->nx);
    put(put(to, known->decided, decided * s->nu), known->reference, (s->N + 1) * s->ny);
}

#define WATCHED(name)                                                                                                     \
    static rumo_status watched_##name(void *self, const stage_maps *m, const stage_known *known, const budget *b,         \
                                      stage_step *step) {                                                                 \
        const rumo_status status = name.solve(self, m, known, b, step);                                                   \
        if (watched) show(m, known, step);                                                                                \
        return status;                                                                                                    \
    }

WATCHED(dense_solver)
WATCHED(riccati_solver)

static const stage_solver *watched_solver_of(const rumo_sizes *sizes) {
    static stage_solver solvers[2];
    if (!solvers[0].solve) {
        solvers[0] = riccati_solver;
        solvers[1] = dense_solver;
        solvers[0].solve = watched_riccati_solver;
        solvers[1].solve = watched_dense_solver;
    }
    return &solvers[dims_of(sizes).condensing];
}

#define solver_of watched_solver_of
#include "core.c"
