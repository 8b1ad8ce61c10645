/* The horizon linearised at a guess, and what it takes to get there. */
#ifndef RUMO_STAGES_H
#define RUMO_STAGES_H

#include "base/system.h"

#include "rumo_core.h"

#include "base/arena.h"
#include "base/dims.h"
#include "stages/equations.c"
#include "stages/sparse.h"
#include "stages/tape.c"

/* dx_i = A dx_{i-1} + B du_{i-1} + c for states and algebraic variables, y and G with their derivatives. A number of
 * stage k lies in lane k. */
typedef struct stage_maps {
    dims s;
    const rumo_problem *problem;

    double *guess_x, *guess_u;    /* (N + 1, nx), (N, nu): where it is linearised */
    double *guess_values;         /* (nb, nu): of its blocks; the end of guess_u where there are none */
    double *guess_last;           /* (nu,): the input before the first free one, as it was then */
    double *guess_inner;          /* (ni, lanes): other unknowns of the intervals, see inner.c */

    double *maps, *other_maps;    /* (entries, lanes): A, B and c of the intervals, see compose.c; results if m = 1 */
    sparse map;                   /* their rows */
    const int *map_row;
    int *end_of_A;                /* (rows,): where the entries of A end in each row of a map */
    double *terms;                /* (slots, lanes): y, G and their derivatives, by */
    sparse Cx, Cu, D, E;
    double *reach;                /* (nx,): how far all inputs' ranges move a state until the end of the horizon */

    double *x_lanes, *u_lanes, *p_lanes, *registers, *work; /* see tape.c, eliminate.c */
    double *results;              /* (m, entries, lanes): maps of the substeps; of the last one if explicit */
    sparse of_unknowns;           /* their rows */
    double *on_the_way;           /* (nx, lanes): state that an explicit scheme has come to */
    double *zeros, *lack;         /* (lanes,) */
    double *known_lanes;          /* (nx + nu + 1, lanes): dx, du and 1, see expand_inner() */
    const block_pattern *patterns; /* of sparse factors */

    equations equations;           /* of wide models, in place of results and maps, */
    double *correction;            /* and in place of c (nw, lanes), by unknowns: states first */
} stage_maps;

static inline double *results_of(const stage_maps *m, int substep) {
    return m->results + (m->s.explicit_scheme ? 0 : (ptrdiff_t)substep * m->problem->elimination.entries * m->s.lanes);
}

/* Whether there are no maps, but equations to be solved: many states, and few inputs. */
static inline int is_wide(const stage_maps *m) { return RUMO_WIDE && m->problem->elimination.blocks == 0; }

/* In memory or, to measure it, without; `p` is the problem as given, `own` the copy that stays. */
RARE static void lay_out_stages(arena *a, stage_maps *m, const rumo_problem *own, const rumo_problem *p) {
    const dims s = m->s = dims_of(&p->sizes);
    const rumo_elimination *e = &p->elimination;
    const rumo_composition *composed = &p->composition;
    m->problem = own;
    m->guess_x = alloc_doubles(a, (s.N + 1) * s.nx);
    m->guess_u = alloc_doubles(a, s.N * s.nu);
    if (!unblocked(&s)) m->guess_values = alloc_doubles(a, s.n);
    else m->guess_values = a->base ? m->guess_u + s.d * s.nu : NULL;
    m->guess_last = alloc_doubles(a, s.nu);
    m->guess_inner = alloc_doubles(a, (ptrdiff_t)s.ni * s.lanes);

    m->x_lanes = alloc_doubles(a, s.nx * (s.lanes + LANES));
    m->u_lanes = alloc_doubles(a, s.nu * s.lanes);
    m->p_lanes = alloc_doubles(a, (ptrdiff_t)p->sizes.parameters * s.lanes);
#ifndef RUMO_TAILORED
    const int registers = p->tape.registers, inner = p->inner_tape.registers;
    m->registers = alloc_doubles(a, (ptrdiff_t)(registers > inner ? registers : inner) * CHUNK);
#endif
    m->terms = alloc_doubles(a, (ptrdiff_t)p->sizes.slots * s.lanes);
    m->results = alloc_doubles(a, (ptrdiff_t)(s.explicit_scheme ? 1 : s.m) * e->entries * s.lanes);
    m->maps = s.m > 1 ? alloc_doubles(a, (ptrdiff_t)composed->entries * s.lanes) : m->results;
    m->other_maps = s.m > 1 ? alloc_doubles(a, (ptrdiff_t)composed->entries * s.lanes) : NULL;
    m->on_the_way = alloc_doubles(a, s.explicit_scheme ? s.nx * s.lanes : 0);
    m->zeros = alloc_doubles(a, s.lanes);
    m->lack = alloc_doubles(a, s.lanes);
    m->known_lanes = alloc_doubles(a, s.ni ? s.width * s.lanes : 0);
    int largest = 0;
    for (int b = 0; b < e->blocks; ++b) {
        const int dense = e->size[b] * (2 * (e->size[b] + e->width[b] + 1) + 1);
        const int size = dense + (e->sparse[b] ? e->size[b] * (e->width[b] + 2 * e->size[b]) : 0);
        largest = size > largest ? size : largest;
    }
    m->work = alloc_doubles(a, largest * LANES);
    m->patterns = patterns_of(a, &own->factor, &p->factor);
    if (RUMO_WIDE && e->blocks == 0) {
        lay_out_equations(a, &m->equations, m->patterns, own, p);
        m->correction = alloc_doubles(a, (ptrdiff_t)s.nw * s.lanes);
    }
    const rumo_pattern result = {e->entries, 0, e->row, e->column};
    const rumo_pattern composition = {composed->entries, 0, composed->row, composed->column};
    m->of_unknowns = rows_of(a, &result, s.nw);
    m->map = s.m > 1 ? rows_of(a, &composition, s.rows) : m->of_unknowns;
    m->map_row = s.m > 1 ? own->composition.row : own->elimination.row;
    m->Cx = rows_of(a, &p->Cx, s.ny);
    m->Cu = rows_of(a, &p->Cu, s.ny);
    m->D = rows_of(a, &p->D, s.nc);
    m->E = rows_of(a, &p->E, s.nc);
    m->end_of_A = alloc_ints(a, s.rows);
    m->reach = alloc_doubles(a, s.nx);
    if (!a->base) return;
    for (int k = 0; s.ni && k < s.lanes; ++k) m->known_lanes[(ptrdiff_t)(s.width - 1) * s.lanes + k] = 1.0;
    for (int i = 0; i < p->sizes.slots; ++i)
        for (int k = 0; k < s.lanes; ++k) m->terms[(ptrdiff_t)i * s.lanes + k] = isnan(p->fixed[i]) ? 0.0 : p->fixed[i];
    for (int r = 0; r < s.rows; ++r) {
        m->end_of_A[r] = m->map.start[r];
        while (m->end_of_A[r] < m->map.start[r + 1] && m->map.column[m->end_of_A[r]] < s.nx) ++m->end_of_A[r];
    }
}

#endif
