/* Memory of the structured solver: the horizon as a linear quadratic problem with stages.
 *
 * Node k + 1 lies at the end of stage k. What is there is zeta = (x, z, v), deviations from the guess: states, algebraic
 * variables, and the free inputs that act on the stage in units of their ranges, since cost and limits are also on their
 * changes. Where inputs are held over blocks, v is the value of a stage's block and of the one before.
 *
 *   zeta_{k+1} = F zeta_k + G v_k + (c, 0)
 *
 * Completing squares along the stages, from the last one back, leaves |w|^2 / 2 with v_k = -K zeta_k + L'^-1 w_k: the space in
 * which the active-set method works. A row joins by a sweep back, w leads to zeta by a sweep forward, each linear in N.
 *
 * Source: Frison and Jorgensen (2013) for condensing and Riccati recursion as two orders of one elimination.
 */
#ifndef RUMO_RICCATI_H
#define RUMO_RICCATI_H

#include "base/blocks.h"
#include "solve/active_set/qp.c"
#include "solve/free_inputs.h"
#include "solve/stage_solver.h"

/* Where what lies in vectors over zeta, and in rows over (zeta_k, v_k, 1): constants in a tailored build. Where inputs are not
 * held over blocks, F has no columns of v, and those of G take their place. */
typedef struct layout {
    int v, before;     /* of a block's value and of the one before, in zeta; the same where inputs are not held */
    int zeta;          /* length of zeta */
    int B, c;          /* of G and of the constant term in a row of a stage */
    int ld;            /* length of both, padded */
    int rows;          /* rows of F that are stored: those of v are a shift where inputs are not held */
    int moving;        /* entries of zeta that F moves on: not z */
    int columns;       /* columns of a stage: those, v_k, 1 */
} layout;

static inline layout layout_of(const dims *s) {
    const int held = !unblocked(s);
    layout p;
    p.v = s->rows;
    p.before = s->rows + (held ? s->nu : 0);
    p.zeta = p.before + s->nu;
    p.B = held ? p.zeta : p.v;
    p.c = p.B + s->nu;
    p.ld = padded(p.zeta > p.c + 1 ? p.zeta : p.c + 1);
    p.rows = held ? p.zeta : s->rows;
    p.moving = s->nx + (held ? 2 * s->nu : 0);
    p.columns = p.moving + s->nu + 1;
    return p;
}

/* Up to four entries of the maps that lie side by side in a stage: see horizon.c. */
typedef struct laid_entries {
    int of[4], count, to;   /* which they are, how many, and where they go to */
    const double *lanes[4]; /* the entries themselves */
} laid_entries;

/* Sparse rows over zeta at the ends of stages, see node_rows.h. */
typedef struct node_rows {
    int rows;
    int *start, *entry;   /* (rows + 1,), (entries,): of zeta */
    const double **value; /* (entries,): each (lanes,) */
    double *mixed;        /* (entries of v, lanes) */
} node_rows;

/* Members without m and L: the stages in closed loop, from w to what rows limit, see chain.c. Vectors at a stage's end are
 * (zeta, changes of inputs). */
typedef struct chain {
    int size, ld, laid;    /* of such vectors, and padded; whether the stages are those prepared last */
    double *loop, *noise;  /* (N, zeta, ld), (N, nu, ld): columns by zeta at the beginning, and by w */
    double *S;             /* (N + 1, size, ld): covariance at nodes, given the members before */
    double *half;          /* (zeta, ld) */
    double *gain, *pivot, *share; /* (rows, ld), (rows,), (rows,): of members; the last of what a row varies by itself */
    double *now, *next;    /* (ld,) */
    double *from;          /* (ld,): a member's covariance with all */
    int *position, *held;  /* (rows,): of members, else -1; states of those that are in the gains, else 0 */
} chain;

/* What an output adds to the lower half of P (zeta, ld) at `at`: a product of lanes. */
typedef struct curvature_term {
    const double *curvature, *first, *second;
    int at;
} curvature_term;

