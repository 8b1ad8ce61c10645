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
#define RUMO_CORE_VERSION 17

/* What the failure policy goes by; methods outside the core read these too. */
#define RUMO_GATE_STAGES 15       /* over which the gate asks how far a state can go: over a long horizon, anywhere */
#define RUMO_SLACK_TOLERANCE 1e-6 /* a constraint counts as violated above this share of its scale */

/* What a step came to; the order is that of rumo.Status. */
typedef enum rumo_status {
    RUMO_OPTIMAL,
    RUMO_SOFT_VIOLATED,
    RUMO_UNTRUSTED,
    RUMO_BUDGET_EXCEEDED,
    RUMO_ILL_CONDITIONED,
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
    RUMO_CONTRACTION,         /* step over that of the iteration before, at the same sample */
    RUMO_KKT_RESIDUAL,        /* what the plan lacks of solving its QP, stage by stage and without units */
    RUMO_COMMAND_ERROR,       /* estimate of what further iterations would change of the command, over its range */
    RUMO_DIAGNOSTIC_COUNT
} rumo_diagnostic;

/* A limit: of which kind, at which stage (1 .. N), of which input or constraint. */
typedef enum rumo_limit { RUMO_INPUT_BOUND, RUMO_MOVE_BOUND, RUMO_PATH_CONSTRAINT } rumo_limit;

typedef struct rumo_conflict {
    rumo_limit kind;
    int stage, index;
} rumo_conflict;

/* What is wrong with a reading: it is held back; it is used, but leaves the prediction; it is used, but stays as it is. */
typedef enum rumo_symptom { RUMO_HEALTHY, RUMO_HELD, RUMO_LEAVING, RUMO_STUCK } rumo_symptom;

/* What a step returns; the arrays belong to the controller and stay until its next call. */
typedef struct rumo_plan {
    const double *numbers; /* u (N, nu), x (N + 1, nx), path constraints as linearised (N, nc), z (N, nz), diagnostics */
    int count;
    rumo_status status, cause;
    int iterations;            /* of the QP solver */
    const rumo_conflict *conflict; /* limits that cannot hold together, if there is no solution; */
    int conflicts;                 /* how many */
    const double *health; /* (nx, 3): of readings with which something is wrong, how far off in deviations, for how many
                             samples, and what it is (rumo_symptom); */
    int symptoms;         /* of how many */
    double prepare_seconds, feedback_seconds;
    double waited_seconds;    /* by the caller: the feedback, and the preparation where no call was made for it before */
    double linearize_seconds; /* of the preparation, until the guess is linearised and its unknowns eliminated; NAN if not */
} rumo_plan;

typedef struct rumo_controller rumo_controller;

/* What can be wrong with a problem. */
typedef enum rumo_error {
    RUMO_FINE,
    RUMO_TOO_SMALL,
    RUMO_TOO_LARGE,
    RUMO_MISSING,
    RUMO_NOT_FINITE,
    RUMO_NOT_POSITIVE,
    RUMO_NEGATIVE,
    RUMO_NO_LIMIT, /* not a number, or infinite on the wrong side */
    RUMO_CROSSED,  /* a lower limit above its upper one */
    RUMO_NO_REST,  /* limits of moves that forbid to stay */
    RUMO_OUT_OF_RANGE,
    RUMO_OUT_OF_ORDER,
    RUMO_ERROR_COUNT
} rumo_error;

/* The first thing that is wrong: which member of which part (of the problem itself: ""), and at what index (of an array). */
typedef struct rumo_fault {
    rumo_error error;
    const char *part, *member;
    int index;
} rumo_fault;

/* The failure policy by itself: what is applied whatever a solver came to. */
typedef struct rumo_guard rumo_guard;

/* What a guard has to say after a step; the arrays belong to it and stay until its next call. */
typedef struct rumo_guard_state {
    int has_guess; /* whether the next solution may start from the plan one sample later, or from a state at rest */
    const double *u, *x, *inner;                /* the plan: (N, nu), (N + 1, nx), (N, unknowns of an interval) */
    const double *next_u, *next_x, *next_inner; /* the same one sample later; NULL without a plan */
} rumo_guard_state;

/* An extended Kalman filter. */
typedef struct rumo_filter rumo_filter;

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

/* A system integrated over time, see integrate/advance.c. */
typedef struct rumo_integrator rumo_integrator;

/* The two tapes of a system as code, which computes as tape.c does: whether all is finite. */
struct guess_lanes;
typedef int rumo_evaluation(const rumo_tape *, const struct guess_lanes *, int lanes, double *registers, double *terms);
typedef struct rumo_right_side {
    int version;
    rumo_evaluation *rates, *jacobian;
} rumo_right_side;

