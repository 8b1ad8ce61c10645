/* An integrator of a system, driven by inputs that jump, now and then spoilt. */
#ifndef RUMO_TEST_INTEGRATOR_H
#define RUMO_TEST_INTEGRATOR_H

#include <stdlib.h>

#include "core.h"

#include "fixture.h"
#include "random.h"
#include "systems.h"

enum { MOST_VARIABLES = 64, MOST_INPUTS = 8 };

typedef struct integrator_of {
    rumo_integrator *integrator;
    void *memory;
    const system_of *of;
    double x[MOST_VARIABLES], end[MOST_VARIABLES], u[MOST_INPUTS];
} integrator_of;

static void begin_anew(integrator_of *q) {
    rumo_core.integrator_reset(q->integrator);
    for (int i = 0; i < q->of->system->sizes.states; ++i) q->x[i] = q->of->x[i];
    for (int i = 0; i < q->of->system->sizes.inputs; ++i) q->u[i] = 0.0;
}

static integrator_of integrator_for(const system_of *of) {
    integrator_of q = {.of = of, .memory = memory_of(rumo_core.integrator_size(of->system))};
    q.integrator = rumo_core.integrator_create(of->system, q.memory);
    begin_anew(&q);
    return q;
}

/* From where it is, which it is then no more; how it ended. */
static rumo_ending go_on(integrator_of *q, double duration) {
    const rumo_ending ending = rumo_core.integrator_advance(q->integrator, q->x, q->u, q->of->p, duration, q->end);
    for (int i = 0; ending == RUMO_ARRIVED && i < q->of->system->sizes.states; ++i) q->x[i] = q->end[i];
    return ending;
}

static void jump(integrator_of *q, double size) {
    for (int i = 0; i < q->of->system->sizes.inputs; ++i) q->u[i] = uniform(-size, size);
}

#endif
