/* Whether a problem can be what it says: sizes, indices, order of entries, numbers. Nothing else in the core looks. */
#ifndef RUMO_CHECK_C
#define RUMO_CHECK_C

#include "numbers.c"
#include "rules.c"

/* Which range the words of a list of entries (count, width) are in: from `least` to below these. */
typedef struct ranges {
    int least, below[3];
} ranges;

RARE static rumo_fault check_words(const char *part, const char *member, const int *x, int count, int width,
                                   ranges in) {
    for (int i = 0; i < count * width; ++i)
        if (x[i] < in.least || x[i] >= in.below[i % width]) return (rumo_fault){RUMO_OUT_OF_RANGE, part, member, i};
    return no_fault;
}

RARE static rumo_fault check_order(const char *part, const int *rows, int count) {
    for (int e = 1; e < count; ++e)
        if (rows[e] < rows[e - 1]) return (rumo_fault){RUMO_OUT_OF_ORDER, part, "row", e};
    return no_fault;
}

#define TRY(check)                            \
    do {                                      \
        const rumo_fault found = (check);     \
        if (found.error) return found;        \
    } while (0)

/* Entries at rows and columns, sorted by rows, then by columns, and none of them twice: room is laid out for as many products
 * of entries as there can be, and those of states come before those of inputs. */
RARE static rumo_fault check_places(const char *part, const int *row, const int *column, int count, int rows,
                                    int columns) {
    TRY(check_words(part, "row", row, count, 1, (ranges){0, {rows, 0, 0}}));
    TRY(check_words(part, "column", column, count, 1, (ranges){0, {columns, 0, 0}}));
    TRY(check_order(part, row, count));
    for (int e = 1; e < count; ++e)
        if (row[e] == row[e - 1] && column[e] <= column[e - 1]) return (rumo_fault){RUMO_OUT_OF_ORDER, part, "column", e};
    return no_fault;
}

RARE static rumo_fault check_pattern(const char *part, const rumo_pattern *p, int rows, int columns, int slots) {
    if (p->first > slots - p->count) return (rumo_fault){RUMO_OUT_OF_RANGE, part, "first", -1};
    return check_places(part, p->row, p->column, p->count, rows, columns);
}

static int takes_two(int operation) {
    switch ((rumo_operation)operation) {
    case RUMO_ADD:
    case RUMO_SUB:
    case RUMO_MUL:
    case RUMO_DIV:
    case RUMO_ATAN2:
    case RUMO_POW:
    case RUMO_HYPOT:
    case RUMO_COPYSIGN:
    case RUMO_FMOD:
    case RUMO_FMIN:
    case RUMO_FMAX:
    case RUMO_LT:
    case RUMO_LE:
    case RUMO_EQ:
    case RUMO_NE:
    case RUMO_AND:
    case RUMO_OR:
    case RUMO_IF_ELSE_ZERO: return 1;
    default: return 0;
    }
}

RARE static rumo_fault check_tape(const char *part, const rumo_tape *tape, const rumo_sizes *s) {
    const int others = s->explicit_scheme ? 0 : RUMO_UNKNOWNS - s->states; /* there is no guess of what an explicit one has inside */
    const int arguments[ARGUMENTS] = {s->states, s->states, s->inputs, s->parameters, others};
    for (int i = 0; i < tape->length; ++i) {
        const int operation = tape->code[4 * i], result = tape->code[4 * i + 1], a = tape->code[4 * i + 2],
                  b = tape->code[4 * i + 3], registers = tape->registers;
        int fine = operation >= 0 && operation < RUMO_OPERATION_COUNT && result >= 0 && a >= 0 && b >= 0;
        fine = fine && result < (operation == RUMO_OUTPUT ? s->slots : registers);
        if (operation == RUMO_INPUT) fine = fine && a < ARGUMENTS && b < arguments[a];
        else if (operation != RUMO_CONSTANT) fine = fine && a < registers && (!takes_two(operation) || b < registers);
        if (!fine) return (rumo_fault){RUMO_OUT_OF_RANGE, part, "code", i};
    }
    return no_fault;
}

/* A permutation of the unknowns. */
RARE static rumo_fault check_all_once(const char *part, const char *member, const int *x, int count) {
    TRY(check_words(part, member, x, count, 1, (ranges){0, {count, 0, 0}}));
    for (int i = 0; i < count; ++i)
        for (int j = 0; j < i; ++j)
            if (x[i] == x[j]) return (rumo_fault){RUMO_OUT_OF_RANGE, part, member, i};
    return no_fault;
}

