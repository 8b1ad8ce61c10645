/* Making a controller: one pass over the same calls measures its memory, a second one lays it out. */

static dims dims_of(const rumo_sizes *p) {
#ifdef RUMO_TAILORED
    static const rumo_sizes tailored = {RUMO_SIZES};
    p = &tailored;
#endif
    dims s;
    s.N = p->horizon;
    s.d = p->delay;
    s.nx = p->states;
    s.nz = p->algebraic;
    s.nu = p->inputs;
    s.ny = p->outputs;
    s.nc = p->constraints;
    s.lanes = padded(s.N);
    s.m = p->substeps;
    s.nw = s.nx + s.nz + p->inner;
    s.explicit_scheme = p->explicit_scheme;
    s.ni = s.explicit_scheme ? 0 : s.m * s.nw - s.nx;
    s.nb = p->blocks;
    s.n = s.nb * s.nu;
    s.ld = padded(s.n);
    s.rows = s.nx + s.nz;
    s.width = s.nx + s.nu + 1;
    s.ldx = padded(s.rows);
    return s;
}

static sparse rows_of(arena *a, const rumo_pattern *pattern, int rows) {
    int *start = take_ints(a, rows + 1);
    if (start)
        for (int e = 0; e < pattern->count; ++e) ++start[pattern->row[e] + 1];
    if (start)
        for (int r = 0; r < rows; ++r) start[r + 1] += start[r];
    return (sparse){pattern->first, start, keep_ints(a, pattern->column, pattern->count)};
}

static void keep_pattern(arena *a, rumo_pattern *pattern) {
    pattern->row = keep_ints(a, pattern->row, pattern->count);
    pattern->column = keep_ints(a, pattern->column, pattern->count);
}

static int total(const int *counts, int count) {
    int sum = 0;
    for (int i = 0; i < count; ++i) sum += counts[i];
    return sum;
}

static void keep_tape(arena *a, rumo_tape *tape) {
    tape->code = keep_ints(a, tape->code, (ptrdiff_t)4 * tape->length);
    tape->constants = keep_doubles(a, tape->constants, tape->length);
}

RARE static void keep_elimination(arena *a, rumo_elimination *e, int unknowns) {
    const int blocks = e->blocks, loads = total(e->loads, blocks), updates = total(e->updates, blocks),
              stores = total(e->stores, blocks);
    e->size = keep_ints(a, e->size, blocks);
    e->width = keep_ints(a, e->width, blocks);
    e->loads = keep_ints(a, e->loads, blocks);
    e->updates = keep_ints(a, e->updates, blocks);
    e->stores = keep_ints(a, e->stores, blocks);
    e->unknowns = keep_ints(a, e->unknowns, unknowns);
    e->load = keep_ints(a, e->load, (ptrdiff_t)2 * loads);
    e->update = keep_ints(a, e->update, (ptrdiff_t)3 * updates);
    e->store = keep_ints(a, e->store, (ptrdiff_t)2 * stores);
    e->row = keep_ints(a, e->row, e->entries);
    e->column = keep_ints(a, e->column, e->entries);
}

RARE static void keep_composition(arena *a, rumo_composition *c) {
    const int products = total(c->products, c->entries);
    c->row = keep_ints(a, c->row, c->entries);
    c->column = keep_ints(a, c->column, c->entries);
    c->start = keep_ints(a, c->start, c->entries);
    c->own = keep_ints(a, c->own, c->entries);
    c->products = keep_ints(a, c->products, c->entries);
    c->product = keep_ints(a, c->product, (ptrdiff_t)2 * products);
}

