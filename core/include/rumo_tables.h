/* The structs that describe a problem, as tables: their members, what the core copies and checks, what its binding reads and
 * what Python writes all follow from these lines.
 *
 *   COUNT(name, least)                  an int, and the least it may be
 *   REAL(name)                          a double, not negative; it may be infinite
 *   INTS(name, rows, columns)           an array, row by row
 *   DOUBLES(name, rows, columns, rule)  an array, and what its numbers must be (see rumo_rule)
 *   STRUCT(type, name)                  the members of another table
 *
 * Rows and columns are in terms of the sizes s and of members t of the same struct that come before.
 */
#ifndef RUMO_TABLES_H
#define RUMO_TABLES_H

#define RUMO_SIZES_TABLE(COUNT)                                                                             \
    COUNT(horizon, 1)                                                                                       \
    COUNT(states, 1)                                                                                        \
    COUNT(algebraic, 0)                                                                                     \
    COUNT(inputs, 1)                                                                                        \
    COUNT(outputs, 0)                                                                                       \
    COUNT(constraints, 0)                                                                                   \
    COUNT(parameters, 0)                                                                                    \
    COUNT(delay, 0)                                                                                         \
    COUNT(inner, 0)           /* unknowns of a substep besides states and algebraic variables at its end */ \
    COUNT(substeps, 1)        /* of an interval */                                                          \
    COUNT(explicit_scheme, 0) /* the end of a substep follows from its beginning: no other unknowns */      \
    COUNT(blocks, 0)          /* of intervals with one free input each: N - delay where each has its own */ \
    COUNT(condensing, 0)      /* whether states are condensed, else kept: see solve/solver.h */             \
    COUNT(slots, 0)

/* Unknowns of a substep, and of an interval but its state at the end. */
#define RUMO_UNKNOWNS (s->states + s->algebraic + s->inner)
#define RUMO_INNER (s->explicit_scheme ? 0 : s->substeps * RUMO_UNKNOWNS - s->states)

#define RUMO_SETTINGS_TABLE(COUNT, REAL)                                                              \
    COUNT(sqp_iterations, 1)                                                                          \
    COUNT(preparation_iterations, 0) /* on the predicted state, before the measurement is known */    \
    REAL(sqp_tolerance)                                                                               \
    COUNT(settling_iterations, 0)    /* where the first step is not to be trusted */                  \
    REAL(trusted_step)               /* of an input over its range; infinite: steps are not judged */ \
    COUNT(qp_iterations, 0)          /* changes of the working set per QP */                          \
    REAL(qp_tolerance)               /* of a row, in units of the inputs' ranges */                   \
    REAL(seconds)                    /* time for a step, or a QP by itself; infinite for any */       \
    REAL(gate_width)                 /* of the innovation gate; infinite for none */                  \
    COUNT(gate_patience, 0)          /* consistent implausible samples before they are believed */

/* A straight-line program that computes the terms of one substep from its arguments: 0 the state at its end, 1 the one
 * at its beginning, 2 inputs, 3 parameters, 4 its other unknowns (algebraic variables at the end, then inner ones). */
#define RUMO_TAPE_TABLE(COUNT, INTS, DOUBLES, STRUCT)      \
    COUNT(length, 0)                                       \
    COUNT(registers, 0)                                    \
    INTS(code, t->length, 4) /* operation, result, a, b */ \
    DOUBLES(constants, t->length, 1, RUMO_FREE)

/* A sparse matrix sorted by rows, then by columns; entry e is term first + e of a stage. */
#define RUMO_PATTERN_TABLE(COUNT, INTS, DOUBLES, STRUCT) \
    COUNT(count, 0)                                      \
    COUNT(first, 0)                                      \
    INTS(row, t->count, 1)                               \
    INTS(column, t->count, 1)

/* How the unknowns w of a substep are solved for, M dw = A0 dx + B du + defect, block by block of M in triangular order.
 *
 * A block's work is a dense matrix (size, size + width + 1): its part of M, then those columns of (A0, B, defect) that
 * reach it, then the unit of the row. Rows and columns are in an order whose pivots, on the diagonal, are expected to be
 * large; what is not zero when a pivot's turn comes, in its column below it and in its row right of it, is listed. Or, where
 * a block is solved by sparse factors, its work is those columns (size, width) alone, then the entries of rumo_factor, and
 * nothing is listed. The result [A | B | c] is sparse, entry by entry; column nx + nu is c. Without blocks and entries there
 * is no result: the equations themselves are solved, as rumo_factor says. */