/* How an integration ended. */
typedef enum rumo_ending {
    RUMO_ARRIVED,
    RUMO_NO_VALUE, /* the model, or what it is told, has no finite value where it begins */
    RUMO_NO_ROOT,  /* no algebraic variables were found there */
    RUMO_TOO_SHORT,
    RUMO_TOO_MANY, /* steps */
    RUMO_ENDING_COUNT
} rumo_ending;

/* What an integrator has done since it was made. */
typedef struct rumo_work {
    long long steps, rejected, rates, jacobians, factors, solutions; /* rates: evaluations, of up to three points each */
} rumo_work;

/* A curve in pieces, see curve/pieces.c. Its arrays are the caller's, and only read, by any number of threads. */
typedef struct rumo_curve {
    int pieces, values, order;  /* at least 1 each */
    const double *breaks;       /* (pieces + 1,), increasing */
    const double *coefficients; /* (pieces, values, order), of the highest power first */
    const double *shift;        /* (values,): what a lap of a closed curve adds; NULL of an open one */
} rumo_curve;

/* Everything the core offers; a tailored build exports one such table of its own. */
typedef struct rumo_api {
    int version;
    const char *build; /* instruction set, and whether tailored */
    size_t (*size)(const rumo_problem *);
    rumo_controller *(*create)(const rumo_problem *, const rumo_settings *, void *memory);
    void (*configure)(rumo_controller *, const rumo_settings *);
    /* Other numbers between two samples; arrays that are NULL stay. Where one is wrong, nothing changes. Bounds and limits
     * hold from the next feedback on, all others from the next preparation; plan and guess are kept. */
    rumo_fault (*update)(rumo_controller *, const rumo_numbers *);
    void (*reset)(rumo_controller *);
    /* Guess of a state at rest, with the last input decided. */
    void (*start)(rumo_controller *, const double *x);
    /* Guess of a trajectory of the caller's: states (N + 1, nx), inputs (N, nu). */
    void (*engage)(rumo_controller *, const double *x, const double *u);
    double *(*applied)(rumo_controller *); /* (max(delay, 1), nu), oldest first; may be written to */
    long long *(*counts)(rumo_controller *); /* (RUMO_STATUS_COUNT,) steps by status since the last reset */
    int (*prepared)(const rumo_controller *); /* whether a preparation has been made for the next feedback */
    void (*prepare)(rumo_controller *);
    /* The plan for a measurement x (nx,) and the wanted outputs (N + 1, ny), from now on. */
    void (*feedback)(rumo_controller *, const double *x, const double *reference, rumo_plan *);
    /* Both, with a guess at rest where there is none. */
    void (*step)(rumo_controller *, const double *x, const double *reference, rumo_plan *);
    const double *(*taken)(const rumo_controller *); /* (nx,): the last measurement as it was used: some readings predicted */
    const double *(*begins)(const rumo_controller *); /* (ny,): where what was wanted then began, of angles without jumps of a turn */
    /* Instead of the last step's plan, apply another of the same sample, found elsewhere: inputs (N, nu), states (N + 1, nx)
     * and other unknowns of the intervals (N, ni), all finite, with a status of those that are applicable. It is followed,
     * and the next guess, as if the step had come to it; returns the status counted. */
    rumo_status (*adopt)(rumo_controller *, const double *u, const double *x, const double *inner, rumo_status);
    const char *(*error_text)(rumo_error); /* in words that follow the name of a member */
    /* All that follows is in the portable builds only. Whether a problem is one that create() can be handed, and settings. */
    rumo_fault (*check)(const rumo_problem *);
    rumo_fault (*check_settings)(const rumo_settings *);
    /* A guard by itself, in memory of guard_size bytes; of the settings it looks at the gate's. */
    rumo_fault (*guard_check)(const rumo_guard_data *);
    size_t (*guard_size)(const rumo_guard_data *);
    rumo_guard *(*guard_create)(const rumo_guard_data *, const rumo_settings *, void *memory);
    void (*guard_configure)(rumo_guard *, const rumo_settings *);
    rumo_fault (*guard_update)(rumo_guard *, const rumo_bounds *); /* as update */
    void (*guard_reset)(rumo_guard *);
    double *(*guard_applied)(rumo_guard *);
    long long *(*guard_counts)(rumo_guard *);
    /* The next solution starts from a state at rest, with the inputs u (N, nu); or there is no guess. */
    void (*guard_rest)(rumo_guard *, double *u);
    /* Whether a guess is kept that has been prepared: `straying` is how far it is from the dynamics, over what the inputs can
     * do (0 where that does not matter). */
    int (*guard_keep)(rumo_guard *, double straying);
    void (*guard_drop)(rumo_guard *);
    /* A measurement (nx,) as it is to be used: old readings brought to now, angles next to what is predicted. */
    const double *(*guard_unwound)(rumo_guard *, const double *x);
    /* Whether a measurement and all that is wanted (count,) can be used: OPTIMAL, or why not. `reach` (nx,): how far all
     * inputs can move each state over the next stages, NULL where not known. */
    rumo_status (*guard_admit)(rumo_guard *, const double *x, const double *reference, int count, const double *reach);
    const double *(*guard_taken)(const rumo_guard *); /* that measurement as it is to be used: some readings are predicted */
    const double *(*guard_health)(const rumo_guard *); /* (nx, 3), as in rumo_plan */
    int (*guard_surprised)(const rumo_guard *); /* whether a reading that is used was farther off than is usual */
    /* Apply a candidate (u NULL: none) that came with *cause, else the plan before, else the safe input; returns the status of
     * what is applied. The cause becomes SOLVER_FAILED where a solution is none. */
    rumo_status (*guard_follow)(rumo_guard *, const double *u, const double *x, const double *inner, rumo_status *cause);
    /* Undo what was applied at the last sample, so that another candidate can be followed at the same one. */
    void (*guard_take_back)(rumo_guard *);
    /* How the state after a sample depends on that before it, A (nx, nx) by rows: for the monitor. */
    void (*guard_expect)(rumo_guard *, const double *A);
    void (*guard_state)(const rumo_guard *, rumo_guard_state *);
    /* A QP by itself: memory of qp_size bytes; v (n,), multipliers (n + rows,), conflict (n + rows,).
     * With a working set kept from a former call in the same memory (warm), it starts there. */
    size_t (*qp_size)(int variables, int rows);
    rumo_qp_result (*qp_solve)(const rumo_qp_data *, const rumo_settings *, int warm, void *memory, double *v,
                               double *multipliers, int *conflict);
    /* A filter for a problem of one interval whose outputs are the measurements, and whose last parameter is the share of the
     * sampling time that a step takes. A belief is its state (n,), its covariance as U D U' (n, n), U above the diagonal and D
     * on it, and how often in a row each measurement was refused (m,). */
    rumo_fault (*filter_check)(const rumo_problem *, const rumo_filter_data *);
    size_t (*filter_size)(const rumo_problem *, const rumo_filter_data *);
    rumo_filter *(*filter_create)(const rumo_problem *, const rumo_filter_data *, void *memory);
    void (*filter_covariance)(const rumo_filter *, const double *belief, double *P); /* (n, n) */
    /* From one belief to the next, with input u (nu,), parameters p and measurements y (m,), not finite where there is none; 0 if
     * the model has no finite value there. The report is (3 m + 2,): innovations, their deviations, which are used, the
     * normalised innovation squared of these, and the logarithm of the determinant of their covariance. */
    int (*filter_advance)(rumo_filter *, const double *before, const double *u, const double *p, const double *y,
                          double *after, double *report);
    /* The state x (n,) after a step, in place, with its derivatives A (n, n), outputs y (m,) there and theirs H (m, n) by that
     * state; 0 if the model has no finite value there. */
    int (*filter_linearise)(rumo_filter *, double *x, const double *u, const double *p, double *A, double *y, double *H);
    /* An integrator of a system, in memory of integrator_size bytes. */
    rumo_fault (*system_check)(const rumo_system *);
    size_t (*integrator_size)(const rumo_system *);
    rumo_integrator *(*integrator_create)(const rumo_system *, void *memory);
    void (*integrator_tailor)(rumo_integrator *, const rumo_right_side *); /* code in place of its tapes, from now on */
    void (*integrator_reset)(rumo_integrator *); /* to what it was when it was made, but for the work */
    /* The state x (nx,) after a duration [s], with inputs u (nu,) and parameters p held, into `end` unless it fails. It goes on
     * where it ended: with step, Jacobian and solution of before, which another state makes it forget. Algebraic variables are
     * looked for near where they were last. */
    rumo_ending (*integrator_advance)(rumo_integrator *, const double *x, const double *u, const double *p, double duration,
                                      double *end);
    const double *(*integrator_algebraic)(const rumo_integrator *); /* (nz,): where they were last */
    void (*integrator_seek)(rumo_integrator *, const double *z);    /* look for them near these from now on */
    const rumo_work *(*integrator_work)(const rumo_integrator *);
    /* Values (values, count) of a curve at arguments s (count,), NaN where these are not finite. */
    void (*curve_at)(const rumo_curve *, const double *s, ptrdiff_t count, double *values);
    /* The argument from `low` to `high` where values 0 and 1, to which no lap adds anything, are nearest to x, y; NaN where
     * there is none. It is of the lap in their middle at most. */
    double (*curve_nearest)(const rumo_curve *, double x, double y, double low, double high);
    /* Times (count,) at which places (count,) are reached by a motion of constant accelerations: values 0 to 2 of its curve by
     * time are place, which never falls, speed and acceleration. */
    void (*curve_when)(const rumo_curve *, const double *places, ptrdiff_t count, double *times);
} rumo_api;

#ifdef __cplusplus
}
#endif

#endif