/* Lay out a controller in memory, or measure it; with memory, copy the problem. */
RARE static void lay_out(arena *a, rumo_controller *c, const rumo_problem *p) {
    c->problem = *p;
    rumo_problem *own = &c->problem;
    const dims s = c->s = dims_of(&p->sizes);
    const ptrdiff_t np = p->sizes.parameters;
    keep_tape(a, &own->tape);
    keep_tape(a, &own->inner_tape);
    keep_pattern(a, &own->M);
    keep_elimination(a, &own->elimination, s.nw);
    keep_composition(a, &own->composition);
    own->shift.stages = keep_ints(a, p->shift.stages, s.N + 1);
    own->shift.shares = keep_doubles(a, p->shift.shares, s.N + 1);
    own->shift.intervals = keep_ints(a, p->shift.intervals, s.N);
    own->inner_signals = keep_ints(a, p->inner_signals, s.ni);
    own->inner_nodes = keep_doubles(a, p->inner_nodes, s.ni);
    own->algebraic_guess = keep_doubles(a, p->algebraic_guess, s.nz);
    own->output_weights = NULL; /* kept as roots */
    own->move_weights = keep_doubles(a, p->move_weights, s.n);
    own->input_scales = keep_doubles(a, p->input_scales, s.nu);
    own->input_lower = keep_doubles(a, p->input_lower, s.nu);
    own->input_upper = keep_doubles(a, p->input_upper, s.nu);
    own->move_lower = keep_doubles(a, p->move_lower, s.nu);
    own->move_upper = keep_doubles(a, p->move_upper, s.nu);
    own->block_lower = keep_doubles(a, p->block_lower, s.n);
    own->block_upper = keep_doubles(a, p->block_upper, s.n);
    own->safe_input = keep_doubles(a, p->safe_input, s.nu);
    own->constraint_scales = keep_doubles(a, p->constraint_scales, s.nc);
    own->l1 = own->l2 = NULL; /* kept in the QP */
    own->imposed = keep_ints(a, p->imposed, s.N * s.nc);
    own->parameters = keep_doubles(a, p->parameters, s.N * np);
    own->fixed = NULL; /* kept in lanes */

    c->applied = take_doubles(a, (s.d > 1 ? s.d : 1) * s.nu);
    c->guess_x = take_doubles(a, (s.N + 1) * s.nx);
    c->guess_u = take_doubles(a, s.N * s.nu);
    c->guess_values = unblocked(&s) ? c->guess_u + s.d * s.nu : take_doubles(a, s.n);
    c->guess_rest = take_doubles(a, rest_of_plan(&s));
    c->last_reference = take_doubles(a, (s.N + 1) * s.ny);
    c->previous_x = take_doubles(a, (s.N + 1) * s.nx);
    c->previous_u = take_doubles(a, s.N * s.nu);
    c->numbers = take_doubles(a, size_of_plan(&s));
    double **const inner[] = {&c->inner, &c->guess_inner, &c->previous_inner};
    for (size_t i = 0; i < sizeof inner / sizeof *inner; ++i) *inner[i] = take_doubles(a, (ptrdiff_t)s.ni * s.lanes);
    c->suspect = take_doubles(a, s.nx);
    c->last_x = take_doubles(a, s.nx);

    c->x_lanes = take_doubles(a, s.nx * (s.lanes + LANES));
    c->u_lanes = take_doubles(a, s.nu * s.lanes);
    c->p_lanes = take_doubles(a, np * s.lanes);
#ifndef RUMO_TAILORED
    const int places = register_places(&p->tape), inner_places = register_places(&p->inner_tape);
    c->registers = take_doubles(a, (ptrdiff_t)(places > inner_places ? places : inner_places) * CHUNK);
#endif
    c->terms = take_doubles(a, (ptrdiff_t)p->sizes.slots * s.lanes);
    const rumo_elimination *e = &p->elimination;
    const rumo_composition *composed = &p->composition;
    c->results = take_doubles(a, (ptrdiff_t)(s.explicit_scheme ? 1 : s.m) * e->entries * s.lanes);
    c->maps = s.m > 1 ? take_doubles(a, (ptrdiff_t)composed->entries * s.lanes) : c->results;
    c->other_maps = s.m > 1 ? take_doubles(a, (ptrdiff_t)composed->entries * s.lanes) : NULL;
    c->on_the_way = take_doubles(a, s.explicit_scheme ? s.nx * s.lanes : 0);
    c->zeros = take_doubles(a, s.lanes > s.nu ? s.lanes : s.nu);
    c->dx_lanes = take_doubles(a, s.ni ? s.nx * s.lanes : 0);
    c->du_lanes = take_doubles(a, s.ni ? s.nu * s.lanes : 0);
    int largest = 0;
    for (int b = 0; b < e->blocks; ++b) {
        const int size = e->size[b] * (e->size[b] + e->width[b] + 1);
        largest = size > largest ? size : largest;
    }
    c->work = take_doubles(a, largest * LANES);
    c->unit = take_doubles(a, s.nw);
    c->block_of = take_ints(a, s.nw);
    const rumo_pattern result = {e->entries, 0, e->row, e->column};
    const rumo_pattern composition = {composed->entries, 0, composed->row, composed->column};
    c->of_unknowns = rows_of(a, &result, s.nw);
    c->map = s.m > 1 ? rows_of(a, &composition, s.rows) : c->of_unknowns;
    c->map_row = s.m > 1 ? own->composition.row : own->elimination.row;
    c->Cx = rows_of(a, &p->Cx, s.ny);
    c->Cu = rows_of(a, &p->Cu, s.ny);
    c->D = rows_of(a, &p->D, s.nc);
    c->E = rows_of(a, &p->E, s.nc);
    c->end_of_A = take_ints(a, s.rows);

    condensed *d = &c->c;
    d->held.block = keep_ints(a, p->blocking.block, s.N);
    d->held.share = keep_doubles(a, p->blocking.share, s.N);
    d->held.part = keep_doubles(a, p->blocking.part, s.N);
    d->stages = take_doubles(a, (ptrdiff_t)s.N * s.width * s.ldx);
    d->response = take_doubles(a, (ptrdiff_t)s.N * s.rows * s.ld);
    d->outputs = take_doubles(a, (ptrdiff_t)s.N * s.ny * s.ld);
    d->rows = take_doubles(a, (ptrdiff_t)s.N * s.nc * s.ld);
    d->reach = take_doubles(a, s.nx);
    d->near_reach = take_doubles(a, s.nx);
    d->root_weights = take_doubles(a, s.N * s.ny);
    double **const squares[] = {&d->hessian, &d->factor, &d->inverse, &d->transpose};
    for (size_t i = 0; i < sizeof squares / sizeof *squares; ++i) *squares[i] = take_doubles(a, (ptrdiff_t)s.n * s.ld);
    int limited = 0;
    for (int j = 0; j < s.nu; ++j) limited |= isfinite(p->move_lower[j]) || isfinite(p->move_upper[j]);
    take_qp(a, &c->q, s.n, s.nu, s.N * s.nc, limited);
    c->q.hessian = d->hessian;
    c->q.inverse = d->inverse;
    c->q.transpose = d->transpose;
    c->q.matrix = d->rows;
    c->imposed_now = take_ints(a, s.N * s.nc);
    c->dx = take_doubles(a, (ptrdiff_t)(s.N + 1) * s.ldx);
    c->du = take_doubles(a, s.N * s.nu);
    c->constraints = take_doubles(a, s.N * s.nc);
    c->gradient = take_doubles(a, s.ld);
    c->best = take_doubles(a, s.ld);
    c->other = take_doubles(a, s.ld);
}

