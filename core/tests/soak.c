/* Random steps on all fixtures: whatever is measured, wanted or applied, the plan can be applied and is what it says.
 *
 *   soak [steps over all fixtures] [seed]
 */
#include "core.h"

#include "check.h"
#include "fixture.h"
#include "fixtures.h"
#include "random.h"

static const double wild[] = {NAN, INFINITY, -INFINITY, 1e308, -1e308, 1e300, -1e300, 1e20, -1e6, 1e-300, 0.0};
enum { WILD = sizeof wild / sizeof *wild };

typedef struct run {
    const fixture *f;
    rumo_controller *c;
    rumo_settings settings;
    double *x, *reference, *told; /* what the controller is told, told: (max(delay, 1), nu) */
    rumo_plan plan;
    long long counts[RUMO_STATUS_COUNT]; /* since the last reset */
    long all[RUMO_STATUS_COUNT];
    int unsolved; /* steps in a row */
} run;

static int chance(double probability) { return uniform(0.0, 1.0) < probability; }

static rumo_settings some_settings(void) {
    rumo_settings s = usual;
    if (chance(0.2)) s.sqp_iterations = 1 + below(4);
    if (chance(0.7)) {
        s.trusted_step = uniform(0.0, 0.2);
        s.settling_iterations = below(12);
    }
    if (chance(0.2)) s.preparation_iterations = 1 + below(3);
    if (chance(0.2)) s.qp_iterations = below(8);
    if (chance(0.1)) s.seconds = below(2) ? 0.0 : of_any_size(1e-8, 1e-3); /* over at any place */
    if (chance(0.3)) s.gate_width = below(2) ? INFINITY : uniform(0.01, 1.0);
    if (chance(0.3)) s.gate_patience = below(6);
    return s;
}

/* Mostly where the plan leads, with noise; else a record, a jump, or nonsense. */
static void choose_measurement(run *r) {
    const rumo_sizes *s = &r->f->problem->sizes;
    const int sample = below(r->f->samples);
    const double *x = r->f->x + sample * s->states;
    if (r->plan.numbers && chance(0.8)) x = r->plan.numbers + s->horizon * s->inputs + s->states;
    if (!all_finite(x, s->states) && chance(0.9)) x = r->f->x + sample * s->states;
    copy(r->x, x, s->states);
    for (int j = 0; j < s->states; ++j) r->x[j] *= 1.0 + 1e-3 * uniform(-1.0, 1.0);
    const int j = below(s->states);
    if (chance(0.05)) r->x[j] += of_any_size(1e-3, 1e3);
    if (chance(0.05)) r->x[j] = wild[below(WILD)];
    if (chance(0.02))
        for (int i = 0; i < s->states; ++i) r->x[i] = of_any_size(1e-9, 1e9);
}

static void choose_reference(run *r) {
    const int window = window_of(&r->f->problem->sizes);
    copy(r->reference, r->f->reference + below(r->f->samples) * window, window);
    if (chance(0.1))
        for (int i = 0; i < window; ++i) r->reference[i] += of_any_size(1e-3, 10.0);
    if (chance(0.05)) r->reference[below(window)] = wild[below(WILD)];
}

/* What is applied may be something else than the command, even something that the bounds forbid. */
static void choose_applied(run *r) {
    const rumo_problem *p = r->f->problem;
    const int nu = p->sizes.inputs, decided = decided_of(&p->sizes);
    double *applied = rumo_core.applied(r->c);
    if (chance(0.03))
        for (int i = 0; i < decided; ++i) {
            const int j = i % nu;
            const double reach = 2.0 * p->numbers.input_scales[j];
            applied[i] = clip(uniform(-reach, reach), p->numbers.bounds.input_lower[j], p->numbers.bounds.input_upper[j]);
        }
    if (chance(0.005)) applied[below(decided)] = chance(0.5) ? 1e3 * uniform(-1.0, 1.0) : wild[below(WILD)];
    copy(r->told, applied, decided);
}

static int is_within(double x, double lower, double upper, double tolerance) {
    return x >= lower - tolerance && x <= upper + tolerance;
}

static void check_inputs(const run *r) {
    const rumo_problem *p = r->f->problem;
    const rumo_bounds *bounds = &p->numbers.bounds;
    const int nu = p->sizes.inputs, d = p->sizes.delay, decided = decided_of(&p->sizes);
    const double *u = r->plan.numbers, *last = r->told + decided - nu;
    CHECK(memcmp(u, r->told, (size_t)(d * nu) * sizeof *u) == 0, "%s: inputs already decided", r->f->name);
    for (int k = d; k < p->sizes.horizon; ++k)
        for (int j = 0; j < nu; ++j) {
            const double *lower = bounds->input_lower + j, *upper = bounds->input_upper + j;
            const double now = u[k * nu + j], before = k > d ? u[(k - 1) * nu + j] : last[j];
            CHECK(isfinite(now) && is_within(now, lower[k * nu], upper[k * nu], 0.0),
                  "%s: input %d is %g at %d", r->f->name, j, now, k);
            /* From outside of the bounds, the way back may be longer than a move. */
            if (is_within(before, lower[k * nu], upper[k * nu], 0.0))
                CHECK(is_within(now - before, bounds->move_lower[j], bounds->move_upper[j], 1e-12 * p->numbers.input_scales[j]),
                      "%s: move of input %d is %g at %d", r->f->name, j, now - before, k);
        }
    const double *applied = rumo_core.applied(r->c);
    CHECK(memcmp(applied, r->told + nu, (size_t)(decided - nu) * sizeof *u) == 0, "%s: applied", r->f->name);
    CHECK(memcmp(applied + decided - nu, u + d * nu, (size_t)nu * sizeof *u) == 0, "%s: applied", r->f->name);
}

