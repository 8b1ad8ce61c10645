/* Filters: what they believe stays finite, and a covariance; what is no filter's problem is told. */
#include "core.h"

#include "check.h"
#include "filter.h"
#include "fixture.h"
#include "fixtures.h"

static void check_covariance(const char *name, const filter_of *f) {
    const int n = f->s->states;
    const double *const ud = f->belief + n;
    rumo_core.filter_covariance(f->filter, f->belief, f->P);
    for (int i = 0; i < n; ++i) {
        CHECK(ud[i * (n + 1)] >= 0.0, "%s: D[%d] is %g", name, i, ud[i * (n + 1)]);
        for (int j = 0; j < n; ++j) {
            const double bound = sqrt(f->P[i * (n + 1)] * f->P[j * (n + 1)]);
            CHECK(f->P[i * n + j] == f->P[j * n + i], "%s: P[%d, %d]", name, i, j);
            CHECK(fabs(f->P[i * n + j]) <= bound * (1.0 + 1e-12), "%s: %g over %g", name, f->P[i * n + j], bound);
        }
    }
}

/* The model alone leads where a filter goes that is told nothing. */
static void check_model(const char *name, const filter_of *f) {
    const int n = f->s->states, m = f->s->outputs;
    double *x = filled(n, 0.0), *A = filled(n * n, 0.0), *y = filled(m, 0.0), *H = filled(m * n, 0.0);
    copy(x, f->belief, n);
    f->u[0] = 0.1;
    for (int j = 0; j < m; ++j) f->y[j] = NAN;
    CHECK(rumo_core.filter_linearise(f->filter, x, f->u, f->p, A, y, H), "%s: no model", name);
    CHECK(rumo_core.filter_advance(f->filter, f->belief, f->u, f->p, f->y, f->after, f->report), "%s: no step", name);
    for (int i = 0; i < n; ++i) CHECK(x[i] == f->after[i], "%s: x[%d] %g, %g", name, i, x[i], f->after[i]);
    for (int j = 0; j < m; ++j) CHECK(y[j] == x[j], "%s: y[%d] %g, %g", name, j, y[j], x[j]);
    x[0] = NAN;
    CHECK(!rumo_core.filter_linearise(f->filter, x, f->u, f->p, A, y, H), "%s: from nowhere", name);
}

static void follow(const fixture *fixture, double width) {
    const filter_of f = filter_for(fixture, width);
    int lost = 0, refused = 0;
    for (int i = 0; i < 300; ++i) {
        const int there = filter_step(&f, i);
        lost += !there;
        CHECK(there == (i % 50 != 49), "%s: sample %d", fixture->name, i);
        CHECK(all_finite(f.belief, belief_size(f.s)), "%s: sample %d", fixture->name, i);
        if (!there) continue;
        check_covariance(fixture->name, &f);
        for (int j = 0; j < f.s->outputs; ++j) {
            const double innovation = f.report[j], deviation = f.report[f.s->outputs + j], used = f.report[2 * f.s->outputs + j];
            CHECK(isnan(innovation) == isnan(f.y[j]), "%s: an innovation of %g", fixture->name, innovation);
            refused += !isnan(innovation) && used == 0.0;
            CHECK(used == 0.0 || fabs(innovation) <= width * deviation * (1.0 + 1e-12), "%s: %g is used", fixture->name, innovation);
        }
        CHECK(f.report[3 * f.s->outputs] >= 0.0, "%s: NIS %g", fixture->name, f.report[3 * f.s->outputs]);
    }
    check_model(fixture->name, &f);
    CHECK(lost == 6, "%s: lost %d times", fixture->name, lost);
    CHECK((refused > 0) == (width < (double)INFINITY), "%s: refused %d", fixture->name, refused);
}

int main(void) {
    int filters = 0;
    for (int i = 0; i < FIXTURES; ++i) {
        const rumo_problem *p = fixtures[i].problem;
        const rumo_sizes *s = &p->sizes;
        rumo_filter_data data = {filled(s->outputs, 0.01), filled(s->states, 1e-6), filled(s->states, 0.0),
                                 filled(s->outputs, 0.0), filled(1, 3.0), 3};
        const rumo_error error = rumo_core.filter_check(p, &data).error;
        CHECK((error == RUMO_FINE) == (s->horizon == 1), "%s: error %d", fixtures[i].name, (int)error);
        if (error) {
            let_go();
            continue;
        }
        data.noise = filled(s->outputs, 0.0);
        CHECK(rumo_core.filter_check(p, &data).error == RUMO_NOT_POSITIVE, "%s: no noise", fixtures[i].name);
        follow(&fixtures[i], 3.0);
        follow(&fixtures[i], (double)INFINITY);
        ++filters;
        let_go();
    }
    let_go();
    CHECK(filters == 2, "%d filters", filters);
    return finish();
}
