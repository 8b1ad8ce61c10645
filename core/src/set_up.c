/* Making a controller: one pass over the same calls measures its memory, a second one lays it out. */
#ifndef RUMO_SET_UP_C
#define RUMO_SET_UP_C

#include "base/arena.h"
#include "controller.h"
#include "stages/linearise.c"
#include "solve/active_set/qp.c"

static void copy_pattern(arena *a, rumo_pattern *pattern) {
    pattern->row = copy_ints(a, pattern->row, pattern->count);
    pattern->column = copy_ints(a, pattern->column, pattern->count);
}

static int total(const int *counts, int count) {
    int sum = 0;
    for (int i = 0; i < count; ++i) sum += counts[i];
    return sum;
}

static void copy_tape(arena *a, rumo_tape *tape) {
    tape->code = copy_ints(a, tape->code, (ptrdiff_t)4 * tape->length);
    tape->constants = copy_doubles(a, tape->constants, tape->length);
}

RARE static void copy_elimination(arena *a, rumo_elimination *e, int unknowns) {
    const int blocks = e->blocks, loads = total(e->loads, blocks), updates = total(e->updates, blocks),
              stores = total(e->stores, blocks);
    e->size = copy_ints(a, e->size, blocks);
    e->width = copy_ints(a, e->width, blocks);
    e->loads = copy_ints(a, e->loads, blocks);
    e->updates = copy_ints(a, e->updates, blocks);
    e->stores = copy_ints(a, e->stores, blocks);
    e->unknowns = copy_ints(a, e->unknowns, unknowns);
    e->load = copy_ints(a, e->load, (ptrdiff_t)2 * loads);
    e->update = copy_ints(a, e->update, (ptrdiff_t)3 * updates);
    e->store = copy_ints(a, e->store, (ptrdiff_t)2 * stores);
    e->row = copy_ints(a, e->row, e->entries);
    e->column = copy_ints(a, e->column, e->entries);
}

RARE static void copy_composition(arena *a, rumo_composition *p) {
    const int products = total(p->products, p->entries);
    p->row = copy_ints(a, p->row, p->entries);
    p->column = copy_ints(a, p->column, p->entries);
    p->start = copy_ints(a, p->start, p->entries);
    p->own = copy_ints(a, p->own, p->entries);
    p->products = copy_ints(a, p->products, p->entries);
    p->product = copy_ints(a, p->product, (ptrdiff_t)2 * products);
}

