/* Making a controller: one pass over the same calls measures its memory, a second one lays it out. */
#ifndef RUMO_SET_UP_C
#define RUMO_SET_UP_C

#include "base/arena.h"
#include "base/copies.c"
#include "controller.h"
#include "guard/guard.h"
#include "numbers.c"
#include "stages/linearise.c"
#include "solve/active_set/qp.c"

/* Lay out a controller in memory, or measure it; with memory, copy the problem. */
RARE static void lay_out(arena *a, rumo_controller *ctl, const rumo_problem *p) {
    rumo_problem *const own = &ctl->problem;
    copy_rumo_problem(a, own, p, &p->sizes);
    const dims s = ctl->s = dims_of(&p->sizes);
    const ptrdiff_t np = p->sizes.parameters;
    ctl->guess_x = alloc_doubles(a, (s.N + 1) * s.nx);
    ctl->guess_u = alloc_doubles(a, s.N * s.nu);
    ctl->guess_values = unblocked(&s) ? ctl->guess_u + s.d * s.nu : alloc_doubles(a, s.n);
    ctl->free_lower = unblocked(&s) ? own->numbers.bounds.input_lower + s.d * s.nu : alloc_doubles(a, s.n);
    ctl->free_upper = unblocked(&s) ? own->numbers.bounds.input_upper + s.d * s.nu : alloc_doubles(a, s.n);
    ctl->guess_rest = alloc_doubles(a, rest_of_plan(&s));
    ctl->last_reference = alloc_doubles(a, (s.N + 1) * s.ny);
    ctl->numbers = alloc_doubles(a, size_of_plan(&s));
    ctl->inner = alloc_doubles(a, (ptrdiff_t)s.ni * s.lanes);
    ctl->guess_inner = alloc_doubles(a, (ptrdiff_t)s.ni * s.lanes);
    const rumo_guard_data guarded = {own->sizes, own->shift, own->inner_signals, own->inner_nodes, own->numbers.bounds};
    lay_out_guard(a, &ctl->guard, &guarded, plan_u(ctl), plan_x(ctl), ctl->inner);

    ctl->x_lanes = alloc_doubles(a, s.nx * (s.lanes + LANES));
    ctl->u_lanes = alloc_doubles(a, s.nu * s.lanes);
    ctl->p_lanes = alloc_doubles(a, np * s.lanes);
#ifndef RUMO_TAILORED
    const int places = register_places(&p->tape), inner_places = register_places(&p->inner_tape);
    ctl->registers = alloc_doubles(a, (ptrdiff_t)(places > inner_places ? places : inner_places) * CHUNK);
#endif
    ctl->terms = alloc_doubles(a, (ptrdiff_t)p->sizes.slots * s.lanes);
    const rumo_elimination *e = &p->elimination;
    const rumo_composition *composed = &p->composition;
    ctl->results = alloc_doubles(a, (ptrdiff_t)(s.explicit_scheme ? 1 : s.m) * e->entries * s.lanes);
    ctl->maps = s.m > 1 ? alloc_doubles(a, (ptrdiff_t)composed->entries * s.lanes) : ctl->results;
    ctl->other_maps = s.m > 1 ? alloc_doubles(a, (ptrdiff_t)composed->entries * s.lanes) : NULL;
    ctl->on_the_way = alloc_doubles(a, s.explicit_scheme ? s.nx * s.lanes : 0);
    ctl->zeros = alloc_doubles(a, s.lanes > s.nu ? s.lanes : s.nu);
    ctl->dx_lanes = alloc_doubles(a, s.ni ? s.nx * s.lanes : 0);
    ctl->du_lanes = alloc_doubles(a, s.ni ? s.nu * s.lanes : 0);
    int largest = 0;
    for (int b = 0; b < e->blocks; ++b) {
        const int size = e->size[b] * (e->size[b] + e->width[b] + 1);
        largest = size > largest ? size : largest;
    }
    ctl->work = alloc_doubles(a, largest * LANES);
    ctl->unit = alloc_doubles(a, s.nw);
    ctl->block_of = alloc_ints(a, s.nw);
    const rumo_pattern result = {e->entries, 0, e->row, e->column};
    const rumo_pattern composition = {composed->entries, 0, composed->row, composed->column};
    ctl->of_unknowns = rows_of(a, &result, s.nw);
    ctl->map = s.m > 1 ? rows_of(a, &composition, s.rows) : ctl->of_unknowns;
    ctl->map_row = s.m > 1 ? own->composition.row : own->elimination.row;
    ctl->Cx = rows_of(a, &p->Cx, s.ny);
    ctl->Cu = rows_of(a, &p->Cu, s.ny);
    ctl->D = rows_of(a, &p->D, s.nc);
    ctl->E = rows_of(a, &p->E, s.nc);
    ctl->end_of_A = alloc_ints(a, s.rows);

    condensed *d = &ctl->condensed;
    d->held = own->blocking;
    d->stages = alloc_doubles(a, (ptrdiff_t)s.N * s.width * s.ldx);
    d->response = alloc_doubles(a, (ptrdiff_t)s.N * s.rows * s.ld);
    d->outputs = alloc_doubles(a, (ptrdiff_t)s.N * s.ny * s.ld);
    d->rows = alloc_doubles(a, (ptrdiff_t)s.N * s.nc * s.ld);
    d->reach = alloc_doubles(a, s.nx);
    d->near_reach = alloc_doubles(a, s.nx);
    d->root_weights = alloc_doubles(a, s.N * s.ny);
    double **const squares[] = {&d->hessian, &d->factor, &d->inverse, &d->transpose};
    for (size_t i = 0; i < sizeof squares / sizeof *squares; ++i) *squares[i] = alloc_doubles(a, (ptrdiff_t)s.n * s.ld);
    alloc_qp(a, &ctl->q, s.n, s.nu, s.N * s.nc);
    ctl->q.hessian = d->hessian;
    ctl->q.inverse = d->inverse;
    ctl->q.transpose = d->transpose;
    ctl->q.matrix = d->rows;
    ctl->imposed_now = alloc_ints(a, s.N * s.nc);
    ctl->dx = alloc_doubles(a, (ptrdiff_t)(s.N + 1) * s.ldx);
    ctl->du = alloc_doubles(a, s.N * s.nu);
    ctl->constraints = alloc_doubles(a, s.N * s.nc);
    ctl->gradient = alloc_doubles(a, s.ld);
    ctl->best = alloc_doubles(a, s.ld);
    ctl->other = alloc_doubles(a, s.ld);
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
    ctl->prepared = ctl->balanced = ctl->settled = ctl->has_reference = 0;
    set_parameters(ctl, ctl->problem.numbers.parameter_values);
    clear_members(&ctl->q);
    ctl->prepare_seconds = ctl->linearize_seconds = ctl->straying = 0.0;
    ctl->last_step = NAN;
}

