/* Problems as data, with recorded samples: what a controller was told, and what the NumPy reference made of it. */
#ifndef RUMO_FIXTURE_H
#define RUMO_FIXTURE_H

#include <stdlib.h>

#include "rumo_core.h"

typedef struct fixture {
    const char *name;
    const rumo_problem *problem;
    int samples;
    const double *x;         /* (samples, nx) */
    const double *reference; /* (samples, N + 1, ny) */
    const double *applied;   /* (samples, max(delay, 1), nu) */
    const double *numbers;   /* (samples, count): of the reference's plans */
    const int *status;       /* (samples,) */
} fixture;

static const rumo_settings usual = {.sqp_iterations = 1,
                                    .sqp_tolerance = 1e-9,
                                    .trusted_step = (double)INFINITY,
                                    .qp_iterations = 1000,
                                    .qp_tolerance = 1e-10,
                                    .seconds = (double)INFINITY,
                                    .gate_width = 3.0,
                                    .gate_patience = 8};

static inline int decided_of(const rumo_sizes *s) { return (s->delay > 1 ? s->delay : 1) * s->inputs; }

static inline int count_of(const rumo_sizes *s) {
    return s->horizon * s->inputs + (s->horizon + 1) * s->states + s->horizon * (s->constraints + s->algebraic) +
           RUMO_DIAGNOSTIC_COUNT;
}

static inline int window_of(const rumo_sizes *s) { return (s->horizon + 1) * s->outputs; }

static inline void *memory_of(size_t bytes) {
    void *memory = malloc(bytes);
    if (!memory) abort();
    return memory;
}

#endif
