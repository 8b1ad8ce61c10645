/* A filter for a problem of one interval, told measurements that wander, now and then spoilt. */
#ifndef RUMO_TEST_FILTER_H
#define RUMO_TEST_FILTER_H

#include "core.h"
#include "fixture.h"

typedef struct filter_of {
    rumo_filter *filter;
    const rumo_sizes *s;
    double *belief, *after; /* (n + n n + m,) */
    double *report;         /* (3 m + 2,) */
    double *u, *p, *y, *P;
    double *predicted;      /* (m,): measurements */
} filter_of;

static inline int belief_size(const rumo_sizes *s) { return s->states * (s->states + 1) + s->outputs; }

/* All that is taken here, until it is let go. */
static void *pieces[256];
static int pieces_taken;

static void *piece_of(size_t bytes) {
    if (pieces_taken == sizeof pieces / sizeof *pieces) abort();
    return pieces[pieces_taken++] = memory_of(bytes);
}

static inline void let_go(void) {
    while (pieces_taken > 0) free(pieces[--pieces_taken]);
}

static double *filled(int count, double value) {
    double *x = piece_of(((size_t)count + 1) * sizeof *x);
    for (int i = 0; i < count; ++i) x[i] = value;
    return x;
}

static filter_of filter_for(const fixture *from, double width) {
    const rumo_problem *const p = from->problem;
    const rumo_sizes *s = &p->sizes;
    const rumo_filter_data data = {filled(s->outputs, 0.01), filled(s->states, 1e-6), filled(s->states, 1e-8),
                                   filled(s->outputs, 0.0), filled(1, width), 3};
    filter_of f = {.s = s};
    f.filter = rumo_core.filter_create(p, &data, piece_of(rumo_core.filter_size(p, &data)));
    f.belief = filled(belief_size(s), 0.0);
    f.after = filled(belief_size(s), 0.0);
    f.report = filled(3 * s->outputs + 2, 0.0);
    f.u = filled(s->inputs, 0.1);
    f.p = filled(s->parameters, 1.0);
    f.y = filled(s->outputs, 0.0);
    f.predicted = filled(s->outputs, 0.0);
    copy(f.predicted, from->x, s->outputs); /* outputs of fixtures with one interval are their first states */
    f.P = filled(s->states * s->states, 0.0);
    for (int i = 0; i < s->states; ++i) {
        f.belief[i] = from->x[i];
        f.belief[s->states + i * (s->states + 1)] = 0.01;
    }
    return f;
}

/* Sample i: near what was predicted before, with outliers, without some, and once in a while with an input that is none;
 * whether there is something to go on from. */
static int filter_step(const filter_of *f, int i) {
    const int m = f->s->outputs;
    for (int j = 0; j < m; ++j) f->y[j] = f->predicted[j] + 0.02 * ((i + j) % 7 - 3) + (i % 11 == j ? 20.0 : 0.0);
    if (m && i % 5 == 0) f->y[i % m] = NAN;
    f->u[0] = i % 50 == 49 ? NAN : 0.1;
    if (!rumo_core.filter_advance(f->filter, f->belief, f->u, f->p, f->y, f->after, f->report)) return 0;
    copy(f->belief, f->after, belief_size(f->s));
    for (int j = 0; j < m; ++j)
        if (isfinite(f->report[j])) f->predicted[j] = f->y[j] - f->report[j];
    return 1;
}

#endif
