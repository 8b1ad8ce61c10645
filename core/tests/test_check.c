/* check() finds one wrong thing at a time, and says where. */
#include <limits.h>

#include "core.h"

#include "check.h"
#include "fixture.h"
#include "fixtures.h"

#include <string.h>

static const fixture *named(const char *name) {
    for (int i = 0; i < FIXTURES; ++i)
        if (strcmp(fixtures[i].name, name) == 0) return &fixtures[i];
    return NULL;
}

static void expect(const rumo_problem *p, rumo_error error, const char *part, const char *member, int index) {
    const rumo_fault found = rumo_core.check(p);
    CHECK(found.error == error && strcmp(found.part, part) == 0 && strcmp(found.member, member) == 0 && found.index == index,
          "expected %s %s[%d] %s, found %s %s[%d] %s", part, member, index, rumo_core.error_text(error), found.part,
          found.member, found.index, rumo_core.error_text(found.error));
}

/* One number of an array changed. */
#define WITH_DOUBLE(array, count, i, value, error, part, member)           \
    do {                                                                   \
        rumo_problem p = *good;                                            \
        double *changed = memory_of((size_t)(count) * sizeof *changed);    \
        memcpy(changed, p.array, (size_t)(count) * sizeof *changed);       \
        changed[i] = value;                                                \
        p.array = changed;                                                 \
        expect(&p, error, part, member, i);                                \
        free(changed);                                                     \
    } while (0)

#define WITH_INT(array, count, i, value, error, part, member, index)       \
    do {                                                                   \
        rumo_problem p = *good;                                            \
        int *changed = memory_of((size_t)(count) * sizeof *changed);       \
        memcpy(changed, p.array, (size_t)(count) * sizeof *changed);       \
        changed[i] = value;                                                \
        p.array = changed;                                                 \
        expect(&p, error, part, member, index);                            \
        free(changed);                                                     \
    } while (0)

#define WITH_SIZE(member_path, value, error, part, member)                 \
    do {                                                                   \
        rumo_problem p = *good;                                            \
        p.member_path = value;                                             \
        expect(&p, error, part, member, -1);                               \
    } while (0)

static void sizes(const rumo_problem *good) {
    WITH_SIZE(sizes.horizon, 0, RUMO_TOO_SMALL, "sizes", "horizon");
    WITH_SIZE(sizes.states, -1, RUMO_TOO_SMALL, "sizes", "states");
    WITH_SIZE(sizes.delay, good->sizes.horizon, RUMO_TOO_LARGE, "sizes", "delay");
    WITH_SIZE(sizes.blocks, good->sizes.horizon + 1, RUMO_TOO_LARGE, "sizes", "blocks");
    WITH_SIZE(tape.length, -1, RUMO_TOO_SMALL, "tape", "length");
    WITH_SIZE(tape.length, 1 << 30, RUMO_TOO_LARGE, "tape", "length");
    WITH_SIZE(sizes.slots, INT_MAX, RUMO_TOO_LARGE, "sizes", "slots");
    WITH_SIZE(sizes.horizon, RUMO_LONGEST, RUMO_TOO_LARGE, "sizes", "horizon");
    WITH_SIZE(sizes.substeps, RUMO_LONGEST, RUMO_TOO_LARGE, "sizes", "substeps");
    WITH_SIZE(numbers.l1, NULL, RUMO_MISSING, "numbers", "l1");
    WITH_SIZE(tape.code, NULL, RUMO_MISSING, "tape", "code");
    WITH_SIZE(M.first, good->sizes.slots, RUMO_OUT_OF_RANGE, "M", "first");
    WITH_SIZE(y_first, good->sizes.slots, RUMO_OUT_OF_RANGE, "", "y_first");
    WITH_SIZE(Cx.first, 0, RUMO_OUT_OF_ORDER, "Cx", "first");
}

