/* Rows of a quadratic program and their states.
 *
 *   min v'Hv/2 + g'v + sum_i l1_i s_i + l2_i s_i^2    lower_i <= a_i'v <= upper_i + s_i,  s >= 0
 *
 * A row with infinite l1 is hard. Slacks are no variables: a multiplier between 0 and l1 holds a soft row at its
 * limit, one above l1 lets it give way by (multiplier - l1) / (2 l2), and with l2 = 0 it stays at l1.
 */
#ifndef RUMO_ROWS_C
#define RUMO_ROWS_C

#include "rumo_core.h"

#include "base/arena.h"
#include "base/clock.h"
#include "base/lanes.h"

typedef enum row_state {
    INACTIVE,
    AT_LOWER,  /* multiplier <= 0 */
    AT_UPPER,  /* 0 <= multiplier <= l1 */
    GIVING,    /* soft, multiplier >= l1, l2 > 0 */
    SATURATED, /* soft, multiplier = l1, l2 = 0: not in the working set */
    IGNORED    /* no variable moves it: neither watched nor in the working set */
} row_state;

struct qp;

/* What the method must know of a program: how w = U v, with U'U = H, in which the cost is w'w / 2 but for linear terms, hangs
 * together with variables and rows. A program is a struct whose first member is its qp. */
typedef struct qp_space {
    void (*start)(struct qp *);    /* w of the minimum with the prices of saturated rows, and no members */
    void (*evaluate)(struct qp *); /* v, and the values of all rows, at w */
    /* The same at w + step; returns the largest change of v. */
    double (*correct)(struct qp *, const double *step);
    /* m = U'^-1 a of the row at a position of the working set, its extent, and its value at w = 0; 0 if no variable moves it. */
    int (*transform)(struct qp *, int position);
    /* U'^-1 times the slope of the Lagrangian; returns the largest slope, relative to the forces that are balanced there (along
     * the same input, over the horizon) or to what it takes to move a variable by a millionth. */
    double (*slope)(struct qp *, double *rest);
    /* Sum of |entries| of a combination of members, as a row over v, and its value at v = 0. */
    double (*size_of)(struct qp *, const double *parts, int members, double *at_zero);
    /* Of working sets with more members than there is room to keep m and L for, NULL where there always is. M has the rows m of
     * the first `members` positions. */
    double (*condition)(struct qp *, int members, int *weakest); /* factor M M' + E in any order; the least pivot's share */
    void (*solve)(struct qp *, int members, double *x);          /* of that (M M' + E) x = x */
    void (*combine)(struct qp *, const double *parts, int members, double *sum);    /* M' parts */
    void (*project)(struct qp *, const double *w, int members, double *components); /* M w */
} qp_space;

typedef struct qp {
    const qp_space *space;
    int n, ld;             /* variables; length of w, padded */
    int rows, first_soft;  /* all rows; from where on they may be soft */
    int places;            /* for rows, padded */
    int capacity;          /* of the working set */
    int room, stride;      /* members whose m and L can be kept; of L */
    int kept;              /* whether they are */
    int stale;             /* else, whether members have changed since they were factored */
    int evaluated;         /* whether values are those at w */
    double *lower, *upper, *l1, *l2, *weight; /* (rows,): weight is 1 / norm, */
    double *norm;                             /* of those that were members */
    double *floor, *ceiling, *value;          /* (rows,): limits that are still to be watched, and a'v */
    double *forces;                           /* (rows,): multipliers, see gather_forces */
    int *state, saturated;                    /* (rows,): row_state; how many are saturated */
    int count;             /* members of the working set */
    int *member, *place;   /* row of each; where its m lies */
    double *mu, *moved, *L, *D;
    double *base;          /* by place: the row's value at w = 0, */
    int *extent;           /* and from where on its m is zero, padded */
    double *square;        /* (rows,): m'm of those that were members */
    int pending;           /* 1 while the row at position `count` waits to join */
    int settled;           /* members at the front that are where their multipliers want them, but for rounding */
    int delicate;          /* whether rows nearly depend on each other, and rounding matters */
    double *w;             /* minimiser, as U v */
    double span;           /* sum of the curvatures along the variables */
    double *direction, *trial, *spare, *parts; /* scratch: of multipliers, */
    double *shift, *residual, *sum;            /* and of variables */
    int *conflict, conflicts, *scratch;
    double fine;           /* residual of the optimality conditions that needs no refinement */
    double stretch;        /* how far a unit of w moves a variable, without the feedback that it may be given */
    double tolerance;      /* of a row, in units of v */
    double kkt_residual, last_step; /* of the solution; how far refinement moved it: see refinement.c */
    int iterations;
    double end;            /* of the time there is, by the clock */
} qp;

