/* Integrators: the same bits from the same start, algebraic equations that hold, and no numbers that lead anywhere else than to
 * numbers or to an ending that says so. */
#include "core.h"

#include <float.h>

#include "check.h"
#include "integrator.h"

enum { SAMPLES = 30 };
#define SAMPLE 0.05
/* How far inputs jump. */
#define PUSH 0.05

static void drive(integrator_of *q, double *path) {
    random_state = 7;
    for (int k = 0; k < SAMPLES; ++k) {
        if (k % 3 != 2) jump(q, PUSH);
        const rumo_ending ending = go_on(q, k % 5 == 4 ? 0.3 * SAMPLE : SAMPLE);
        CHECK(ending == RUMO_ARRIVED, "%s: sample %d: %d", q->of->name, k, (int)ending);
        for (int i = 0; i < q->of->system->sizes.states; ++i) {
            CHECK(isfinite(q->x[i]), "%s: sample %d: x[%d] = %g", q->of->name, k, i, q->x[i]);
            path[k * MOST_VARIABLES + i] = q->x[i];
        }
    }
}

static void same_bits_from_the_same_start(integrator_of *q) {
    static double first[SAMPLES * MOST_VARIABLES], again[SAMPLES * MOST_VARIABLES];
    drive(q, first);
    jump(q, 100.0 * PUSH);
    (void)go_on(q, 0.7);
    begin_anew(q);
    drive(q, again);
    CHECK(memcmp(first, again, sizeof first) == 0, "%s: another path after a reset", q->of->name);
    for (int i = 0; i < q->of->system->sizes.algebraic; ++i)
        CHECK(isfinite(rumo_core.integrator_algebraic(q->integrator)[i]), "%s: z[%d]", q->of->name, i);
    const rumo_work *work = rumo_core.integrator_work(q->integrator);
    CHECK(work->steps >= 2 * SAMPLES && work->rates > work->steps && work->factors > 0, "%s: idle", q->of->name);
}

static void wild_numbers(integrator_of *q) {
    static const double wild[] = {0.0, -0.0, 5e-324, 1e-300, 1e16, -1e16, 1e300, -1e300, DBL_MAX, -DBL_MAX, INFINITY, -INFINITY, NAN};
    enum { WILD = sizeof wild / sizeof *wild };
    const rumo_sizes *s = &q->of->system->sizes;
    const double untouched = 0.123456789;
    for (int w = 0; w < 2 * WILD; ++w) {
        begin_anew(q);
        double *const place = w < WILD ? q->x + w % s->states : q->u + w % s->inputs;
        *place = wild[w % WILD];
        for (int i = 0; i < s->states; ++i) q->end[i] = untouched;
        const rumo_ending ending = go_on(q, SAMPLE);
        CHECK(ending >= RUMO_ARRIVED && ending < RUMO_ENDING_COUNT, "%s: ending %d", q->of->name, (int)ending);
        CHECK(isfinite(wild[w % WILD]) || ending == RUMO_NO_VALUE, "%s: %g: %d", q->of->name, wild[w % WILD], (int)ending);
        for (int i = 0; i < s->states; ++i)
            CHECK(ending == RUMO_ARRIVED ? isfinite(q->end[i]) : q->end[i] == untouched, "%s: %g", q->of->name, q->end[i]);
        begin_anew(q);
        CHECK(go_on(q, SAMPLE) == RUMO_ARRIVED, "%s: no way back", q->of->name);
    }
    for (int w = 0; w < WILD; ++w) {
        begin_anew(q);
        const rumo_ending ending = go_on(q, wild[w]);
        CHECK((wild[w] > 0.0 && wild[w] < INFINITY) || ending == RUMO_NO_VALUE, "%s: %g s: %d", q->of->name, wild[w], (int)ending);
    }
}

static void tables_are_checked(const rumo_system *given) {
    rumo_system s = *given;
    CHECK(rumo_core.system_check(&s).error == RUMO_FINE, "a system");
    s.sizes.slots = s.sizes.states - 1;
    CHECK(rumo_core.system_check(&s).error != RUMO_FINE, "slots");
    s = *given;
    s.sizes.inner = 1;
    CHECK(rumo_core.system_check(&s).error != RUMO_FINE, "inner unknowns");
    s = *given;
    s.J.first = 0;
    CHECK(rumo_core.system_check(&s).error != RUMO_FINE, "J over the rates");
    s = *given;
    s.J.count += 1;
    CHECK(rumo_core.system_check(&s).error != RUMO_FINE, "J beyond the slots");
    s = *given;
    s.rates.registers = 0;
    CHECK(s.rates.length == 0 || rumo_core.system_check(&s).error != RUMO_FINE, "registers");
    s = *given;
    s.factor.unknowns = s.factor.unknowns ? s.factor.unknowns - 1 : 1;
    CHECK(rumo_core.system_check(&s).error != RUMO_FINE, "unknowns");
    const double zero_tolerance = 0.0;
    s = *given;
    s.tolerance = &zero_tolerance;
    CHECK(rumo_core.system_check(&s).error == RUMO_NOT_POSITIVE, "tolerance");
    if (given->factor.inner == 0) return;
    int *const nonzero = memory_of((size_t)(given->factor.outer + given->factor.inner) * 3 * sizeof(int));
    memcpy(nonzero, given->factor.nonzero, (size_t)(given->factor.outer + given->factor.inner) * 3 * sizeof(int));
    s = *given;
    s.factor.nonzero = nonzero;
    nonzero[3 * given->factor.outer] = 0; /* a rate in place of a nonzero of J */
    CHECK(rumo_core.system_check(&s).error == RUMO_OUT_OF_RANGE, "a nonzero that is none");
    free(nonzero);
}

int main(void) {
    int sparse = 0;
    for (int i = 0; i < SYSTEMS; ++i) {
        integrator_of q = integrator_for(&systems[i]);
        sparse += systems[i].system->factor.unknowns > 0;
        same_bits_from_the_same_start(&q);
        wild_numbers(&q);
        free(q.memory);
        tables_are_checked(systems[i].system);
    }
    CHECK(sparse > 0 && sparse < SYSTEMS, "%d of %d sparse", sparse, SYSTEMS);
    return finish();
}