static void numbers(const rumo_problem *good) {
    const rumo_sizes *s = &good->sizes;
    const int bounded = s->horizon * s->inputs, limits = s->horizon * s->constraints;
    WITH_DOUBLE(numbers.output_weights, s->horizon * s->outputs, 3, -1.0, RUMO_NEGATIVE, "numbers", "output_weights");
    WITH_DOUBLE(numbers.output_weights, s->horizon * s->outputs, 0, NAN, RUMO_NOT_FINITE, "numbers", "output_weights");
    WITH_DOUBLE(numbers.move_weights, s->blocks * s->inputs, 1, 0.0, RUMO_NOT_POSITIVE, "numbers", "move_weights");
    WITH_DOUBLE(numbers.input_scales, s->inputs, 0, INFINITY, RUMO_NOT_FINITE, "numbers", "input_scales");
    WITH_DOUBLE(numbers.bounds.input_lower, bounded, 5, NAN, RUMO_NO_LIMIT, "bounds", "input_lower");
    WITH_DOUBLE(numbers.bounds.input_upper, bounded, 2, -INFINITY, RUMO_NO_LIMIT, "bounds", "input_upper");
    WITH_DOUBLE(numbers.input_scales, s->inputs, 0, 5e-324, RUMO_TOO_SMALL, "numbers", "input_scales");
    WITH_DOUBLE(numbers.bounds.input_lower, bounded, 4, -1.7e308, RUMO_TOO_LARGE, "", "input_lower");
    WITH_DOUBLE(numbers.bounds.input_lower, bounded, 4, 1e6, RUMO_CROSSED, "", "input_lower");
    WITH_DOUBLE(numbers.bounds.move_lower, s->inputs, 1, 0.1, RUMO_NO_REST, "", "move_lower");
    WITH_DOUBLE(numbers.bounds.safe_input, s->inputs, 0, INFINITY, RUMO_NOT_FINITE, "bounds", "safe_input");
    WITH_DOUBLE(numbers.block_upper, s->blocks * s->inputs, 3, -0.1, RUMO_NO_REST, "", "block_lower");
    WITH_DOUBLE(numbers.constraint_limits, limits, 1, NAN, RUMO_NO_LIMIT, "numbers", "constraint_limits");
    WITH_DOUBLE(numbers.constraint_scales, s->constraints, 0, 0.0, RUMO_NOT_POSITIVE, "numbers", "constraint_scales");
    WITH_DOUBLE(numbers.l1, s->constraints, 1, -1.0, RUMO_NEGATIVE, "numbers", "l1");
    WITH_DOUBLE(numbers.l2, s->constraints, 0, INFINITY, RUMO_NOT_FINITE, "numbers", "l2");
    WITH_DOUBLE(numbers.parameter_values, s->horizon * s->parameters, 0, NAN, RUMO_NOT_FINITE, "numbers", "parameter_values");
    WITH_DOUBLE(shift.shares, s->horizon + 1, 2, NAN, RUMO_NOT_FINITE, "shift", "shares");
}

static void indices(const rumo_problem *good) {
    const rumo_sizes *s = &good->sizes;
    const rumo_elimination *e = &good->elimination;
    const int nw = RUMO_UNKNOWNS, words = 4 * good->tape.length;
    WITH_INT(tape.code, words, 0, RUMO_OPERATION_COUNT, RUMO_OUT_OF_RANGE, "tape", "code", 0);
    WITH_INT(tape.code, words, words - 2, 1 << 20, RUMO_OUT_OF_RANGE, "tape", "code", good->tape.length - 1);
    WITH_INT(tape.code, words, 1, -1, RUMO_OUT_OF_RANGE, "tape", "code", 0);
    WITH_INT(M.row, good->M.count, 0, nw, RUMO_OUT_OF_RANGE, "M", "row", 0);
    WITH_INT(M.row, good->M.count, 0, nw - 1, RUMO_OUT_OF_ORDER, "M", "row", 1);
    WITH_INT(B.column, good->B.count, 0, s->inputs, RUMO_OUT_OF_RANGE, "B", "column", 0);
    for (int i = 1; i < good->M.count; ++i)
        if (good->M.row[i] == good->M.row[i - 1])
            WITH_INT(M.column, good->M.count, i, good->M.column[i - 1], RUMO_OUT_OF_ORDER, "M", "column", i);
    WITH_INT(elimination.size, e->blocks, 0, e->size[0] + 1, RUMO_OUT_OF_RANGE, "elimination", "size", e->blocks);
    WITH_INT(elimination.below, nw, nw - 1, -1, RUMO_TOO_LARGE, "elimination", "lower", -1);
    WITH_INT(elimination.below, nw, nw - 1, INT_MAX, RUMO_TOO_LARGE, "elimination", "lower", -1);
    WITH_INT(elimination.below, nw, nw - 1, 1 << 20, RUMO_OUT_OF_RANGE, "elimination", "below", nw - 1);
    WITH_INT(elimination.upper, rumo_sum(e->across, nw), 0, 0, RUMO_OUT_OF_RANGE, "elimination", "upper", 0);
    WITH_INT(elimination.load, 2 * rumo_sum(e->loads, e->blocks), 0, s->slots, RUMO_OUT_OF_RANGE, "elimination", "load", 0);
    WITH_INT(elimination.store, 2 * rumo_sum(e->stores, e->blocks), 1, e->entries, RUMO_OUT_OF_RANGE, "elimination", "store", 1);
    WITH_INT(elimination.column, e->entries, 0, -1, RUMO_OUT_OF_RANGE, "elimination", "column", 0);
    WITH_INT(shift.stages, s->horizon + 1, 1, s->horizon, RUMO_OUT_OF_RANGE, "shift", "stages", 1);
    WITH_INT(shift.intervals, s->horizon, 0, -1, RUMO_OUT_OF_RANGE, "shift", "intervals", 0);
    WITH_INT(blocking.block, s->horizon, s->delay, 1, RUMO_OUT_OF_ORDER, "blocking", "block", s->delay);
}

