/* Other numbers between two samples: the same as a controller made with them, and at once where bounds are concerned. */
#include "core.h"

#include "check.h"
#include "fixture.h"
#include "fixtures.h"
#include "random.h"

/* Numbers that are one's own, to be changed at random. */
typedef struct own_numbers {
    rumo_numbers is;
    void *memory;
} own_numbers;

static own_numbers copied(const rumo_problem *p) {
    own_numbers own = {p->numbers, NULL};
    arena a = {NULL, 0};
    copy_rumo_numbers(&a, &own.is, &p->numbers, &p->sizes);
    own.memory = memory_of(a.used + ALIGNMENT);
    a = (arena){aligned(own.memory), 0};
    copy_rumo_numbers(&a, &own.is, &p->numbers, &p->sizes);
    return own;
}

static void scale(const double *x, int count, double least, double most) {
    double *changed = (double *)x;
    for (int i = 0; i < count; ++i) changed[i] *= uniform(least, most);
}

/* Every kind of number changes; limits stay such that there is a solution. */
static void vary(own_numbers *own, const rumo_sizes *s) {
    const rumo_numbers *n = &own->is;
    scale(n->output_weights, s->horizon * s->outputs, 0.3, 3.0);
    scale(n->move_weights, s->blocks * s->inputs, 0.3, 3.0);
    scale(n->input_scales, s->inputs, 0.5, 2.0);
    scale(n->constraint_scales, s->constraints, 0.5, 2.0);
    scale(n->l1, s->constraints, 0.5, 2.0);
    scale(n->l2, s->constraints, 0.5, 2.0);
    scale(n->parameter_values, s->horizon * s->parameters, 0.99, 1.01);
    scale(n->bounds.safe_input, s->inputs, 0.5, 1.0);
    for (int j = 0; j < s->inputs; ++j) {
        double *lower = (double *)n->bounds.move_lower, *upper = (double *)n->bounds.move_upper;
        const double span = n->input_scales[j];
        lower[j] = below(2) ? -INFINITY : -uniform(0.3, 1.0) * span;
        upper[j] = below(2) ? INFINITY : uniform(0.3, 1.0) * span;
        for (int b = 0; b < s->blocks; ++b) {
            ((double *)n->block_lower)[b * s->inputs + j] = lower[j];
            ((double *)n->block_upper)[b * s->inputs + j] = upper[j];
        }
        for (int k = 0; k < s->horizon; ++k) {
            double *of = (double *)n->bounds.input_upper + k * s->inputs + j;
            const double room = *of - n->bounds.input_lower[k * s->inputs + j];
            if (isfinite(room)) *of -= uniform(0.0, 0.2) * room;
        }
    }
    for (int i = 0; i < s->horizon * s->constraints; ++i)
        ((double *)n->constraint_limits)[i] =
            below(6) ? n->constraint_scales[i % s->constraints] * uniform(0.0, 0.1) : INFINITY;
}

static int same(const rumo_plan *a, const rumo_plan *b) {
    if (a->status != b->status || a->cause != b->cause || a->iterations != b->iterations) return 0;
    for (int i = 0; i < a->count; ++i)
        if (a->numbers[i] != b->numbers[i] && !(isnan(a->numbers[i]) && isnan(b->numbers[i]))) return 0;
    return 1;
}

static rumo_controller *made(const rumo_problem *p, void **memory) {
    *memory = memory_of(rumo_core.size(p));
    return rumo_core.create(p, &usual, *memory);
}

/* Whether two solvers of the same problem agree. */
static int agree(const rumo_plan *a, const rumo_plan *b, const rumo_problem *p) {
    if (a->status != b->status) return 0;
    for (int i = 0; i < p->sizes.horizon * p->sizes.inputs; ++i)
        if (fabs(a->numbers[i] - b->numbers[i]) > 1e-8 * p->numbers.input_scales[i % p->sizes.inputs]) return 0;
    return 1;
}

/* Limits that are there at some stages only: both stage solvers come to the same plans, unless a plant grows too much to be
 * condensed. */
static void solvers_agree(const fixture *f) {
    rumo_problem other = *f->problem;
    own_numbers own = copied(f->problem);
    void *memory[2];
    for (int round = 0; round < 3; ++round) {
        vary(&own, &other.sizes);
        other.numbers = own.is;
        rumo_controller *both[2];
        for (int i = 0; i < 2; ++i) {
            other.sizes.condensing = i;
            both[i] = made(&other, &memory[i]);
        }
        copy(rumo_core.applied(both[0]), rumo_core.applied(both[1]), decided_of(&other.sizes));
        for (int i = 0; i < f->samples; ++i) {
            rumo_plan plan[2];
            for (int j = 0; j < 2; ++j)
                rumo_core.step(both[j], f->x + i * other.sizes.states, f->reference + i * window_of(&other.sizes), &plan[j]);
            if (i == 0 && plan[1].cause == RUMO_ILL_CONDITIONED) break;
            CHECK(agree(&plan[0], &plan[1], &other), "%s, sample %d: status %d and %d", f->name, i, (int)plan[0].status,
                  (int)plan[1].status);
        }
        free(memory[0]);
        free(memory[1]);
    }
    free(own.memory);
}

