/* The real-time iteration in C: one allocation at set-up, none afterwards, no globals, no locks.
 *
 * A controller is made in memory of the caller's, whose size is asked first; all arrays handed over are copied.
 * Every function may be called for different controllers from different threads at the same time.
 */
#ifndef RUMO_CORE_H
#define RUMO_CORE_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Changes whenever a struct of this file does. */
#define RUMO_CORE_VERSION 2

/* What a step came to; the order is that of rumo.Status. */
typedef enum rumo_status {
    RUMO_OPTIMAL,
    RUMO_SOFT_VIOLATED,
    RUMO_BUDGET_EXCEEDED,
    RUMO_SOLVER_FAILED,
    RUMO_BAD_REFERENCE,
    RUMO_BAD_MEASUREMENT,
    RUMO_PLAN_EXHAUSTED,
    RUMO_STATUS_COUNT
} rumo_status;

/* Operations of a tape; a and b are registers. */
typedef enum rumo_operation {
    RUMO_CONSTANT, /* its constant */
    RUMO_INPUT,    /* a: argument (see rumo_tape), b: element */
    RUMO_OUTPUT,   /* result: slot, a: register */
    RUMO_ASSIGN,
    RUMO_ADD,
    RUMO_SUB,
    RUMO_MUL,
    RUMO_DIV,
    RUMO_NEG,
    RUMO_INV,
    RUMO_SQ,
    RUMO_TWICE,
    RUMO_SQRT,
    RUMO_SIN,
    RUMO_COS,
    RUMO_TAN,
    RUMO_ASIN,
    RUMO_ACOS,
    RUMO_ATAN,
    RUMO_ATAN2,
    RUMO_SINH,
    RUMO_COSH,
    RUMO_TANH,
    RUMO_ASINH,
    RUMO_ACOSH,
    RUMO_ATANH,
    RUMO_EXP,
    RUMO_EXPM1,
    RUMO_LOG,
    RUMO_LOG1P,
    RUMO_POW,
    RUMO_HYPOT,
    RUMO_ERF,
    RUMO_FABS,
    RUMO_SIGN,
    RUMO_COPYSIGN,
    RUMO_FLOOR,
    RUMO_CEIL,
    RUMO_FMOD,
    RUMO_FMIN,
    RUMO_FMAX,
    RUMO_LT,
    RUMO_LE,
    RUMO_EQ,
    RUMO_NE,
    RUMO_NOT,
    RUMO_AND,
    RUMO_OR,
    RUMO_IF_ELSE_ZERO,
    RUMO_OPERATION_COUNT
} rumo_operation;

/* A straight-line program that computes the terms of one substep from its arguments: 0 the state at its end, 1 the one
 * at its beginning, 2 inputs, 3 parameters, 4 its other unknowns (algebraic variables at the end, then inner ones). */
typedef struct rumo_tape {
    int length;
    int registers;
    const int *code;         /* (length, 4): operation, result, a, b */
    const double *constants; /* (length,) */
} rumo_tape;

/* A sparse matrix sorted by rows; entry e is term first + e of a stage. */
typedef struct rumo_pattern {
    int count, first;
    const int *row, *column; /* (count,) */
} rumo_pattern;

/* How the unknowns w of a substep are solved for, M dw = A0 dx + B du + defect, block by block of M in triangular order.
 *
 * A block's work is a dense matrix (size, size + width + 1): its part of M, then those columns of (A0, B, defect) that
 * reach it, then the unit of the row. The result [A | B | c] is sparse, entry by entry.
 */
typedef struct rumo_elimination {
    int blocks;
    const int *size, *width, *loads, *updates, *stores; /* (blocks,): the last three count entries */
    const int *unknowns;                                /* (nw,): the unknowns of each block in turn */
    const int *load;                                    /* (sum, 2): slot, place in the work */
    const int *update;                                  /* (sum, 3): slot of M, entry of the result, place */
    const int *store;                                   /* (sum, 2): place, entry of the result */
    int entries;
    const int *row, *column; /* (entries,): of the result, sorted by rows; column nx + nu is c */
} rumo_elimination;

