/* Making an integrator. */
#ifndef RUMO_INTEGRATOR_C
#define RUMO_INTEGRATOR_C

#include "base/arena.h"
#include "base/copies.c"
#include "check.c"
#include "integrate/growth.c"
#include "integrate/integrator.h"
#include "stages/tape.c"

/* More variables than this are not solved for by dense matrices. */
#define MOST_DENSE 1000

/* On what the Jacobian depends: ON_VARIABLES, ON_INPUTS, ON_PARAMETERS. */
static int find_dependence(const rumo_integrator *q) {
    const int of_arguments[ARGUMENTS] = {ON_VARIABLES, ON_VARIABLES, ON_INPUTS, ON_PARAMETERS, ON_VARIABLES};
    const rumo_tape *const tape = &q->system.jacobian;
    double *const of = q->registers;
    int all = 0;
    for (int i = 0; i < tape->length; ++i) {
        const int *const code = tape->code + 4 * (ptrdiff_t)i;
        if (code[0] == RUMO_CONSTANT) of[code[1]] = 0;
        else if (code[0] == RUMO_INPUT) of[code[1]] = of_arguments[code[2]];
        else if (code[0] == RUMO_OUTPUT) all |= code[1] >= q->system.J.first ? (int)of[code[2]] : 0;
        else of[code[1]] = (int)of[code[2]] | (takes_two(code[0]) ? (int)of[code[3]] : 0);
    }
    return all;
}

static void lay_out_integrator(arena *a, rumo_integrator *q, const rumo_system *given) {
    const rumo_sizes *s = &given->sizes;
    const rumo_factor *f = &given->factor;
    copy_rumo_system(a, &q->system, given, s);
    q->nx = s->states;
    q->nz = s->algebraic;
    q->n = q->nx + q->nz;
    q->ld = padded(q->n);
    const int ld = q->ld, few = given->rates.registers, many = given->jacobian.registers;
    q->absolute = alloc_doubles(a, q->n);
    double **const vectors[] = {&q->y, &q->start, &q->rate, &q->weights};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; ++i) *vectors[i] = alloc_doubles(a, ld);
    double **const triples[] = {&q->Z, &q->W, &q->right, &q->error, &q->polynomial, &q->local};
    for (size_t i = 0; i < sizeof triples / sizeof *triples; ++i) *triples[i] = alloc_doubles(a, STAGES * (ptrdiff_t)ld);
    q->u = alloc_doubles(a, s->inputs);
    q->p = alloc_doubles(a, s->parameters);
    q->y_lanes = alloc_doubles(a, (ptrdiff_t)q->n * LANES);
    q->u_lanes = alloc_doubles(a, (ptrdiff_t)s->inputs * LANES);
    q->p_lanes = alloc_doubles(a, (ptrdiff_t)s->parameters * LANES);
    q->registers = alloc_doubles(a, (ptrdiff_t)(few > many ? few : many) * CHUNK);
    q->terms = alloc_doubles(a, (ptrdiff_t)s->slots * LANES);
    q->J = alloc_doubles(a, given->J.count);
    q->loop = alloc_ints(a, q->n);
    q->place = alloc_ints(a, given->J.count);
    const ptrdiff_t modes = q->n < MOST_MODES ? q->n : MOST_MODES;
    q->modes = alloc_doubles(a, modes * modes);
    q->lower = alloc_doubles(a, modes * modes);
    q->balance = alloc_doubles(a, modes);
    q->looked = alloc_doubles(a, q->n);
    const int whole = f->unknowns == 0;
    q->inverse = alloc_doubles(a, whole ? 3 * (ptrdiff_t)q->n * ld : 0);
    q->pivots = alloc_ints(a, whole ? q->n : 0);
    q->blocks = patterns_of(a, &q->system.factor, f);
    q->diagonal = alloc_ints(a, f->inner);
    q->entries = alloc_doubles(a, 3 * ((ptrdiff_t)f->unknowns + 2 * (ptrdiff_t)rumo_sum(f->below, f->unknowns)));
}