typedef struct riccati {
    qp q;
    dims s;
    const rumo_problem *problem;
    double *stages;                  /* (lanes, rows + columns, ld): rows of (F, G, c), and columns with those of v */
    double *scaled;                  /* (1 + entries of inputs, lanes): zeros; those entries, in units of the ranges */
    laid_entries *laid;              /* (laid_count,): what each stage is made of */
    int laid_count;
    double *gains, *roots;           /* (N, nu, ld), (N, nu, nu): -K and L'^-1 D^-1/2 */
    double *kept, *of_v, *unit;      /* (ld,), and (nu, ld): where a row of (F, G, c) has F; of v, if it has not; of each */
    double *P, *next_P, *T, *H;      /* (zeta, ld) each, rounded up to four rows, and (nu, ld): see factorise.c */
    double *factor, *inverse;        /* (nu, nu), (nu,): L, and 1 / D, of a stage */
    double *move_curvature;          /* (N, nu): by change of v, where inputs begin, else 0 */
    double damping;                  /* of changes of v: see stage_solver.h */
    double *output_curvature;        /* (ny, lanes): by outputs */
    curvature_term *terms;           /* (term_count,): the curvature that outputs add at the end of a stage */
    int term_count;
    double *Pc;                      /* (N + 1, ld): P c at each node */
    double *zeta, *nodes;            /* (N + 1, ld): trajectory; slopes by it */
    double *zeta_lanes, *slope_lanes; /* (zeta, lanes): the same at the ends of stages */
    node_rows outputs, constraints;
    double *change_lanes, *moves;    /* (nu, lanes): changes of v where inputs begin, and those of the guess */
    double *force;                   /* (lanes,) */
    double *pi, *gamma;              /* (room, ld), (room,): a member's value at w = 0 is pi' zeta_d + gamma */
    chain chain;
    double *row, *out, *input_slope; /* (ld,), (ld,), (nu,): scratch */
    double *covariance, *half, *closed; /* (zeta, ld) each: see norms.c */
    int norms_at;                    /* stage at which norms are refreshed next, -1: at all */
    double *reach_products[2];       /* (nx, ld) */
    double *best, *other, *inputs;   /* (nb, nu) */
    double *largest_curvature, *largest_force, *largest_slope; /* (nu,): along an input, over the horizon */
    int *pins, pinned;               /* (N, nu): bounds at which inputs are kept, and whether any are: see pins.c */
    double *pin_slopes;              /* (N, nu): of the Lagrangian, or of a row, by inputs kept */
    int shift, limited;              /* stages by which the working set is taken over; whether changes of inputs are limited */
    free_limits limits;
    const stage_maps *maps;          /* what is being solved */
    const stage_known *known;
    rumo_conflict *conflict;
} riccati;

/* What a row of the program limits: which input or constraint of stage k. */
typedef struct stage_limit {
    rumo_limit kind;
    int k, index;
} stage_limit;

static inline stage_limit limited_by(const riccati *r, int row) {
    const int lanes = r->s.lanes, number = row / lanes, k = row % lanes, nu = r->s.nu;
    if (row >= r->q.first_soft) return (stage_limit){RUMO_PATH_CONSTRAINT, k, number - r->q.first_soft / lanes};
    return number < nu ? (stage_limit){RUMO_INPUT_BOUND, k, number} : (stage_limit){RUMO_MOVE_BOUND, k, number - nu};
}

static inline double *rows_of_stage(const riccati *r, const layout *p, int k) {
    return r->stages + (ptrdiff_t)k * (p->rows + p->columns) * p->ld;
}

static inline double *columns_of_stage(const riccati *r, const layout *p, int k) {
    return rows_of_stage(r, p, k) + p->rows * p->ld;
}

/* Whether new inputs begin at a stage. */
static inline int begins(const dims *s, const rumo_blocking *held, int k) {
    return unblocked(s) || k == s->d || held->block[k] != held->block[k - 1];
}

#endif