#define RUMO_ELIMINATION_TABLE(COUNT, INTS, DOUBLES, STRUCT)                                               \
    COUNT(blocks, 0)                                                                                       \
    COUNT(entries, 0)                                                                                      \
    INTS(size, t->blocks, 1)                                                                               \
    INTS(width, t->blocks, 1)                                                                              \
    INTS(sparse, t->blocks, 1) /* whether by sparse factors */                                             \
    INTS(loads, t->blocks, 1)  /* how many entries of the three lists below are a block's */               \
    INTS(updates, t->blocks, 1)                                                                            \
    INTS(stores, t->blocks, 1)                                                                             \
    INTS(below, RUMO_UNKNOWNS, 1)  /* how many entries of the next two lists are a pivot's */              \
    INTS(across, RUMO_UNKNOWNS, 1)                                                                         \
    INTS(lower, rumo_sum(t->below, RUMO_UNKNOWNS), 1)          /* rows of the block */                     \
    INTS(upper, rumo_sum(t->across, RUMO_UNKNOWNS), 1)         /* columns of the work */                   \
    INTS(load, rumo_sum(t->loads, t->blocks), 2)               /* slot, place in the work */               \
    INTS(update, rumo_sum(t->updates, t->blocks), 3)           /* slot of M, entry of the result, place */ \
    INTS(store, rumo_sum(t->stores, t->blocks), 2)             /* place, entry of the result */            \
    INTS(row, t->entries, 1)                                   /* of the result, sorted by rows */         \
    INTS(column, t->entries, 1)

/* How M is factored without pivoting: a sparse LU of each block, for models of many unknowns; none (0 unknowns) where that
 * does not pay.
 *
 * Pivot q is where equation[q] and unknown[q] meet; each of its block's rows in `later` has an entry below it, and one right
 * of it. Nonzeros of M are given by their slot and by the pivots in whose row and column they are: those outside of the
 * blocks by rows, then those inside. Entries of the factors are counted block by block: pivots, those below them, those
 * right of them; counted from the beginning of the block, `target` is where rows and columns of `later` meet. */
#define RUMO_FACTOR_TABLE(COUNT, INTS, DOUBLES, STRUCT)                                           \
    COUNT(unknowns, 0)                                                                            \
    COUNT(blocks, 0)                                                                              \
    COUNT(outer, 0)                                                                               \
    COUNT(inner, 0)                                                                               \
    INTS(size, t->blocks, 1)                                                                      \
    INTS(equation, t->unknowns, 1)                                                                \
    INTS(unknown, t->unknowns, 1)                                                                 \
    INTS(below, t->unknowns, 1)                                  /* entries below a pivot */      \
    INTS(later, rumo_sum(t->below, t->unknowns), 1)              /* counted within the block */   \
    INTS(target, rumo_sum_of_squares(t->below, t->unknowns), 1)                                   \
    INTS(nonzero, t->outer + t->inner, 3)                        /* slot, row, column */          \
    INTS(entry, t->inner, 1)                                     /* of the factors, of all blocks */

/* How the maps of substeps become that of their interval; no entries where there is but one.
 *
 * Entry e of the interval's map [A | B | c], of states and algebraic variables at its end, is the substep's entry own[e]
 * (-1: none) in its columns of B and c, plus the sum over `products[e]` pairs of the substep's entry and the entry of
 * the map so far. The map starts with the substep's entry start[e] at the same place (-1: none). */
#define RUMO_COMPOSITION_TABLE(COUNT, INTS, DOUBLES, STRUCT) \
    COUNT(entries, 0)                                        \
    INTS(row, t->entries, 1)                                 \
    INTS(column, t->entries, 1)                              \
    INTS(start, t->entries, 1)                               \
    INTS(own, t->entries, 1)                                 \
    INTS(products, t->entries, 1)                            \
    INTS(product, rumo_sum(t->products, t->entries), 2)