static void check_values(const run *r, int solved) {
    const rumo_problem *p = r->f->problem;
    const int nx = p->sizes.states, nc = p->sizes.constraints, N = p->sizes.horizon;
    const double *x = r->plan.numbers + N * p->sizes.inputs, *constraints = x + (N + 1) * nx;
    const rumo_status status = r->plan.status;
    int nan_states = 0, violated = 0;
    for (int i = 0; i < (N + 1) * nx; ++i) nan_states += isnan(x[i]) != 0;
    if (status == RUMO_PLAN_EXHAUSTED) CHECK(nan_states == (N + 1) * nx, "%s: states without a plan", r->f->name);
    else CHECK(all_finite(x, (N + 1) * nx), "%s: states of status %d", r->f->name, (int)status);
    const double *z = constraints + N * nc, *diagnostics = z + N * p->sizes.algebraic;
    int nan_algebraic = 0;
    for (int i = 0; i < N * p->sizes.algebraic; ++i) nan_algebraic += isnan(z[i]) != 0;
    CHECK(nan_algebraic == (status == RUMO_PLAN_EXHAUSTED ? N * p->sizes.algebraic : 0),
          "%s: algebraic variables of status %d", r->f->name, (int)status);
    for (int i = 0; i < RUMO_DIAGNOSTIC_COUNT; ++i) {
        const int always = i != RUMO_CONTRACTION && i != RUMO_COMMAND_ERROR && i != RUMO_KKT_RESIDUAL;
        const int known = solved && (always || (i == RUMO_KKT_RESIDUAL && status <= RUMO_SOFT_VIOLATED));
        CHECK(known ? diagnostics[i] >= 0.0 : solved || isnan(diagnostics[i]), "%s: diagnostic %d is %g", r->f->name, i,
              diagnostics[i]);
    }
    /* What was measured, but for readings that are said to be held back or are old, and for full turns. */
    for (int i = 0; solved && i < nx; ++i) {
        const double turn = p->sensors.turn[i], turns = turn > 0.0 ? (x[i] - r->x[i]) / turn : 0.5;
        const int same = memcmp(x + i, r->x + i, sizeof *x) == 0 || fabs(turns - floor(turns + 0.5)) < 1e-6;
        const int held = (int)r->plan.health[3 * i + 2] == (int)RUMO_HELD || p->sensors.age[i] > 0;
        CHECK(same || held, "%s: state %d is %.17g at first, and was measured to be %.17g", r->f->name, i, x[i], r->x[i]);
    }
    for (int i = 0; i < N * nc; ++i) {
        CHECK(isnan(constraints[i]) == !solved, "%s: constraint %g of status %d", r->f->name, constraints[i],
              (int)status);
        violated |= solved && p->imposed[i] && constraints[i] > 1e-6 * p->numbers.constraint_scales[i % nc];
    }
    if (status == RUMO_OPTIMAL) CHECK(!violated, "%s: optimal, but violated", r->f->name);
    if (status == RUMO_SOFT_VIOLATED) CHECK(violated, "%s: not violated", r->f->name);
}

/* Whether a reference is finite wherever it has a weight. */
static int all_wanted(const run *r) {
    const rumo_sizes *s = &r->f->problem->sizes;
    int all = 1;
    for (int i = 0; i < s->horizon * s->outputs; ++i)
        all &= isfinite(r->reference[s->outputs + i]) || r->f->problem->numbers.output_weights[i] == 0.0;
    return all;
}