RARE static rumo_fault check_elimination(const rumo_elimination *e, const rumo_sizes *s, int wide) {
    const char *const part = "elimination";
    const int nw = RUMO_UNKNOWNS, known = s->states + s->inputs + 1;
    const ranges any = {0, {1 << 20, 0, 0}}; /* lengths: nothing is that long */
    const int *const counts[] = {e->loads, e->updates, e->stores};
    const char *const names[] = {"loads", "updates", "stores"};
    TRY(check_words(part, "below", e->below, nw, 1, any));
    TRY(check_words(part, "across", e->across, nw, 1, any));
    if (wide) return no_fault;
    for (int i = 0; i < 3; ++i) TRY(check_words(part, names[i], counts[i], e->blocks, 1, any));
    TRY(check_words(part, "size", e->size, e->blocks, 1, (ranges){1, {nw + 1, 0, 0}}));
    TRY(check_words(part, "sparse", e->sparse, e->blocks, 1, (ranges){0, {2, 0, 0}}));
    TRY(check_words(part, "width", e->width, e->blocks, 1, (ranges){0, {known + 1, 0, 0}}));
    if (rumo_sum(e->size, e->blocks) != nw) return (rumo_fault){RUMO_OUT_OF_RANGE, part, "size", e->blocks};
    const int *load = e->load, *update = e->update, *store = e->store, *lower = e->lower, *upper = e->upper;
    for (int b = 0, r = 0; b < e->blocks; ++b) {
        for (int p = 0; p < e->size[b]; ++p, ++r) {
            TRY(check_words(part, "lower", lower, e->below[r], 1, (ranges){p + 1, {e->size[b], 0, 0}}));
            TRY(check_words(part, "upper", upper, e->across[r], 1, (ranges){p + 1, {e->size[b] + e->width[b], 0, 0}}));
            lower += e->below[r];
            upper += e->across[r];
        }
        const int places = e->size[b] * (e->size[b] + e->width[b] + 1);
        TRY(check_words(part, "load", load, e->loads[b], 2, (ranges){0, {s->slots, places, 0}}));
        TRY(check_words(part, "update", update, e->updates[b], 3, (ranges){0, {s->slots, e->entries, places}}));
        TRY(check_words(part, "store", store, e->stores[b], 2, (ranges){0, {places, e->entries, 0}}));
        load += 2 * e->loads[b];
        update += 3 * e->updates[b];
        store += 2 * e->stores[b];
    }
    return check_places(part, e->row, e->column, e->entries, nw, known);
}

RARE static rumo_fault check_factor(const rumo_factor *f, const rumo_sizes *s) {
    const char *const part = "factor";
    const int nw = f->unknowns;
    if (nw != 0 && nw != RUMO_UNKNOWNS) return (rumo_fault){RUMO_OUT_OF_RANGE, part, "unknowns", -1};
    TRY(check_words(part, "size", f->size, f->blocks, 1, (ranges){1, {nw + 1, 0, 0}}));
    if (rumo_sum(f->size, f->blocks) != nw) return (rumo_fault){RUMO_OUT_OF_RANGE, part, "size", f->blocks};
    TRY(check_all_once(part, "equation", f->equation, nw));
    TRY(check_all_once(part, "unknown", f->unknown, nw));
    TRY(check_words(part, "nonzero", f->nonzero, f->outer + f->inner, 3, (ranges){0, {s->slots, nw, nw}}));
    for (int e = 1; e < f->outer; ++e)
        if (f->nonzero[3 * e + 1] < f->nonzero[3 * e - 2]) return (rumo_fault){RUMO_OUT_OF_ORDER, part, "nonzero", 3 * e + 1};
    const int *below = f->below, *later = f->later, *target = f->target;
    int entries = 0;
    for (int b = 0, pivot = 0; b < f->blocks; ++b) {
        const int size = f->size[b], own = size + 2 * rumo_sum(below, size);
        for (int p = 0; p < size; ++p, ++pivot, later += *below, target += *below * *below, ++below) {
            if (*below < 0 || *below >= size - p) return (rumo_fault){RUMO_OUT_OF_RANGE, part, "below", pivot};
            TRY(check_words(part, "later", later, *below, 1, (ranges){p + 1, {size, 0, 0}}));
            TRY(check_words(part, "target", target, *below * *below, 1, (ranges){0, {own, 0, 0}}));
        }
        entries += own;
    }
    return check_words(part, "entry", f->entry, f->inner, 1, (ranges){0, {entries, 0, 0}});
}

RARE static rumo_fault check_composition(const rumo_problem *p) {
    const char *const part = "composition";
    const rumo_composition *c = &p->composition;
    const rumo_sizes *s = &p->sizes;
    const ranges own = {-1, {p->elimination.entries, 0, 0}};
    TRY(check_places(part, c->row, c->column, c->entries, s->states + s->algebraic, s->states + s->inputs + 1));
    TRY(check_words(part, "start", c->start, c->entries, 1, own));
    TRY(check_words(part, "own", c->own, c->entries, 1, own));
    TRY(check_words(part, "products", c->products, c->entries, 1, (ranges){0, {1 << 20, 0, 0}}));
    return check_words(part, "product", c->product, rumo_sum(c->products, c->entries), 2,
                       (ranges){0, {p->elimination.entries, c->entries, 0}});
}