/* Where the intervals of the next sample's horizon lie on this one's. */
#define RUMO_SHIFT_TABLE(COUNT, INTS, DOUBLES, STRUCT)                                                                  \
    COUNT(same_rows, 0)                            /* all lie one interval later, constraints as well */                \
    INTS(stages, s->horizon + 1, 1)                /* the stage before, */                                              \
    DOUBLES(shares, s->horizon + 1, 1, RUMO_FINITE) /* and how far towards the next, as a share; beyond 1 at the end */ \
    INTS(intervals, s->horizon, 1)                 /* in whose time the middle lies */

/* Inputs held over several intervals: that of interval k is share times its block's value, and the rest of the value of
 * the block before, which is the last input decided for the first block. */
#define RUMO_BLOCKING_TABLE(COUNT, INTS, DOUBLES, STRUCT) \
    INTS(block, s->horizon, 1)                            \
    DOUBLES(share, s->horizon, 1, RUMO_FINITE)            \
    DOUBLES(part, s->horizon, 1, RUMO_FINITE) /* of an interval's input in the value that stands for its block */

/* What holds for the inputs whatever happens. */
#define RUMO_BOUNDS_TABLE(COUNT, INTS, DOUBLES, STRUCT)                           \
    DOUBLES(input_lower, s->horizon, s->inputs, RUMO_LOWER)                       \
    DOUBLES(input_upper, s->horizon, s->inputs, RUMO_UPPER)                       \
    DOUBLES(move_lower, s->inputs, 1, RUMO_LOWER) /* from interval to interval */ \
    DOUBLES(move_upper, s->inputs, 1, RUMO_UPPER)                                 \
    DOUBLES(safe_input, s->inputs, 1, RUMO_FINITE)

/* All that may change between two samples. Infinite limits and infinite l1 (a hard row) are allowed. */
#define RUMO_NUMBERS_TABLE(COUNT, INTS, DOUBLES, STRUCT)                                      \
    DOUBLES(output_weights, s->horizon, s->outputs, RUMO_NOT_NEGATIVE)                        \
    DOUBLES(move_weights, s->blocks, s->inputs, RUMO_POSITIVE)                                \
    DOUBLES(input_scales, s->inputs, 1, RUMO_POSITIVE)                                        \
    STRUCT(rumo_bounds, bounds)                                                               \
    DOUBLES(block_lower, s->blocks, s->inputs, RUMO_LOWER) /* of moves from block to block */ \
    DOUBLES(block_upper, s->blocks, s->inputs, RUMO_UPPER)                                    \
    DOUBLES(constraint_limits, s->horizon, s->constraints, RUMO_UPPER) /* G <= limit */       \
    DOUBLES(constraint_scales, s->constraints, 1, RUMO_POSITIVE)                              \
    DOUBLES(l1, s->constraints, 1, RUMO_PRICE)                                                \
    DOUBLES(l2, s->constraints, 1, RUMO_NOT_NEGATIVE)                                         \
    DOUBLES(parameter_values, s->horizon, s->parameters, RUMO_FINITE)

/* What is known of the measurement of each state. */
#define RUMO_SENSORS_TABLE(COUNT, INTS, DOUBLES, STRUCT)                                              \
    DOUBLES(turn, s->states, 1, RUMO_NOT_NEGATIVE)  /* that is no difference, of an angle; 0 of others */ \
    DOUBLES(noise, s->states, 1, RUMO_NOT_NEGATIVE) /* standard deviation; 0 where not known */           \
    DOUBLES(resolution, s->states, 1, RUMO_NOT_NEGATIVE)                                                  \
    INTS(age, s->states, 1)                         /* samples since it was read; 0 .. horizon */         \
    DOUBLES(lead, s->states, 1, RUMO_FINITE)        /* error of the scheme's prediction, over h^2 x'' */      \
    DOUBLES(lowest, s->states, 1, RUMO_LOWER)       /* readings that there are */                         \
    DOUBLES(highest, s->states, 1, RUMO_UPPER)

