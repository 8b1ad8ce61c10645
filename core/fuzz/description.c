/* Any description: what check() lets pass can be created, stepped and changed, and what is applied is within its bounds.
 *
 * The bytes choose a problem of the tests and change some of its numbers. Each array has the length that the tables say,
 * to the byte, so that the sanitizer sees whatever is read beyond. */
#include "core.h"

#include "stream.h"

#include "fixtures.h"
#define WITHOUT_STRAIGHT_LINES
#include "patterns.h"

enum { EDITS = 8, LONGEST = 1 << 16, LARGEST = 1 << 24, BLOCKS = 512 };

typedef struct edit {
    int member, place;
    stream value;
} edit;

/* Everything that is made for one input, to be freed. */
typedef struct maker {
    edit edits[EDITS];
    int count;
    int member;  /* that comes next */
    int hopeless; /* a length cannot be: what follows is not given */
    void *made[BLOCKS];
    int blocks;
} maker;

static void *make(maker *m, size_t size) {
    void *block = malloc(size ? size : 1);
    REQUIRE(block && m->blocks < BLOCKS);
    return m->made[m->blocks++] = block;
}

static int length_of(maker *m, long long rows, long long columns) {
    if (rows < 0 || columns < 0 || rows * columns > LONGEST) m->hopeless = 1;
    return m->hopeless ? -1 : (int)(rows * columns);
}

static int edited_int(maker *m, int was) {
    for (int e = 0; e < m->count; ++e)
        if (m->edits[e].member == m->member) was = take_int(&m->edits[e].value, was);
    m->hopeless |= was < 0 || was > LONGEST;
    ++m->member;
    return was;
}

/* An array as long as it must be, of one that was as long as it had to be; changed where an edit says so. */
#define MAKE_ARRAY(type, take_one)                                                                      \
    static const type *make_##type##s(maker *m, const type *was, long long had, int length) {           \
        const int member = m->member++;                                                                 \
        if (length < 0) return NULL;                                                                    \
        type *made = make(m, (size_t)length * sizeof *made);                                            \
        for (int i = 0; i < length; ++i) made[i] = was && had > 0 ? was[i % had] : (type)0;                    \
        for (int e = 0; e < m->count && length > 0; ++e) {                                              \
            const int place = m->edits[e].place % length;                                               \
            if (m->edits[e].member == member) made[place] = take_one(&m->edits[e].value, made[place]);  \
        }                                                                                               \
        return made;                                                                                    \
    }

MAKE_ARRAY(int, take_int)
MAKE_ARRAY(double, take_double)

/* Lengths of the original are in terms of its own sizes, those of what is made in terms of the new ones. */
#define EDIT_COUNT(name, least) to->name = edited_int(m, from->name);
#define EDIT_INTS(name, rows, columns)                                                              \
    {                                                                                               \
        long long had;                                                                              \
        { LENGTHS_OF(from, old) had = (long long)(rows) * (columns); }                              \
        LENGTHS_OF(to, fresh)                                                                       \
        to->name = make_ints(m, from->name, had, m->hopeless ? -1 : length_of(m, rows, columns));   \
    }
#define EDIT_DOUBLES(name, rows, columns, rule)                                                     \
    {                                                                                               \
        long long had;                                                                              \
        { LENGTHS_OF(from, old) had = (long long)(rows) * (columns); }                              \
        LENGTHS_OF(to, fresh)                                                                       \
        to->name = make_doubles(m, from->name, had, m->hopeless ? -1 : length_of(m, rows, columns)); \
    }
#define LENGTHS_OF(of, sizes_of)               \
    const rumo_sizes *const s = sizes_of;      \
    const __typeof__(*of) *const t = of;       \
    (void)s;                                   \
    (void)t;
#define EDIT_STRUCT(type, name) edit_##type(m, &to->name, &from->name, fresh, old);
#define EDIT(type, table)                                                                                              \
    static inline void edit_##type(maker *m, type *to, const type *from, const rumo_sizes *fresh, const rumo_sizes *old) { \
        table(EDIT_COUNT, EDIT_INTS, EDIT_DOUBLES, EDIT_STRUCT)                                                        \
    }

static inline void edit_rumo_sizes(maker *m, rumo_sizes *to, const rumo_sizes *from, const rumo_sizes *fresh,
                                   const rumo_sizes *old) {
    (void)fresh;
    (void)old;
    RUMO_SIZES_TABLE(EDIT_COUNT)
    const int all[] = {to->horizon, to->states, to->algebraic, to->inputs, to->outputs, to->constraints, to->parameters,
                       to->delay, to->inner, to->substeps, to->explicit_scheme, to->blocks, to->slots};
    for (size_t i = 0; i < sizeof all / sizeof *all; ++i) m->hopeless |= all[i] < 0 || all[i] > 1024;
}

RUMO_TABLES(EDIT)