static void check_outcome(run *r) {
    const rumo_sizes *s = &r->f->problem->sizes;
    const rumo_plan *plan = &r->plan;
    /* A budget of time may run out before there is anything. */
    const double step = plan->numbers[plan->count - RUMO_DIAGNOSTIC_COUNT + RUMO_STEP];
    const int solved = plan->cause < RUMO_BUDGET_EXCEEDED || (plan->cause == RUMO_BUDGET_EXCEEDED && !isnan(step)),
              rows = 2 * s->horizon * s->inputs + s->horizon * s->constraints;
    CHECK(plan->status == plan->cause || (plan->status == RUMO_PLAN_EXHAUSTED && !solved), "%s: status %d for cause %d",
          r->f->name, (int)plan->status, (int)plan->cause);
    int missing = 0;
    for (int i = 0; i < s->states; ++i) missing += !isfinite(r->x[i]);
    if (2 * missing >= s->states || (missing && isinf(r->settings.gate_width)))
        CHECK(plan->cause == RUMO_BAD_MEASUREMENT, "%s: %d", r->f->name, (int)plan->cause);
    else if (missing && !all_wanted(r))
        CHECK(plan->cause == RUMO_BAD_MEASUREMENT || plan->cause == RUMO_BAD_REFERENCE, "%s: %d", r->f->name,
              (int)plan->cause);
    else if (!all_wanted(r))
        CHECK(plan->cause == RUMO_BAD_REFERENCE, "%s: %d", r->f->name, (int)plan->cause);
    else CHECK(plan->cause != RUMO_BAD_REFERENCE, "%s: %d", r->f->name, (int)plan->cause);
    const rumo_settings *set = &r->settings;
    const int judged = isfinite(set->trusted_step) != 0;
    /* From a guess, where the guess has failed from there again with steps that are cut, and from the state alone. */
    const int most = !judged ? set->sqp_iterations : 4 * (1 + set->sqp_iterations + set->settling_iterations);
    CHECK(plan->iterations >= 0 && plan->iterations <= set->qp_iterations * most,
          "%s: %d iterations", r->f->name, plan->iterations);
    CHECK(plan->conflicts >= 0 && plan->conflicts <= rows, "%s: %d conflicts", r->f->name, plan->conflicts);
    for (int i = 0; i < plan->conflicts; ++i)
        CHECK(plan->conflict[i].stage > s->delay && plan->conflict[i].stage <= s->horizon && plan->conflict[i].index >= 0 &&
                  plan->conflict[i].index <
                      (plan->conflict[i].kind == RUMO_PATH_CONSTRAINT ? s->constraints : s->inputs),
              "%s: %d of kind %d at stage %d in conflict", r->f->name, plan->conflict[i].index,
              (int)plan->conflict[i].kind, plan->conflict[i].stage);
    r->unsolved = solved ? 0 : r->unsolved + 1;
    if (r->unsolved > s->horizon - s->delay - 1)
        CHECK(plan->status == RUMO_PLAN_EXHAUSTED, "%s: %d steps with one plan", r->f->name, r->unsolved);
    ++r->counts[plan->status];
    ++r->all[plan->status];
    CHECK(memcmp(r->counts, rumo_core.counts(r->c), sizeof r->counts) == 0, "%s: counts", r->f->name);
    check_inputs(r);
    check_values(r, solved);
}

/* After a reset and a good sample, all is as it was recorded at the beginning. */
static void restart(run *r) {
    const fixture *f = r->f;
    rumo_core.reset(r->c);
    r->settings = usual;
    rumo_core.configure(r->c, &r->settings);
    r->unsolved = 0;
    memset(r->counts, 0, sizeof r->counts);
    copy(rumo_core.applied(r->c), f->applied, decided_of(&f->problem->sizes));
    rumo_core.step(r->c, f->x, f->reference, &r->plan);
    CHECK((int)r->plan.status == f->status[0], "%s: status %d after a reset", f->name, (int)r->plan.status);
    ++r->counts[r->plan.status];
    ++r->all[r->plan.status];
    r->unsolved = r->plan.cause > RUMO_BUDGET_EXCEEDED;
}

static void soak(const fixture *f, long steps) {
    const rumo_sizes *s = &f->problem->sizes;
    run r = {.f = f, .settings = usual};
    r.x = memory_of((size_t)s->states * sizeof *r.x);
    r.reference = memory_of((size_t)window_of(s) * sizeof *r.reference);
    r.told = memory_of((size_t)decided_of(s) * sizeof *r.told);
    void *memory = memory_of(rumo_core.size(f->problem));
    r.c = rumo_core.create(f->problem, &r.settings, memory);
    for (long i = 0; i < steps; ++i) {
        if (chance(0.002)) restart(&r);
        if (chance(0.01)) {
            r.settings = some_settings();
            rumo_core.configure(r.c, &r.settings);
        }
        choose_measurement(&r);
        choose_reference(&r);
        if (chance(0.01)) rumo_core.start(r.c, r.x);
        if (chance(0.5)) rumo_core.prepare(r.c);
        choose_applied(&r);
        if (chance(0.5)) rumo_core.step(r.c, r.x, r.reference, &r.plan);
        else rumo_core.feedback(r.c, r.x, r.reference, &r.plan);
        check_outcome(&r);
    }
    printf("%-14s", f->name);
    for (int i = 0; i < RUMO_STATUS_COUNT; ++i) printf(" %8ld", r.all[i]);
    printf("\n");
    free(r.x);
    free(r.reference);
    free(r.told);
    free(memory);
}

int main(int count, char **arguments) {
    const long steps = count > 1 ? strtol(arguments[1], NULL, 10) : 10000;
    if (count > 2) random_state = strtoull(arguments[2], NULL, 10);
    printf("%-14s  optimal     soft   budget      ill   failed reference measured exhausted\n", "steps");
    for (int i = 0; i < FIXTURES; ++i) soak(&fixtures[i], (steps + FIXTURES - 1 - i) / FIXTURES);
    return finish();
}