/* How the maps of substeps become that of their interval; no entries where there is but one.
 *
 * Entry e of the interval's map [A | B | c] is the substep's entry own[e] (-1: none) in its columns of B and c, plus the
 * sum over `products[e]` pairs of the substep's entry and the entry of the map so far.
 */
typedef struct rumo_composition {
    int entries;
    const int *row, *column; /* (entries,): sorted by rows, of states and algebraic variables at the end */
    const int *start;        /* (entries,): the substep's entry at the same place, with which the map starts; -1: none */
    const int *own, *products;
    const int *product;      /* (sum, 2) */
} rumo_composition;

typedef struct rumo_sizes {
    int horizon, states, algebraic, inputs, outputs, constraints, parameters, delay;
    int inner;           /* unknowns of a substep besides states and algebraic variables at its end */
    int substeps;        /* of an interval */
    int explicit_scheme; /* the end of a substep follows from its beginning: there are no other unknowns */
    int blocks;          /* of intervals with one free input each: N - delay where every interval has its own */
    int slots;
} rumo_sizes;

/* Where the intervals of the next sample's horizon lie on this one's. */
typedef struct rumo_shift {
    const int *stages;     /* (N + 1,): the stage before, */
    const double *shares;  /* and how far towards the next, as a share; beyond 1 at the end */
    const int *intervals;  /* (N,): in whose time the middle lies */
    int same_rows;         /* whether all lie one interval later: then constraints do as well */
} rumo_shift;

/* Inputs held over several intervals: that of interval k is share times its block's value, and the rest of the value of
 * the block before, which is the last input decided for the first block. */
typedef struct rumo_blocking {
    const int *block;    /* (N,) */
    const double *share; /* (N,) */
    const double *part;  /* (N,): of an interval's input in the value that stands for its block */
} rumo_blocking;

/* The problem in raw units. Infinite limits and infinite l1 (a hard row) are allowed. */
typedef struct rumo_problem {
    rumo_sizes sizes;
    rumo_tape tape, inner_tape;               /* of the last substep, and of those before, without y, G, Cx .. E */
    const double *fixed;                      /* (slots,): terms that are constant; NaN where a tape computes */
    rumo_pattern A0, M, B, Cx, Cu, D, E;      /* of a stage, by (x, z) at the end: Cx, D */
    int y, G, defect;                         /* first terms of the vectors; all terms: y, G, defect, A0, M, B, Cx .. E */
    rumo_elimination elimination;
    rumo_composition composition;
    rumo_shift shift;
    rumo_blocking blocking;
    const int *inner_signals;                 /* (unknowns of an interval but its state,): as a position in (x, z), */
    const double *inner_nodes;                /* and the share of the interval at which they lie */
    const double *algebraic_guess;            /* (nz,) */
    const double *output_weights;             /* (N, ny) */
    const double *move_weights;               /* (blocks, nu) */
    const double *input_scales;               /* (nu,) */
    const double *input_lower, *input_upper;  /* (nu,) */
    const double *move_lower, *move_upper;    /* (nu,): from interval to interval, */
    const double *block_lower, *block_upper;  /* (blocks, nu): and from block to block */
    const double *safe_input;                 /* (nu,) */
    const double *constraint_scales, *l1, *l2; /* (nc,) */
    const int *imposed;                       /* (N, nc) */
    const double *parameters;                 /* (N, np) */
} rumo_problem;

typedef struct rumo_settings {
    int sqp_iterations;
    int preparation_iterations; /* on the predicted state, before the measurement is known */
    double sqp_tolerance;
    int qp_iterations;     /* changes of the working set per QP */
    double qp_tolerance;   /* of a row, in units of the inputs' ranges */
    double qp_seconds;     /* time for a QP; infinite for none */
    double gate_width;     /* of the innovation gate; infinite for none */
    int gate_patience;     /* consistent implausible samples before they are believed */
} rumo_settings;

