/* A stage solver that leaves the inputs as they are guessed: the smallest there can be. */
#include "solve/stage_solver.h"
#include "solve/dense/condense.c"
#include "stages/along.c"

typedef struct staying {
    const rumo_problem *problem;
    double *stages;
} staying;

typedef staying solver_memory;

static void staying_lay_out(arena *a, void *self, const rumo_problem *own, const rumo_problem *given) {
    staying *const method = (staying *)self;
    const dims s = dims_of(&given->sizes);
    method->problem = own;
    method->stages = alloc_doubles(a, (ptrdiff_t)s.N * s.width * s.ldx);
}

static void staying_nothing(void *self) { (void)self; }

static void staying_damp(void *self, double damping) {
    (void)self;
    (void)damping;
}

static int staying_prepare(void *self, const stage_maps *m, int shift, double end) {
    (void)end;
    const dims s = dims_of(&((staying *)self)->problem->sizes);
    (void)shift;
    spread(&s, &m->map, m->map_row, m->maps, ((staying *)self)->stages);
    return 1;
}

static void staying_reach(void *self, int stages, double *reach) {
    const dims s = dims_of(&((staying *)self)->problem->sizes);
    (void)stages;
    for (int r = 0; r < s.nx; ++r) reach[r] = 1.0;
}

static rumo_status staying_solve(void *self, const stage_maps *m, const stage_known *known, const budget *limits,
                                 stage_step *step) {
    const staying *const method = (const staying *)self;
    const dims s = dims_of(&method->problem->sizes);
    (void)limits;
    for (int r = 0; r < s.nx; ++r) step->dx[r] = known->x[r] - m->guess_x[r];
    for (int i = 0; i < s.N * s.nu; ++i) step->du[i] = i < s.d * s.nu ? known->decided[i] - m->guess_u[i] : 0.0;
    for (int k = 0; k < s.N; ++k) {
        double *dx = step->dx + (ptrdiff_t)k * s.ldx;
        const double *du = step->du + k * s.nu;
        advance(&s, method->stages + (ptrdiff_t)k * s.width * s.ldx, dx, du, dx + s.ldx);
        for (int r = 0; r < s.nc; ++r)
            step->constraints[k * s.nc + r] =
                linearised(m, method->problem->G_first, r, &m->D, &m->E, k, dx + s.ldx, du,
                           method->problem->numbers.constraint_limits[k * s.nc + r]);
    }
    step->size = step->kkt_residual = 0.0;
    step->iterations = step->conflicts = 0;
    return RUMO_OPTIMAL;
}

static const stage_solver solver = {staying_lay_out, staying_nothing, staying_nothing, staying_damp,
                                    staying_prepare, staying_reach,   staying_solve};
