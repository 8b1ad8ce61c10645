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
#define RUMO_CORE_VERSION 3

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

#include "rumo_tables.h" /* rumo_sizes, rumo_settings, rumo_problem and its parts */

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