/* What the last of a plan's numbers say; NaN where nothing was solved. */
typedef enum rumo_diagnostic {
    RUMO_INTEGRATOR_RESIDUAL, /* Newton correction of the guess onto the dynamics, over the reach of the inputs */
    RUMO_STEP,                /* largest change of a free input, over its range */
    RUMO_CONTRACTION,         /* step over that of the iteration before */
    RUMO_KKT_RESIDUAL,        /* largest slope of the Lagrangian at the guess, over the inputs' ranges */
    RUMO_DIAGNOSTIC_COUNT
} rumo_diagnostic;

/* What a step returns; the arrays belong to the controller and stay until its next call. */
typedef struct rumo_plan {
    const double *numbers; /* u (N, nu), x (N + 1, nx), path constraints as linearised (N, nc), z (N, nz), diagnostics */
    int count;
    rumo_status status, cause;
    int iterations;            /* of the QP solver */
    const int *conflict;       /* rows that cannot hold together, if the QP was infeasible: of the */
    int conflicts;             /* free inputs bounds, their increments if limited, path constraints */
    double prepare_seconds, feedback_seconds;
    double linearize_seconds; /* of the preparation, until the guess is linearised and its unknowns eliminated; NAN without one */
} rumo_plan;

typedef struct rumo_controller rumo_controller;

typedef struct rumo_qp_data {
    int variables, rows;
    const double *hessian, *gradient;                  /* (n, n), (n,) */
    const double *lower, *upper;                       /* (n,) */
    const double *matrix;                              /* (rows, n) */
    const double *row_lower, *row_upper, *l1, *l2;     /* (rows,): a finite l1 makes the upper limit soft */
} rumo_qp_data;

typedef struct rumo_qp_result {
    rumo_status status;
    int iterations;
    int conflicts;
    double seconds;        /* of the solution, from the working set on, */
    double factor_seconds; /* and of taking over the data and factoring the Hessian */
} rumo_qp_result;

/* Everything the core offers; a tailored build exports one such table of its own. */
typedef struct rumo_api {
    int version;
    const char *build; /* instruction set, and whether tailored */
    size_t (*size)(const rumo_problem *);
    rumo_controller *(*create)(const rumo_problem *, const rumo_settings *, void *memory);
    void (*configure)(rumo_controller *, const rumo_settings *);
    void (*reset)(rumo_controller *);
    /* Guess of a state at rest, with the last input decided. */
    void (*start)(rumo_controller *, const double *x);
    /* Parameters (N, np) from the next preparation on; after a reset they are the problem's. */
    void (*set_parameters)(rumo_controller *, const double *);
    double *(*applied)(rumo_controller *); /* (max(delay, 1), nu), oldest first; may be written to */
    long long *(*counts)(rumo_controller *); /* (RUMO_STATUS_COUNT,) steps by status since the last reset */
    void (*prepare)(rumo_controller *);
    /* The plan for a measurement x (nx,) and the wanted outputs (N + 1, ny), from now on. */
    void (*feedback)(rumo_controller *, const double *x, const double *reference, rumo_plan *);
    /* Both, with a guess at rest where there is none. */
    void (*step)(rumo_controller *, const double *x, const double *reference, rumo_plan *);
    /* Not in a tailored build. A QP by itself: memory of qp_size bytes; v (n,), multipliers (n + rows,), conflict (n + rows,).
     * With a working set kept from a former call in the same memory (warm), it starts there. */
    size_t (*qp_size)(int variables, int rows);
    rumo_qp_result (*qp_solve)(const rumo_qp_data *, const rumo_settings *, int warm, void *memory, double *v,
                               double *multipliers, int *conflict);
} rumo_api;

#ifdef __cplusplus
}
#endif

#endif