/* An update before the first step is a controller made with other numbers. */
static void update_is_set_up(const fixture *f) {
    rumo_problem other = *f->problem;
    const rumo_sizes *s = &other.sizes;
    own_numbers own = copied(f->problem);
    void *memory[2];
    for (int round = 0; round < 3; ++round) {
        vary(&own, s);
        rumo_controller *updated = made(f->problem, &memory[0]);
        const rumo_fault fault = rumo_core.update(updated, &own.is);
        CHECK(fault.error == RUMO_FINE, "%s: %s[%d] %s", f->name, fault.member, fault.index,
              rumo_core.error_text(fault.error));
        other.numbers = own.is;
        rumo_controller *fresh = made(&other, &memory[1]);
        copy(rumo_core.applied(updated), rumo_core.applied(fresh), decided_of(s));
        for (int i = 0; i < f->samples; ++i) {
            rumo_plan a, b;
            rumo_core.step(updated, f->x + i * s->states, f->reference + i * window_of(s), &a);
            rumo_core.step(fresh, f->x + i * s->states, f->reference + i * window_of(s), &b);
            CHECK(same(&a, &b), "%s, sample %d: status %d and %d", f->name, i, (int)a.status, (int)b.status);
        }
        free(memory[0]);
        free(memory[1]);
    }
    free(own.memory);
}

/* Between two samples: the plan goes on, and inputs respect the bounds that hold then. */
static void update_on_the_way(const fixture *f) {
    const rumo_sizes *s = &f->problem->sizes;
    own_numbers own = copied(f->problem);
    void *memory;
    rumo_controller *c = made(f->problem, &memory);
    for (int i = 0; i < f->samples; ++i) {
        rumo_plan plan;
        if (i % 2) rumo_core.prepare(c);
        if (i % 5 == 4) {
            if (i > 15) { /* bounds alone need no preparation */
                const int prepared = rumo_core.prepared(c);
                rumo_numbers bounds = {0};
                bounds.bounds.input_upper = own.is.bounds.input_upper;
                bounds.bounds.safe_input = own.is.bounds.safe_input;
                bounds.constraint_limits = own.is.constraint_limits;
                CHECK(rumo_core.update(c, &bounds).error == RUMO_FINE, "%s", f->name);
                CHECK(rumo_core.prepared(c) == prepared, "%s: bounds ask for a preparation", f->name);
            }
            vary(&own, s);
            CHECK(rumo_core.update(c, &own.is).error == RUMO_FINE, "%s", f->name);
            CHECK(!rumo_core.prepared(c), "%s: other weights and no preparation", f->name);
        }
        rumo_core.step(c, f->x + i * s->states, f->reference + i * window_of(s), &plan);
        for (int k = s->delay; k < s->horizon; ++k)
            for (int j = 0; j < s->inputs; ++j) {
                const int at = k * s->inputs + j;
                CHECK(plan.numbers[at] >= own.is.bounds.input_lower[at] && plan.numbers[at] <= own.is.bounds.input_upper[at],
                      "%s, sample %d: input %d of %d is %g", f->name, i, j, k, plan.numbers[at]);
            }
    }
    free(memory);
    free(own.memory);
}

/* One wrong number, and nothing has changed. */
static void wrong_numbers_change_nothing(const fixture *f) {
    const rumo_sizes *s = &f->problem->sizes;
    own_numbers own = copied(f->problem);
    void *memory[2];
    rumo_controller *c = made(f->problem, &memory[0]), *other = made(f->problem, &memory[1]);
    vary(&own, s);
    ((double *)own.is.input_scales)[s->inputs - 1] = -1.0;
    const rumo_fault fault = rumo_core.update(c, &own.is);
    CHECK(fault.error == RUMO_NOT_POSITIVE && fault.index == s->inputs - 1, "%s: %s", f->name, fault.member);
    for (int i = 0; i < 5; ++i) {
        rumo_plan a, b;
        rumo_core.step(c, f->x + i * s->states, f->reference + i * window_of(s), &a);
        rumo_core.step(other, f->x + i * s->states, f->reference + i * window_of(s), &b);
        CHECK(same(&a, &b), "%s, sample %d", f->name, i);
    }
    free(memory[0]);
    free(memory[1]);
    free(own.memory);
}

int main(void) {
    for (int i = 0; i < FIXTURES; ++i) {
        update_is_set_up(&fixtures[i]);
        solvers_agree(&fixtures[i]);
        update_on_the_way(&fixtures[i]);
        wrong_numbers_change_nothing(&fixtures[i]);
    }
    return finish();
}