/* Lay out a controller in memory, or measure it; with memory, copy the problem. */
RARE static void lay_out(arena *a, rumo_controller *ctl, const rumo_problem *p) {
    ctl->problem = *p;
    rumo_problem *own = &ctl->problem;
    const dims s = ctl->s = dims_of(&p->sizes);
    const ptrdiff_t np = p->sizes.parameters;
    copy_tape(a, &own->tape);
    copy_tape(a, &own->inner_tape);
    copy_pattern(a, &own->M);
    copy_elimination(a, &own->elimination, s.nw);
    copy_composition(a, &own->composition);
    own->shift.stages = copy_ints(a, p->shift.stages, s.N + 1);
    own->shift.shares = copy_doubles(a, p->shift.shares, s.N + 1);
    own->shift.intervals = copy_ints(a, p->shift.intervals, s.N);
    own->inner_signals = copy_ints(a, p->inner_signals, s.ni);
    own->inner_nodes = copy_doubles(a, p->inner_nodes, s.ni);
    own->algebraic_guess = copy_doubles(a, p->algebraic_guess, s.nz);
    own->output_weights = NULL; /* kept as roots */
    own->move_weights = copy_doubles(a, p->move_weights, s.n);
    own->input_scales = copy_doubles(a, p->input_scales, s.nu);
    own->input_lower = copy_doubles(a, p->input_lower, s.nu);
    own->input_upper = copy_doubles(a, p->input_upper, s.nu);
    own->move_lower = copy_doubles(a, p->move_lower, s.nu);
    own->move_upper = copy_doubles(a, p->move_upper, s.nu);
    own->block_lower = copy_doubles(a, p->block_lower, s.n);
    own->block_upper = copy_doubles(a, p->block_upper, s.n);
    own->safe_input = copy_doubles(a, p->safe_input, s.nu);
    own->constraint_scales = copy_doubles(a, p->constraint_scales, s.nc);
    own->l1 = own->l2 = NULL; /* kept in the QP */
    own->imposed = copy_ints(a, p->imposed, s.N * s.nc);
    own->parameters = copy_doubles(a, p->parameters, s.N * np);
    own->fixed = NULL; /* kept in lanes */

    ctl->applied = alloc_doubles(a, decided_inputs(&s) * s.nu);
    ctl->guess_x = alloc_doubles(a, (s.N + 1) * s.nx);
    ctl->guess_u = alloc_doubles(a, s.N * s.nu);
    ctl->guess_values = unblocked(&s) ? ctl->guess_u + s.d * s.nu : alloc_doubles(a, s.n);
    ctl->guess_rest = alloc_doubles(a, rest_of_plan(&s));
    ctl->last_reference = alloc_doubles(a, (s.N + 1) * s.ny);
    ctl->previous_x = alloc_doubles(a, (s.N + 1) * s.nx);
    ctl->previous_u = alloc_doubles(a, s.N * s.nu);
    ctl->numbers = alloc_doubles(a, size_of_plan(&s));
    double **const inner[] = {&ctl->inner, &ctl->guess_inner, &ctl->previous_inner};
    for (size_t i = 0; i < sizeof inner / sizeof *inner; ++i) *inner[i] = alloc_doubles(a, (ptrdiff_t)s.ni * s.lanes);
    ctl->suspect = alloc_doubles(a, s.nx);
    ctl->last_x = alloc_doubles(a, s.nx);

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
    d->held.block = copy_ints(a, p->blocking.block, s.N);
    d->held.share = copy_doubles(a, p->blocking.share, s.N);
    d->held.part = copy_doubles(a, p->blocking.part, s.N);
    d->stages = alloc_doubles(a, (ptrdiff_t)s.N * s.width * s.ldx);
    d->response = alloc_doubles(a, (ptrdiff_t)s.N * s.rows * s.ld);
    d->outputs = alloc_doubles(a, (ptrdiff_t)s.N * s.ny * s.ld);
    d->rows = alloc_doubles(a, (ptrdiff_t)s.N * s.nc * s.ld);
    d->reach = alloc_doubles(a, s.nx);
    d->near_reach = alloc_doubles(a, s.nx);
    d->root_weights = alloc_doubles(a, s.N * s.ny);
    double **const squares[] = {&d->hessian, &d->factor, &d->inverse, &d->transpose};
    for (size_t i = 0; i < sizeof squares / sizeof *squares; ++i) *squares[i] = alloc_doubles(a, (ptrdiff_t)s.n * s.ld);
    int limited = 0;
    for (int j = 0; j < s.nu; ++j) limited |= isfinite(p->move_lower[j]) || isfinite(p->move_upper[j]);
    alloc_qp(a, &ctl->q, s.n, s.nu, s.N * s.nc, limited);
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

static void set_parameters(rumo_controller *ctl, const double *parameters) {
    const int np = ctl->problem.sizes.parameters;
    to_lanes(parameters, np, np, ctl->s.N, ctl->s.lanes, ctl->p_lanes);
    ctl->prepared = 0;
}

static void configure(rumo_controller *ctl, const rumo_settings *settings) { ctl->settings = *settings; }

RARE static void reset_controller(rumo_controller *ctl) {
    ctl->has_guess = ctl->has_previous = ctl->prepared = ctl->inputs_left = ctl->balanced = 0;
    ctl->implausible = ctl->repeats = ctl->changes = ctl->has_last = ctl->blameless = ctl->settled = ctl->has_reference = 0;
    const int decided = decided_inputs(&ctl->s);
    for (int k = 0; k < decided; ++k) copy(ctl->applied + k * ctl->s.nu, ctl->problem.safe_input, ctl->s.nu);
    set_parameters(ctl, ctl->problem.parameters);
    memset(ctl->counts, 0, sizeof ctl->counts);
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
    for (int i = 0; i < s->N * s->ny; ++i) ctl->condensed.root_weights[i] = sqrt(2.0 * p->output_weights[i]);
    for (int r = 0; r < s->rows; ++r) {
        ctl->end_of_A[r] = ctl->map.start[r];
        while (ctl->end_of_A[r] < ctl->map.start[r + 1] && ctl->map.column[ctl->end_of_A[r]] < s->nx) ++ctl->end_of_A[r];
    }
    for (int i = 0; i < s->N * s->nc; ++i) {
        const int row = ctl->q.dense + i;
        ctl->q.l1[row] = p->l1[i % s->nc];
        ctl->q.l2[row] = p->l2[i % s->nc];
        ctl->q.extent[i] = padded(inputs_at(s, &ctl->condensed.held, i / s->nc));
    }
    configure(ctl, settings);
    reset_controller(ctl);
    return ctl;
}

static double *applied_inputs(rumo_controller *ctl) { return ctl->applied; }

static long long *status_counts(rumo_controller *ctl) { return ctl->counts; }

#endif