RARE static rumo_fault check_shift(const rumo_shift *shift, const int *inner_signals, const rumo_sizes *s) {
    const ranges intervals = {0, {s->horizon, 0, 0}};
    TRY(check_words("shift", "stages", shift->stages, s->horizon + 1, 1, intervals));
    TRY(check_words("shift", "intervals", shift->intervals, s->horizon, 1, intervals));
    const ranges signals = {0, {s->states + s->algebraic, 0, 0}};
    return check_words("", "inner_signals", inner_signals, RUMO_INNER, 1, signals);
}

/* Blocks come one after the other, and none is left out. */
RARE static rumo_fault check_blocking(const rumo_blocking *held, const rumo_sizes *s) {
    int block = 0;
    for (int k = s->delay; k < s->horizon; ++k) {
        const int next = held->block[k];
        if (next != block && (next != block + 1 || k == s->delay))
            return (rumo_fault){RUMO_OUT_OF_ORDER, "blocking", "block", k};
        block = next;
    }
    return block == s->blocks - 1 ? no_fault : (rumo_fault){RUMO_OUT_OF_RANGE, "blocking", "block", s->horizon - 1};
}

RARE static rumo_fault check_ages(const rumo_sensors *sensors, const rumo_sizes *s) {
    return check_words("sensors", "age", sensors->age, s->states, 1, (ranges){0, {s->horizon + 1, 0, 0}});
}

RARE static rumo_fault check_problem(const rumo_problem *p) {
    const rumo_sizes *s = &p->sizes;
    TRY(check_rumo_problem("", p, s));
    const int nw = RUMO_UNKNOWNS, rows = s->states + s->algebraic, slots = s->slots;
    if (s->blocks < 1) return (rumo_fault){RUMO_TOO_SMALL, "sizes", "blocks", -1};
    TRY(check_tape("tape", &p->tape, s));
    TRY(check_tape("inner_tape", &p->inner_tape, s));
    TRY(check_pattern("A0", &p->A0, nw, s->states, slots));
    TRY(check_pattern("M", &p->M, nw, nw, slots));
    TRY(check_pattern("B", &p->B, nw, s->inputs, slots));
    TRY(check_pattern("Cx", &p->Cx, s->outputs, rows, slots));
    TRY(check_pattern("Cu", &p->Cu, s->outputs, s->inputs, slots));
    TRY(check_pattern("D", &p->D, s->constraints, rows, slots));
    TRY(check_pattern("E", &p->E, s->constraints, s->inputs, slots));
    if (p->y_first > slots - s->outputs) return (rumo_fault){RUMO_OUT_OF_RANGE, "", "y_first", -1};
    if (p->G_first > slots - s->constraints) return (rumo_fault){RUMO_OUT_OF_RANGE, "", "G_first", -1};
    if (p->defect_first > slots - nw) return (rumo_fault){RUMO_OUT_OF_RANGE, "", "defect_first", -1};
    if (p->Cx.first < p->defect_first + nw) return (rumo_fault){RUMO_OUT_OF_ORDER, "Cx", "first", -1};
    const int wide = p->elimination.blocks == 0 && p->elimination.entries == 0 && p->factor.unknowns > 0;
    if (wide && !s->condensing) return (rumo_fault){RUMO_TOO_SMALL, "sizes", "condensing", -1};
    TRY(check_elimination(&p->elimination, s, wide));
    TRY(check_factor(&p->factor, s));
    for (int b = 0; b < p->elimination.blocks; ++b)
        if (p->elimination.sparse[b] && (b >= p->factor.blocks || p->factor.size[b] != p->elimination.size[b]))
            return (rumo_fault){RUMO_OUT_OF_RANGE, "elimination", "sparse", b};
    TRY(check_composition(p));
    TRY(check_shift(&p->shift, p->inner_signals, s));
    TRY(check_blocking(&p->blocking, s));
    TRY(check_ages(&p->sensors, s));
    TRY(check_words("", "output_states", p->output_states, s->outputs, 1, (ranges){-1, {s->states, 0, 0}}));
    return check_numbers(&p->numbers, p);
}

RARE static rumo_fault check_guard_data(const rumo_guard_data *g) {
    TRY(check_rumo_guard_data("", g, &g->sizes));
    TRY(check_shift(&g->shift, g->inner_signals, &g->sizes));
    TRY(check_ages(&g->sensors, &g->sizes));
    return check_bounds(&g->bounds, &g->sizes);
}

#endif