/* The problem in raw units. */
#define RUMO_PROBLEM_TABLE(COUNT, INTS, DOUBLES, STRUCT)                                                           \
    STRUCT(rumo_sizes, sizes)                                                                                      \
    STRUCT(rumo_tape, tape)           /* of the last substep, */                                                   \
    STRUCT(rumo_tape, inner_tape)     /* and of those before, without y, G, Cx .. E */                             \
    DOUBLES(fixed, s->slots, 1, RUMO_FREE) /* terms that are constant; NaN where a tape computes */                \
    STRUCT(rumo_pattern, A0)          /* of a stage, by (x, z) at the end: Cx, D */                                \
    STRUCT(rumo_pattern, M)                                                                                        \
    STRUCT(rumo_pattern, B)                                                                                        \
    STRUCT(rumo_pattern, Cx)                                                                                       \
    STRUCT(rumo_pattern, Cu)                                                                                       \
    STRUCT(rumo_pattern, D)                                                                                        \
    STRUCT(rumo_pattern, E)                                                                                        \
    COUNT(y_first, 0)                 /* first terms of the vectors; all terms: y, G, defect, A0, M, B, Cx .. E */ \
    COUNT(G_first, 0)                                                                                              \
    COUNT(defect_first, 0)                                                                                         \
    STRUCT(rumo_elimination, elimination)                                                                          \
    STRUCT(rumo_factor, factor)                                                                                    \
    STRUCT(rumo_composition, composition)                                                                          \
    STRUCT(rumo_shift, shift)                                                                                      \
    STRUCT(rumo_blocking, blocking)                                                                                \
    INTS(inner_signals, RUMO_INNER, 1) /* unknowns of an interval but its state: as a position in (x, z), */       \
    DOUBLES(inner_nodes, RUMO_INNER, 1, RUMO_FINITE) /* and the share of the interval at which they lie */         \
    DOUBLES(algebraic_guess, s->algebraic, 1, RUMO_FINITE)                                                         \
    INTS(imposed, s->horizon, s->constraints)                                                                      \
    STRUCT(rumo_sensors, sensors)                                                                                  \
    INTS(output_states, s->outputs, 1) /* the angle that an output is, -1 for others */                            \
    STRUCT(rumo_numbers, numbers)

/* What a guard must know of a problem. */
#define RUMO_GUARD_TABLE(COUNT, INTS, DOUBLES, STRUCT) \
    STRUCT(rumo_sizes, sizes)                          \
    STRUCT(rumo_shift, shift)                          \
    INTS(inner_signals, RUMO_INNER, 1)                 \
    DOUBLES(inner_nodes, RUMO_INNER, 1, RUMO_FINITE)   \
    STRUCT(rumo_sensors, sensors)                      \
    STRUCT(rumo_bounds, bounds)

/* What a filter is told of its states and of its measurements, which are the outputs of its problem: variances. */
#define RUMO_FILTER_TABLE(COUNT, INTS, DOUBLES, STRUCT)                                                    \
    DOUBLES(noise, s->outputs, 1, RUMO_POSITIVE)                                                           \
    DOUBLES(process, s->states, 1, RUMO_NOT_NEGATIVE) /* of what the model misses in one sample */         \
    DOUBLES(floor, s->states, 1, RUMO_NOT_NEGATIVE)   /* below which none is predicted */                  \
    DOUBLES(turns, s->outputs, 1, RUMO_NOT_NEGATIVE)  /* that is no difference, of an angle; 0 of others */ \
    DOUBLES(width, 1, 1, RUMO_PRICE)                  /* of the gate, in deviations; infinite for none */  \
    COUNT(patience, 0)                                /* refusals in a row until a measurement is believed */

/* A system in semi-explicit form, xdot = f(x, z, u, p) and 0 = g(x, z, u, p), that is integrated over time.
 *
 * Tapes have the arguments of a substep: states for 1, inputs, parameters, algebraic variables for 4. Slots are (f, g), then
 * the nonzeros of its Jacobian J by (x, z), the diagonal of the states among them. The factors are those of a matrix whose
 * nonzeros are J's; of no unknowns where it is to be a dense one. */