RARE static size_t integrator_size(const rumo_system *system) {
    rumo_integrator q;
    arena a = {NULL, 0};
    (void)alloc(&a, sizeof q);
    lay_out_integrator(&a, &q, system);
    return a.used + ALIGNMENT;
}

/* As after it was made, but for what it has done. */
static void reset_integrator(rumo_integrator *q) {
    q->moving = q->predicts = q->has_jacobian = q->fresh = 0;
    q->factored = q->step = q->last = q->beginning = q->contraction = 0.0;
    q->before = q->quality = 1.0;
    q->unlooked = q->jumped = 0;
    forget_modes(q);
    copy(q->y + q->nx, q->system.algebraic_guess, q->nz);
}

RARE static rumo_integrator *create_integrator(const rumo_system *system, void *memory) {
    arena a = {aligned(memory), 0};
    rumo_integrator *q = (rumo_integrator *)alloc(&a, sizeof *q);
    lay_out_integrator(&a, q, system);
    const rumo_system *const s = &q->system;
    q->code = (rumo_right_side){RUMO_CORE_VERSION, evaluate, evaluate};
    /* What is estimated is the error of a formula of lower order, larger than that of the step by about a third of its digits. */
    const double tolerance = *s->tolerance;
    q->relative = 0.1 * pow(tolerance, 2.0 / 3.0);
    q->iterated = larger(10.0 * 0x1p-53 / q->relative, smaller(0.03, sqrt(q->relative)));
    for (int i = 0; i < q->n; ++i) q->absolute[i] = q->relative * s->scales[i];
    for (int i = 0; i < s->sizes.slots; ++i)
        for (int l = 0; l < LANES; ++l) q->terms[(ptrdiff_t)i * LANES + l] = s->fixed[i];
    const int *const inside = s->factor.nonzero + 3 * s->factor.outer;
    for (int e = 0; e < s->factor.inner; ++e) {
        const int entry = inside[3 * e] - s->J.first;
        q->diagonal[e] = s->J.row[entry] == s->J.column[entry] && s->J.row[entry] < q->nx;
    }
    q->depends = find_dependence(q);
    q->phase = smaller(pow(tolerance / ERROR_OF_GROWTH, 1.0 / 6.0), 1.0);
    q->longest = q->exact = 0;
    q->seen = 0;
    find_places(q);
    zero(q->J, s->J.count);
    reset_integrator(q);
    return q;
}

static void tailor_integrator(rumo_integrator *q, const rumo_right_side *code) { q->code = *code; }

RARE static rumo_fault check_system(const rumo_system *q) {
    const rumo_sizes *s = &q->sizes;
    const int n = s->states + s->algebraic;
    TRY(check_rumo_system("", q, s));
    if (s->inner > 0 || s->explicit_scheme) return (rumo_fault){RUMO_TOO_LARGE, "sizes", "inner", -1};
    if (s->slots < n) return (rumo_fault){RUMO_TOO_SMALL, "sizes", "slots", -1};
    TRY(check_tape("rates", &q->rates, s));
    TRY(check_tape("jacobian", &q->jacobian, s));
    TRY(check_pattern("J", &q->J, n, n, s->slots));
    if (q->J.first < n) return (rumo_fault){RUMO_OUT_OF_ORDER, "J", "first", -1};
    TRY(check_factor(&q->factor, s));
    const rumo_factor *f = &q->factor;
    if (f->unknowns == 0) return n > MOST_DENSE ? (rumo_fault){RUMO_TOO_SMALL, "factor", "unknowns", -1} : no_fault;
    int found = 0; /* diagonals of states */
    for (int e = 0; e < f->outer + f->inner; ++e) {
        const int entry = f->nonzero[3 * e] - q->J.first;
        if (entry < 0 || entry >= q->J.count) return (rumo_fault){RUMO_OUT_OF_RANGE, "factor", "nonzero", 3 * e};
        if (e >= f->outer) found += q->J.row[entry] == q->J.column[entry] && q->J.row[entry] < s->states;
    }
    return found == s->states ? no_fault : (rumo_fault){RUMO_OUT_OF_RANGE, "factor", "inner", -1};
}

#endif