RARE static size_t controller_size(const rumo_problem *p) {
    rumo_controller c;
    arena a = {NULL, 0};
    (void)take(&a, sizeof c);
    lay_out(&a, &c, p);
    return a.used + ALIGNMENT;
}

static void set_parameters(rumo_controller *c, const double *parameters) {
    const int np = c->problem.sizes.parameters;
    to_lanes(parameters, np, np, c->s.N, c->s.lanes, c->p_lanes);
    c->prepared = 0;
}

static void configure(rumo_controller *c, const rumo_settings *settings) { c->settings = *settings; }

RARE static void reset_controller(rumo_controller *c) {
    c->has_guess = c->has_previous = c->prepared = c->inputs_left = c->balanced = 0;
    c->implausible = c->repeats = c->changes = c->has_last = c->blameless = c->settled = c->has_reference = 0;
    const int decided = c->s.d > 1 ? c->s.d : 1;
    for (int k = 0; k < decided; ++k) copy(c->applied + k * c->s.nu, c->problem.safe_input, c->s.nu);
    set_parameters(c, c->problem.parameters);
    memset(c->counts, 0, sizeof c->counts);
    clear_members(&c->q);
    c->prepare_seconds = c->linearize_seconds = c->straying = 0.0;
    c->last_step = NAN;
}

RARE static rumo_controller *create_controller(const rumo_problem *p, const rumo_settings *settings, void *memory) {
    arena a = {aligned(memory), 0};
    rumo_controller *c = (rumo_controller *)take(&a, sizeof *c);
    lay_out(&a, c, p);
    const dims *s = &c->s;
    for (int i = 0; i < p->sizes.slots; ++i)
        for (int k = 0; k < s->lanes; ++k) c->terms[(ptrdiff_t)i * s->lanes + k] = isnan(p->fixed[i]) ? 0.0 : p->fixed[i];
    for (int i = 0; i < s->N * s->ny; ++i) c->c.root_weights[i] = sqrt(2.0 * p->output_weights[i]);
    for (int r = 0; r < s->rows; ++r) {
        c->end_of_A[r] = c->map.start[r];
        while (c->end_of_A[r] < c->map.start[r + 1] && c->map.column[c->end_of_A[r]] < s->nx) ++c->end_of_A[r];
    }
    for (int i = 0; i < s->N * s->nc; ++i) {
        const int row = c->q.dense + i;
        c->q.l1[row] = p->l1[i % s->nc];
        c->q.l2[row] = p->l2[i % s->nc];
        c->q.extent[i] = padded(inputs_at(s, &c->c.held, i / s->nc));
    }
    configure(c, settings);
    reset_controller(c);
    return c;
}

static double *applied_inputs(rumo_controller *c) { return c->applied; }

static long long *status_counts(rumo_controller *c) { return c->counts; }