/* Members whose m and L are kept where they can do without. */
#ifndef RUMO_KEPT_MEMBERS
#define RUMO_KEPT_MEMBERS 128
#endif

/* Room for n variables and for rows, of which those from `first_soft` on may be soft. */
RARE static void alloc_qp(arena *a, qp *q, const qp_space *space, int n, int rows, int first_soft) {
    q->space = space;
    q->n = n;
    q->ld = padded(n);
    q->rows = rows;
    q->first_soft = first_soft;
    q->capacity = n + rows - first_soft + 1; /* only rows that give way can be more than n; one may be pending */
    q->room = space->condition && q->capacity > RUMO_KEPT_MEMBERS ? RUMO_KEPT_MEMBERS : q->capacity;
    q->stride = padded(q->room);
    q->kept = 1;
    q->places = padded(rows);
    double **const per_row[] = {&q->lower,  &q->upper,  &q->l1,    &q->l2,   &q->weight,
                                &q->norm,   &q->square, &q->floor, &q->ceiling, &q->value, &q->forces};
    for (size_t i = 0; i < sizeof per_row / sizeof *per_row; ++i) *per_row[i] = alloc_doubles(a, q->places);
    q->state = alloc_ints(a, q->places);
    q->member = alloc_ints(a, q->capacity);
    q->place = alloc_ints(a, q->capacity);
    q->conflict = alloc_ints(a, q->capacity);
    q->scratch = alloc_ints(a, q->capacity);
    q->base = alloc_doubles(a, q->room);
    q->extent = alloc_ints(a, q->room);
    q->moved = alloc_doubles(a, (ptrdiff_t)q->room * q->ld);
    q->L = alloc_doubles(a, (ptrdiff_t)q->room * q->stride);
    double **const per_member[] = {&q->mu, &q->D, &q->direction, &q->trial, &q->spare, &q->parts};
    for (size_t i = 0; i < sizeof per_member / sizeof *per_member; ++i)
        *per_member[i] = alloc_doubles(a, padded(q->capacity));
    double **const per_variable[] = {&q->w, &q->shift, &q->residual, &q->sum};
    for (size_t i = 0; i < sizeof per_variable / sizeof *per_variable; ++i) *per_variable[i] = alloc_doubles(a, q->ld);
}

/* Where a member's m and base lie; of those that are not kept, only the last one found. */
static inline int place_of(const qp *q, int position) { return q->kept ? q->place[position] : 0; }

static inline double *moved(const qp *q, int position) { return q->moved + (ptrdiff_t)place_of(q, position) * q->ld; }

static inline int extent_of(const qp *q, int position) { return q->extent[place_of(q, position)]; }

/* The value of a member at w, where all rows have been evaluated if m is not kept. */
static inline double member_value(const qp *q, int position) {
    if (!q->kept) return q->value[q->member[position]];
    return dot(moved(q, position), q->w, extent_of(q, position)) + q->base[q->place[position]];
}

static void watch(qp *q, int row, row_state state) {
    q->saturated += (state == SATURATED) - (q->state[row] == SATURATED);
    q->state[row] = (int)state;
    q->floor[row] = state == INACTIVE ? q->lower[row] : state == SATURATED ? q->upper[row] : -INFINITY;
    q->ceiling[row] = state == INACTIVE ? q->upper[row] : INFINITY;
}

static inline double compliance(const qp *q, int row) { return q->state[row] == GIVING ? 0.5 / q->l2[row] : 0.0; }

/* How far a member's value would move, in units of v, if its multiplier changed by so much and no other did. */
static inline double pull(const qp *q, int position, double change) {
    const int row = q->member[position];
    return fabs(change) * (q->square[row] + compliance(q, row)) * q->weight[row];
}

/* Multipliers of all rows: prices of saturated ones, and those of the members, if they count. */
static void gather_forces(qp *q, int members) {
    double *restrict forces = q->forces;
    zero(forces, q->rows);
    for (int i = 0; members && i < q->count; ++i) forces[q->member[i]] = q->mu[i];
    for (int r = q->first_soft, left = q->saturated; left > 0 && r < q->rows; ++r)
        if (q->state[r] == SATURATED) {
            forces[r] = q->l1[r];
            --left;
        }
}

/* How far a value of a member is from where its state and multiplier want it. */
static inline double deviation(const qp *q, int position, double value) {
    const int row = q->member[position];
    switch ((row_state)q->state[row]) {
    case AT_LOWER: return value - q->lower[row];
    case GIVING: return value - q->upper[row] - (q->mu[position] - q->l1[row]) * 0.5 / q->l2[row];
    default: return value - q->upper[row];
    }
}

#endif
