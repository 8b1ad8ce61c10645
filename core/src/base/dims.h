/* Sizes of a problem and what follows from them: constants in a tailored build. */
#ifndef RUMO_DIMS_H
#define RUMO_DIMS_H

#include "base/system.h"

#include "rumo_core.h"

#include "base/lanes.h"

/* Whether some blocks have sparse factors, and whether there are equations in place of maps: 0 where a tailored build knows
 * that there are none, so that nothing is compiled for them. */
#ifndef RUMO_SPARSE
#define RUMO_SPARSE 1
#endif
#ifndef RUMO_WIDE
#define RUMO_WIDE 1
#endif

typedef struct dims {
    int N, d, nx, nz, nu, ny, nc, lanes; /* lanes: stages, padded */
    int m, nw, ni;                       /* substeps, unknowns of each; of an interval but its state at the end */
    int explicit_scheme;
    int condensing;                      /* whether the states are eliminated at once */
    int nb;                              /* blocks of intervals with one free input each */
    int n, ld;                           /* free inputs; length of a row of them, padded */
    int rows, width, ldx;                /* rows nx + nz and columns of a stage's (A, B, c); rows, padded */
} dims;

static inline dims dims_of(const rumo_sizes *p) {
#ifdef RUMO_TAILORED
    static const rumo_sizes tailored = {RUMO_SIZES};
    p = &tailored;
#endif
    dims s;
    s.N = p->horizon;
    s.d = p->delay;
    s.nx = p->states;
    s.nz = p->algebraic;
    s.nu = p->inputs;
    s.ny = p->outputs;
    s.nc = p->constraints;
    s.lanes = padded(s.N);
    s.m = p->substeps;
    s.nw = s.nx + s.nz + p->inner;
    s.explicit_scheme = p->explicit_scheme;
    s.ni = s.explicit_scheme ? 0 : s.m * s.nw - s.nx;
    s.condensing = p->condensing;
    s.nb = p->blocks;
    s.n = s.nb * s.nu;
    s.ld = padded(s.n);
    s.rows = s.nx + s.nz;
    s.width = s.nx + s.nu + 1;
    s.ldx = padded(s.rows);
    return s;
}

/* Stages over which the gate asks how far states can go. */
static inline int gate_stages(const dims *s) { return s->N < s->d + RUMO_GATE_STAGES ? s->N : s->d + RUMO_GATE_STAGES; }

/* Inputs already decided when a measurement comes: those of the delay or, without one, the last. */
static inline int decided_inputs(const dims *s) { return s->d > 1 ? s->d : 1; }

/* Whether every interval has an input of its own. */
static inline int unblocked(const dims *s) { return s->nb == s->N - s->d; }

#endif
