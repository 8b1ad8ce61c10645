/* No step allocates: the C library's allocator is replaced by one that counts, and every status is brought about. */
#include "core.h"

#include "check.h"
#include "filter.h"
#include "fixture.h"
#include "fixtures.h"
#include "integrator.h"

static long armed, calls;

/* All memory the test ever takes, dealt out once and never taken back. */
static void *deal(size_t bytes) {
    static _Alignas(64) unsigned char heap[64 << 20];
    static size_t used;
    calls += armed;
    bytes = (bytes + 63) / 64 * 64;
    if (bytes > sizeof heap - used) return NULL;
    used += bytes;
    return heap + used - bytes;
}

void *malloc(size_t bytes) { return deal(bytes); }
void *calloc(size_t count, size_t bytes) { return deal(count * bytes); }
void *aligned_alloc(size_t alignment, size_t bytes) { return alignment > 64 ? NULL : deal(bytes); }
void *realloc(void *old, size_t bytes) {
    void *fresh = deal(bytes);
    if (old && fresh) memcpy(fresh, old, bytes); /* may read on into the next piece, which is ours too */
    return fresh;
}
void free(void *memory) {
    (void)memory;
    calls += armed;
}

static long seen[RUMO_STATUS_COUNT];

static void watched_step(rumo_controller *c, const double *x, const double *reference, int phases) {
    rumo_plan plan;
    armed = 1;
    if (phases) {
        rumo_core.prepare(c);
        rumo_core.feedback(c, x, reference, &plan);
    } else {
        rumo_core.step(c, x, reference, &plan);
    }
    armed = 0;
    ++seen[plan.status];
    ++seen[plan.cause];
}

/* Good samples, then each kind of trouble. */
static void drive(const fixture *f, const rumo_settings *settings) {
    const rumo_sizes *s = &f->problem->sizes;
    double *x = memory_of((size_t)s->states * sizeof *x);
    double *reference = memory_of((size_t)window_of(s) * sizeof *reference);
    rumo_controller *c = rumo_core.create(f->problem, settings, memory_of(rumo_core.size(f->problem)));
    for (int i = 0; i < 4 * f->samples; ++i) {
        const int sample = i % f->samples, trouble = i / f->samples;
        copy(x, f->x + sample * s->states, s->states);
        copy(reference, f->reference + sample * window_of(s), window_of(s));
        const int j = i % s->states;
        if (trouble == 1) x[j] += i % 3 ? 0.5 : i % 2 ? 1e4 : 1e200;
        if (trouble == 2 && i % 5) x[j] = i % 2 ? NAN : -INFINITY;
        if (trouble == 3 && i % 2) reference[j % window_of(s)] = NAN;
        watched_step(c, x, reference, i % 2);
        armed = 1;
        if (i % 50 == 49) rumo_core.reset(c);
        if (i % 40 == 39) rumo_core.start(c, x);
        rumo_core.configure(c, settings);
        rumo_core.update(c, &f->problem->numbers);
        armed = 0;
    }
}

/* The same for a filter, where a problem is one of those: measurements, then nothing, outliers and trouble. */
static void estimate(const fixture *f) {
    const rumo_sizes *s = &f->problem->sizes;
    const filter_of filter = filter_for(f, 3.0);
    for (int i = 0; i < 200; ++i) {
        armed = 1;
        filter_step(&filter, i);
        rumo_core.filter_covariance(filter.filter, filter.belief, filter.P);
        armed = 0;
        CHECK(all_finite(filter.belief, belief_size(s)), "%s: sample %d", f->name, i);
    }
    let_go();
}

/* And for an integrator. */
static void integrate_over_samples(const system_of *of) {
    integrator_of q = integrator_for(of);
    for (int i = 0; i < 50; ++i) {
        jump(&q, i % 10 == 9 ? 1e6 : 0.05);
        armed = 1;
        if (go_on(&q, 0.05) != RUMO_ARRIVED || i % 10 == 9) begin_anew(&q);
        armed = 0;
    }
    CHECK(calls == 0, "%s: %ld allocations", of->name, calls);
}

int main(void) {
    printf("no steps without memory\n"); /* the stream's buffer, before anything counts */
    rumo_settings several = usual, hurried = usual, timed = usual, open = usual, judged = usual, careful = usual;
    several.sqp_iterations = 4;
    several.preparation_iterations = 2;
    hurried.qp_iterations = 1;
    timed.seconds = 0.0;
    open.gate_width = INFINITY;
    judged.trusted_step = 0.0;
    careful.trusted_step = 0.01;
    careful.settling_iterations = 20;
    const rumo_settings *const all[] = {&usual, &several, &hurried, &timed, &open, &judged, &careful};
    void *volatile piece; /* the compiler may not leave it out */
    armed = 1;
    piece = malloc(1);
    free(piece);
    armed = 0;
    CHECK(calls == 2, "the replaced allocator is not in use");
    calls = 0;
    for (int i = 0; i < FIXTURES; ++i)
        for (size_t j = 0; j < sizeof all / sizeof *all; ++j) {
            drive(&fixtures[i], all[j]);
            CHECK(calls == 0, "%s: %ld allocations", fixtures[i].name, calls);
        }
    for (int i = 0; i < FIXTURES; ++i) {
        if (fixtures[i].problem->sizes.horizon > 1) continue;
        estimate(&fixtures[i]);
        CHECK(calls == 0, "%s: %ld allocations by its filter", fixtures[i].name, calls);
    }
    for (int i = 0; i < SYSTEMS; ++i) integrate_over_samples(&systems[i]);
    for (int i = 0; i < RUMO_STATUS_COUNT; ++i) CHECK(seen[i] > 0, "status %d never came", i);
    return finish();
}