RARE static rumo_controller *create_controller(const rumo_problem *p, const rumo_settings *settings, void *memory) {
    arena a = {aligned(memory), 0};
    rumo_controller *ctl = (rumo_controller *)alloc(&a, sizeof *ctl);
    lay_out(&a, ctl, p);
    const dims *s = &ctl->s;
    for (int i = 0; i < p->sizes.slots; ++i)
        for (int k = 0; k < s->lanes; ++k) ctl->terms[(ptrdiff_t)i * s->lanes + k] = isnan(p->fixed[i]) ? 0.0 : p->fixed[i];
    for (int r = 0; r < s->rows; ++r) {
        ctl->end_of_A[r] = ctl->map.start[r];
        while (ctl->end_of_A[r] < ctl->map.start[r + 1] && ctl->map.column[ctl->end_of_A[r]] < s->nx) ++ctl->end_of_A[r];
    }
    for (int i = 0; i < s->N * s->nc; ++i) ctl->q.extent[i] = padded(inputs_at(s, &ctl->condensed.held, i / s->nc));
    derive_numbers(ctl);
    configure(ctl, settings);
    reset_controller(ctl);
    return ctl;
}

static int is_prepared(const rumo_controller *ctl) { return ctl->prepared; }

static double *applied_inputs(rumo_controller *ctl) { return ctl->guard.applied; }

static long long *status_counts(rumo_controller *ctl) { return ctl->guard.counts; }

#endif
