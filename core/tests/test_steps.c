/* Steps on recorded problems: the same plans as the NumPy reference's, whatever the memory and whoever else steps. */
#include "core.h"

#include "check.h"
#include "fixture.h"
#include "fixtures.h"

/* Largest difference of two plans, over the sizes of inputs, states, constraints and algebraic variables; NaN equals NaN. */
static double difference(const rumo_problem *p, const double *a, const double *b) {
    const rumo_sizes *s = &p->sizes;
    const int counts[4] = {s->horizon, s->horizon + 1, s->horizon, s->horizon};
    const int widths[4] = {s->inputs, s->states, s->constraints, s->algebraic};
    const double *const sizes[4] = {p->numbers.input_scales, NULL, p->numbers.constraint_scales, NULL};
    double worst = 0.0;
    for (int part = 0; part < 4; ++part) {
        for (int j = 0; j < widths[part]; ++j) {
            double size = sizes[part] ? sizes[part][j] : 0.1;
            for (int k = 0; k < counts[part]; ++k) size = fmax(size, fabs(b[k * widths[part] + j]));
            for (int k = 0; k < counts[part]; ++k) {
                const double x = a[k * widths[part] + j], y = b[k * widths[part] + j];
                if (isnan(x) != isnan(y)) return INFINITY;
                if (!isnan(x)) worst = fmax(worst, fabs(x - y) / size);
            }
        }
        a += counts[part] * widths[part];
        b += counts[part] * widths[part];
    }
    return worst;
}

/* Steps through the record. The reference's QP solver is an interior-point method with a tolerance of its own. */
static void follow_record(const fixture *f, rumo_controller *c) {
    const rumo_sizes *s = &f->problem->sizes;
    const int count = count_of(s), decided = decided_of(s);
    for (int i = 0; i < f->samples; ++i) {
        rumo_plan plan;
        copy(rumo_core.applied(c), f->applied + i * decided, decided);
        rumo_core.step(c, f->x + i * s->states, f->reference + i * window_of(s), &plan);
        const double off = difference(f->problem, plan.numbers, f->numbers + (ptrdiff_t)i * count);
        CHECK(plan.count == count, "%s: %d numbers", f->name, plan.count);
        CHECK(off < 3e-5, "%s, sample %d: %g off", f->name, i, off);
        CHECK((int)plan.status == f->status[i], "%s, sample %d: status %d, expected %d", f->name, i, (int)plan.status,
              f->status[i]);
        CHECK(plan.prepare_seconds >= 0.0 && plan.feedback_seconds >= 0.0, "%s", f->name);
    }
}

static rumo_controller *made(const fixture *f, void **memory) {
    *memory = memory_of(rumo_core.size(f->problem));
    return rumo_core.create(f->problem, &usual, *memory);
}

/* Memory of exactly the size asked, beginning anywhere; filled with what must not matter. */
static void any_memory(const fixture *f) {
    const size_t size = rumo_core.size(f->problem);
    for (size_t offset = 0; offset < ALIGNMENT; offset = 2 * offset + 1) {
        unsigned char *memory = memory_of(offset + size);
        memset(memory, 0xA5, offset + size);
        follow_record(f, rumo_core.create(f->problem, &usual, memory + offset));
        size_t touched = 0;
        for (size_t i = 0; i < offset; ++i) touched += memory[i] != 0xA5;
        CHECK(touched == 0, "%s: %zu bytes before the memory given", f->name, touched);
        free(memory);
    }
}

/* The problem handed over may go away. */
static void keeps_copies(const fixture *f) {
    rumo_problem problem = *f->problem;
    double *fixed = memory_of((size_t)problem.sizes.slots * sizeof *fixed);
    int *code = memory_of((size_t)(4 * problem.tape.length) * sizeof *code);
    copy(fixed, problem.fixed, problem.sizes.slots);
    memcpy(code, problem.tape.code, (size_t)(4 * problem.tape.length) * sizeof *code);
    problem.fixed = fixed;
    problem.tape.code = code;
    void *memory = memory_of(rumo_core.size(&problem));
    rumo_controller *c = rumo_core.create(&problem, &usual, memory);
    memset(&problem, 0xA5, sizeof problem);
    free(fixed);
    free(code);
    follow_record(f, c);
    free(memory);
}

/* Two controllers, step by step in turn, and one alone: the same numbers to the last bit. */
static void two_at_once(const fixture *f, const fixture *other) {
    void *memory[3];
    rumo_controller *alone = made(f, &memory[0]), *first = made(f, &memory[1]), *second = made(other, &memory[2]);
    const rumo_sizes *s = &f->problem->sizes, *t = &other->problem->sizes;
    for (int i = 0; i < f->samples && i < other->samples; ++i) {
        rumo_plan expected, plan, ignored;
        const double *x = f->x + i * s->states, *reference = f->reference + i * window_of(s);
        rumo_core.step(alone, x, reference, &expected);
        rumo_core.prepare(first);
        rumo_core.step(second, other->x + i * t->states, other->reference + i * window_of(t), &ignored);
        rumo_core.step(first, x, reference, &plan);
        CHECK(plan.status == expected.status, "%s beside %s, sample %d", f->name, other->name, i);
        CHECK(difference(f->problem, plan.numbers, expected.numbers) == 0.0, "%s beside %s, sample %d", f->name,
              other->name, i);
    }
    for (int i = 0; i < 3; ++i) free(memory[i]);
}

/* After a reset, everything is as at the beginning; prepare and feedback are a step. */
static void resets(const fixture *f) {
    void *memory[2];
    rumo_controller *fresh = made(f, &memory[0]), *used = made(f, &memory[1]);
    const rumo_sizes *s = &f->problem->sizes;
    rumo_plan expected, plan;
    for (int i = 0; i < f->samples; ++i) rumo_core.step(used, f->x + i * s->states, f->reference, &plan);
    long steps = 0;
    for (int i = 0; i < RUMO_STATUS_COUNT; ++i) steps += rumo_core.counts(used)[i];
    CHECK(steps == f->samples, "%s: %ld steps counted", f->name, steps);
    rumo_core.reset(used);
    for (int i = 0; i < RUMO_STATUS_COUNT; ++i) CHECK(rumo_core.counts(used)[i] == 0, "%s: counts", f->name);
    rumo_core.start(fresh, f->x);
    rumo_core.start(used, f->x);
    for (int i = 0; i < f->samples; ++i) {
        const double *x = f->x + i * s->states, *reference = f->reference + i * window_of(s);
        rumo_core.step(fresh, x, reference, &expected);
        rumo_core.prepare(used);
        rumo_core.feedback(used, x, reference, &plan);
        CHECK(plan.status == expected.status && plan.cause == expected.cause, "%s, sample %d", f->name, i);
        CHECK(difference(f->problem, plan.numbers, expected.numbers) == 0.0, "%s, sample %d", f->name, i);
    }
    free(memory[0]);
    free(memory[1]);
}

int main(void) {
    CHECK(rumo_core.version == RUMO_CORE_VERSION, "version %d", rumo_core.version);
    for (int i = 0; i < FIXTURES; ++i) {
        const fixture *f = &fixtures[i], *other = &fixtures[(i + 5) % FIXTURES];
        any_memory(f);
        keeps_copies(f);
        two_at_once(f, other);
        resets(f);
    }
    return finish();
}