static const rumo_problem *choose(stream *s) {
    const int index = take_below(s, FIXTURES + PATTERNS + WIDE_PATTERNS);
    if (index < FIXTURES) return fixtures[index].problem;
    if (index < FIXTURES + PATTERNS) return patterns[index - FIXTURES].problem;
    return wide_patterns[index - FIXTURES - PATTERNS];
}

static double *some_doubles(maker *m, stream *s, int count) {
    double *made = make(m, (size_t)count * sizeof *made);
    for (int i = 0; i < count; ++i) made[i] = 0.1;
    for (int changes = take_below(s, 4); changes > 0 && count > 0; --changes) made[take_below(s, count)] = take_double(s, 0.1);
    return made;
}

static void check_plan(const rumo_problem *p, const rumo_plan *plan) {
    const rumo_sizes *s = &p->sizes;
    REQUIRE(plan->status >= RUMO_OPTIMAL && plan->status < RUMO_STATUS_COUNT);
    for (int k = s->delay; k < s->horizon; ++k)
        for (int j = 0; j < s->inputs; ++j) {
            const int i = k * s->inputs + j;
            const double u = plan->numbers[i];
            REQUIRE(isfinite(u) && u >= p->numbers.bounds.input_lower[i] && u <= p->numbers.bounds.input_upper[i]);
        }
    for (int i = 0; i < plan->conflicts; ++i)
        REQUIRE(plan->conflict[i].stage >= 1 && plan->conflict[i].stage <= s->horizon && plan->conflict[i].index >= 0);
}

/* Steps with some measurements, from a guess of the core's or the caller's; then with other numbers. */
static void drive(maker *m, stream *s, const rumo_problem *p, const rumo_settings *settings) {
    const rumo_sizes *sizes = &p->sizes;
    const size_t size = rumo_core.size(p);
    if (size > LARGEST) return;
    rumo_controller *c = rumo_core.create(p, settings, make(m, size));
    const int states = sizes->states, window = (sizes->horizon + 1) * sizes->outputs;
    rumo_plan plan;
    for (int step = 1 + take_below(s, 3); step > 0; --step) {
        const double *x = some_doubles(m, s, states), *reference = some_doubles(m, s, window);
        switch (take_below(s, 4)) {
        case 0: rumo_core.start(c, x); break;
        case 1: rumo_core.engage(c, some_doubles(m, s, (sizes->horizon + 1) * states),
                                 some_doubles(m, s, sizes->horizon * sizes->inputs)); break;
        case 2: rumo_core.prepare(c); break;
        default: break;
        }
        rumo_core.step(c, x, reference, &plan);
        check_plan(p, &plan);
    }
    rumo_numbers other;
    rumo_problem changed = *p;
    m->member = 0;
    m->count = take_below(s, 3);
    for (int e = 0; e < m->count; ++e) {
        m->edits[e] = (edit){take_below(s, 32), take_below(s, 65536), *s};
        take(s, &(uint64_t){0}, sizeof(uint64_t));
    }
    edit_rumo_numbers(m, &other, &p->numbers, sizes, sizes);
    if (rumo_core.update(c, &other).error == RUMO_FINE) changed.numbers = other;
    rumo_core.step(c, some_doubles(m, s, states), some_doubles(m, s, window), &plan);
    check_plan(&changed, &plan);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    stream s = {data, size};
    const rumo_problem *was = choose(&s);
    static maker m;
    memset(&m, 0, sizeof m);
    m.count = take_below(&s, EDITS + 1);
    for (int e = 0; e < m.count; ++e) {
        m.edits[e] = (edit){take_below(&s, 128), take_below(&s, 65536), s};
        take(&s, &(uint64_t){0}, sizeof(uint64_t));
    }
    rumo_problem p;
    edit_rumo_problem(&m, &p, was, &p.sizes, &was->sizes);
    rumo_settings settings = usual;
    settings.sqp_iterations = take_below(&s, 3);
    settings.preparation_iterations = take_below(&s, 2);
    settings.qp_iterations = take_below(&s, 2) ? 100 : take_int(&s, 3);
    settings.gate_width = take_double(&s, 3.0);
    settings.gate_patience = take_int(&s, 8);
    settings.trusted_step = take_below(&s, 2) ? (double)INFINITY : take_double(&s, 0.1);
    settings.settling_iterations = take_below(&s, 4);
    const rumo_fault fault = rumo_core.check(&p);
    REQUIRE(!m.hopeless || fault.error);
    REQUIRE(strlen(rumo_core.error_text(fault.error)) + strlen(fault.part) + strlen(fault.member) > 0);
    const int fine = !rumo_core.check_settings(&settings).error && settings.qp_iterations <= 1000;
    if (!fault.error && fine) drive(&m, &s, &p, &settings);
    for (int i = 0; i < m.blocks; ++i) free(m.made[i]);
    return 0;
}
