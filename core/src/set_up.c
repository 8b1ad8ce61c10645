/* Making a controller: one pass over the same calls measures its memory, a second one lays it out. */
#ifndef RUMO_SET_UP_C
#define RUMO_SET_UP_C

#include "base/arena.h"
#include "base/copies.c"
#include "controller.h"
#include "guard/guard.h"
#include "numbers.c"

RARE static void lay_out_guess(arena *a, kept_guess *kept, const dims *s) {
    kept->u = alloc_doubles(a, s->N * s->nu);
    kept->x = alloc_doubles(a, (s->N + 1) * s->nx);
    kept->inner = alloc_doubles(a, (ptrdiff_t)s->ni * s->lanes);
}

/* Lay out a controller in memory, or measure it; with memory, copy the problem. */
RARE static void lay_out(arena *a, rumo_controller *ctl, const rumo_problem *p) {
    rumo_problem *const own = &ctl->problem;
    copy_rumo_problem(a, own, p, &p->sizes);
    const dims s = ctl->s = dims_of(&p->sizes);
    ctl->numbers = alloc_doubles(a, size_of_plan(&s));
    ctl->inner = alloc_doubles(a, (ptrdiff_t)s.ni * s.lanes);
    ctl->guess_rest = alloc_doubles(a, rest_of_plan(&s));
    lay_out_guess(a, &ctl->from, &s);
    lay_out_guess(a, &ctl->first, &s);
    lay_out_guess(a, &ctl->stored, &s);
    ctl->way_inner = alloc_doubles(a, (ptrdiff_t)s.ni * s.lanes);
    ctl->values = alloc_doubles(a, s.n);
    ctl->last_reference = alloc_doubles(a, (s.N + 1) * s.ny);
    ctl->expected = alloc_doubles(a, (s.N + 1) * s.ny);
    ctl->near_reach = alloc_doubles(a, s.nx);
    ctl->begins = alloc_doubles(a, s.ny);
    lay_out_stages(a, &ctl->stages, own, p);
    solver_of(&p->sizes)->lay_out(a, &ctl->solving, own, p);
    ctl->step.dx = alloc_doubles(a, (ptrdiff_t)(s.N + 1) * s.ldx);
    ctl->step.du = alloc_doubles(a, s.N * s.nu);
    ctl->step.constraints = a->base ? plan_constraints(ctl) : NULL;
    ctl->broken = (rumo_conflict *)alloc(a, (size_t)(s.N * s.nc) * sizeof *ctl->broken);
    const rumo_guard_data guarded = {own->sizes,       own->shift,   own->inner_signals,
                                     own->inner_nodes, own->sensors, own->numbers.bounds};
    lay_out_guard(a, &ctl->guard, &guarded, oldest_reading(&p->sensors, s.nx));
    ctl->guard.u = plan_u(ctl);
    ctl->guard.x = a->base ? plan_x(ctl) : NULL;
    ctl->guard.inner = ctl->inner;
}

RARE static size_t controller_size(const rumo_problem *p) {
    rumo_controller ctl;
    arena a = {NULL, 0};
    (void)alloc(&a, sizeof ctl);
    lay_out(&a, &ctl, p);
    return a.used + ALIGNMENT;
}

static void configure(rumo_controller *ctl, const rumo_settings *settings) {
    ctl->settings = *settings;
    configure_guard(&ctl->guard, settings);
}

RARE static void reset_controller(rumo_controller *ctl) {
    reset_guard(&ctl->guard);
    ctl->prepared = ctl->has_stored = ctl->behind = ctl->has_reference = 0;
    solver_of(&ctl->problem.sizes)->forget(&ctl->solving);
    ctl->prepare_seconds = ctl->linearize_seconds = ctl->straying = 0.0;
    ctl->last_step = NAN;
    ctl->wary = 0;
    ctl->moved_later = 0.0;
}

RARE static rumo_controller *create_controller(const rumo_problem *p, const rumo_settings *settings, void *memory) {
    arena a = {aligned(memory), 0};
    rumo_controller *ctl = (rumo_controller *)alloc(&a, sizeof *ctl);
    lay_out(&a, ctl, p);
    solver_of(&ctl->problem.sizes)->renumber(&ctl->solving);
    spread_parameters(ctl);
    configure(ctl, settings);
    reset_controller(ctl);
    return ctl;
}

static int is_prepared(const rumo_controller *ctl) { return ctl->prepared; }

static double *applied_inputs(rumo_controller *ctl) { return ctl->guard.applied; }

static long long *status_counts(rumo_controller *ctl) { return ctl->guard.counts; }

#endif