/* Limits of intervals that share an input must leave it a value. */
static void blocks(const rumo_problem *good) {
    const rumo_sizes *s = &good->sizes;
    const int i = (s->horizon - 1) * s->inputs;
    rumo_problem p = *good;
    double *lower = memory_of((size_t)(s->horizon * s->inputs) * sizeof *lower);
    double *upper = memory_of((size_t)(s->horizon * s->inputs) * sizeof *upper);
    copy(lower, p.numbers.bounds.input_lower, s->horizon * s->inputs);
    copy(upper, p.numbers.bounds.input_upper, s->horizon * s->inputs);
    lower[i] = upper[i];
    upper[i - s->inputs] = 0.5 * upper[i];
    p.numbers.bounds.input_lower = lower;
    p.numbers.bounds.input_upper = upper;
    expect(&p, RUMO_CROSSED, "", "input_lower", i);
    free(lower);
    free(upper);
}

static int inner_unknowns(const rumo_problem *p) {
    const rumo_sizes *s = &p->sizes;
    return RUMO_INNER;
}

static void composed(const rumo_problem *good) {
    const rumo_composition *c = &good->composition;
    WITH_INT(composition.start, c->entries, 0, good->elimination.entries, RUMO_OUT_OF_RANGE, "composition", "start", 0);
    WITH_INT(composition.product, 2 * rumo_sum(c->products, c->entries), 1, c->entries, RUMO_OUT_OF_RANGE, "composition",
             "product", 1);
    WITH_INT(inner_signals, inner_unknowns(good), 0, -1, RUMO_OUT_OF_RANGE, "", "inner_signals", 0);
}

static void settings(void) {
    rumo_settings wrong = usual;
    CHECK(rumo_core.check_settings(&wrong).error == RUMO_FINE, "the usual settings");
    wrong.sqp_iterations = 0;
    CHECK(rumo_core.check_settings(&wrong).error == RUMO_TOO_SMALL, "no iterations");
    wrong = usual;
    wrong.qp_tolerance = NAN;
    CHECK(strcmp(rumo_core.check_settings(&wrong).member, "qp_tolerance") == 0, "a tolerance that is no number");
}

int main(void) {
    for (int i = 0; i < FIXTURES; ++i) expect(fixtures[i].problem, RUMO_FINE, "", "", 0);
    const rumo_problem *good = named("car_soft_1")->problem;
    sizes(good);
    numbers(named("car_moves")->problem);
    indices(good);
    blocks(named("car_held")->problem);
    blocks(named("car_blocks")->problem);
    composed(named("car_substeps")->problem);
    settings();
    for (int e = 0; e < RUMO_ERROR_COUNT; ++e) CHECK(rumo_core.error_text((rumo_error)e)[0], "error %d has no text", e);
    return finish();
}