#define RUMO_SYSTEM_TABLE(COUNT, INTS, DOUBLES, STRUCT)                                                   \
    STRUCT(rumo_sizes, sizes)                                                                             \
    STRUCT(rumo_tape, rates)    /* f and g, */                                                            \
    STRUCT(rumo_tape, jacobian) /* and these with J */                                                    \
    DOUBLES(fixed, s->slots, 1, RUMO_FREE) /* terms that are constant; NaN where a tape computes */       \
    STRUCT(rumo_pattern, J)                                                                               \
    STRUCT(rumo_factor, factor)                                                                           \
    DOUBLES(scales, s->states + s->algebraic, 1, RUMO_POSITIVE) /* below which a variable matters less */ \
    DOUBLES(algebraic_guess, s->algebraic, 1, RUMO_FINITE)                                                \
    DOUBLES(tolerance, 1, 1, RUMO_POSITIVE) /* relative, and absolute in units of the scales */           \
    COUNT(fixed_steps, 0)                   /* how many equal ones; 0 of an adaptive method */

/* All tables that consist of these kinds of members, in an order in which each comes after those it is made of. */
#define RUMO_TABLES(TABLE)                          \
    TABLE(rumo_tape, RUMO_TAPE_TABLE)               \
    TABLE(rumo_pattern, RUMO_PATTERN_TABLE)         \
    TABLE(rumo_elimination, RUMO_ELIMINATION_TABLE) \
    TABLE(rumo_factor, RUMO_FACTOR_TABLE)           \
    TABLE(rumo_composition, RUMO_COMPOSITION_TABLE) \
    TABLE(rumo_shift, RUMO_SHIFT_TABLE)             \
    TABLE(rumo_blocking, RUMO_BLOCKING_TABLE)       \
    TABLE(rumo_sensors, RUMO_SENSORS_TABLE)         \
    TABLE(rumo_bounds, RUMO_BOUNDS_TABLE)           \
    TABLE(rumo_numbers, RUMO_NUMBERS_TABLE)         \
    TABLE(rumo_problem, RUMO_PROBLEM_TABLE)         \
    TABLE(rumo_guard_data, RUMO_GUARD_TABLE)        \
    TABLE(rumo_filter_data, RUMO_FILTER_TABLE)      \
    TABLE(rumo_system, RUMO_SYSTEM_TABLE)

/* What the numbers of an array must be. */
typedef enum rumo_rule {
    RUMO_FREE, /* anything */
    RUMO_FINITE,
    RUMO_POSITIVE,     /* and finite */
    RUMO_NOT_NEGATIVE, /* and finite */
    RUMO_PRICE,        /* not negative; it may be infinite */
    RUMO_LOWER,        /* a lower limit: infinite only below, not above the upper one that follows it */
    RUMO_UPPER         /* an upper limit: infinite only above */
} rumo_rule;

/* The most entries of an array, so that no index overflows; a length that cannot be is longer. */
enum { RUMO_LONGEST = 1 << 26, RUMO_NO_LENGTH };

static inline int rumo_sum(const int *counts, int length) {
    int sum = 0;
    for (int i = 0; i < length; ++i) {
        if (counts[i] < 0 || counts[i] > RUMO_LONGEST - sum) return RUMO_NO_LENGTH;
        sum += counts[i];
    }
    return sum;
}

static inline int rumo_sum_of_squares(const int *counts, int length) {
    int sum = 0;
    for (int i = 0; i < length; ++i) {
        if (counts[i] < 0 || counts[i] > 1 << 13 || counts[i] * counts[i] > RUMO_LONGEST - sum) return RUMO_NO_LENGTH;
        sum += counts[i] * counts[i];
    }
    return sum;
}

/* The structs themselves. */
#define RUMO_MEMBER_COUNT(name, least) int name;
#define RUMO_MEMBER_REAL(name) double name;
#define RUMO_MEMBER_INTS(name, rows, columns) const int *name;
#define RUMO_MEMBER_DOUBLES(name, rows, columns, rule) const double *name;
#define RUMO_MEMBER_STRUCT(type, name) type name;
#define RUMO_DEFINE(type, table) \
    typedef struct type { table(RUMO_MEMBER_COUNT, RUMO_MEMBER_INTS, RUMO_MEMBER_DOUBLES, RUMO_MEMBER_STRUCT) } type;

typedef struct rumo_sizes { RUMO_SIZES_TABLE(RUMO_MEMBER_COUNT) } rumo_sizes;
typedef struct rumo_settings { RUMO_SETTINGS_TABLE(RUMO_MEMBER_COUNT, RUMO_MEMBER_REAL) } rumo_settings;
RUMO_TABLES(RUMO_DEFINE)

#endif
