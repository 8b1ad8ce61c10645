/* Whether arrays are what the tables say: given, and their numbers as the rules want them. */
#ifndef RUMO_RULES_C
#define RUMO_RULES_C

#include "base/system.h"

#include "rumo_core.h"

#include "base/lanes.h"

static const rumo_fault no_fault = {RUMO_FINE, "", "", 0};

/* What is wrong, in words that follow the name of a member. */
static const char *error_text(rumo_error error) {
    static const char texts[RUMO_ERROR_COUNT][64] = {
        "is fine",
        "is too small",
        "is too large",
        "is missing",
        "is not a finite number",
        "is not positive",
        "is negative",
        "is no limit: not a number, or infinite on the wrong side",
        "is above the upper limit",
        "does not allow to stay where one is",
        "is out of range",
        "comes out of order",
    };
    return error >= RUMO_FINE && error < RUMO_ERROR_COUNT ? texts[error] : "is wrong";
}

/* The smallest number whose reciprocal is one. */
static const double SMALLEST = 0x1p-1022;

RARE static rumo_error broken_rule(rumo_rule rule, double x) {
    if (rule == RUMO_FREE) return RUMO_FINE;
    if (rule == RUMO_LOWER) return x < INFINITY ? RUMO_FINE : RUMO_NO_LIMIT;
    if (rule == RUMO_UPPER) return x > -INFINITY ? RUMO_FINE : RUMO_NO_LIMIT;
    if (!isfinite(x) && !(rule == RUMO_PRICE && x > 0.0)) return RUMO_NOT_FINITE;
    if (rule == RUMO_POSITIVE && x <= 0.0) return RUMO_NOT_POSITIVE;
    if (rule == RUMO_POSITIVE && x < SMALLEST) return RUMO_TOO_SMALL;
    return rule != RUMO_FINITE && x < 0.0 ? RUMO_NEGATIVE : RUMO_FINE;
}

RARE static rumo_fault check_given(const char *part, const char *member, const void *x, long long count) {
    if (count > RUMO_LONGEST) return (rumo_fault){RUMO_TOO_LARGE, part, member, -1};
    return count > 0 && !x ? (rumo_fault){RUMO_MISSING, part, member, -1} : no_fault;
}

RARE static rumo_fault check_doubles(const char *part, const char *member, const double *x, long long count,
                                     rumo_rule rule) {
    const rumo_fault fault = check_given(part, member, x, count);
    if (fault.error) return fault;
    for (int i = 0; i < count; ++i) {
        const rumo_error error = broken_rule(rule, x[i]);
        if (error) return (rumo_fault){error, part, member, i};
    }
    return no_fault;
}

/* The first fault that is found is the one told. */
#define RULE_COUNT(name, least) \
    if (!fault.error && t->name < least) fault = (rumo_fault){RUMO_TOO_SMALL, part, #name, -1};
#define RULE_LENGTH(name, least) \
    RULE_COUNT(name, least)      \
    if (!fault.error && t->name > RUMO_LONGEST) fault = (rumo_fault){RUMO_TOO_LARGE, part, #name, -1};
#define RULE_REAL(name) \
    if (!fault.error && !(t->name >= 0.0)) fault = (rumo_fault){RUMO_NEGATIVE, part, #name, -1};
#define RULE_INTS(name, rows, columns) \
    if (!fault.error) fault = check_given(part, #name, t->name, (long long)(rows) * (columns));
#define RULE_DOUBLES(name, rows, columns, rule) \
    if (!fault.error) fault = check_doubles(part, #name, t->name, (long long)(rows) * (columns), rule);
#define RULE_STRUCT(type, name) \
    if (!fault.error) fault = check_##type(#name, &t->name, s);
#define RULES(type, table)                                                                         \
    RARELY static inline rumo_fault check_##type(const char *part, const type *t, const rumo_sizes *s) { \
        rumo_fault fault = no_fault;                                                               \
        (void)s;                                                                                   \
        table(RULE_LENGTH, RULE_INTS, RULE_DOUBLES, RULE_STRUCT) return fault;                      \
    }

RARELY static inline rumo_fault check_rumo_sizes(const char *part, const rumo_sizes *t, const rumo_sizes *s) {
    rumo_fault fault = no_fault;
    (void)s;
    RUMO_SIZES_TABLE(RULE_LENGTH)
    if (fault.error) return fault;
    /* Whatever has a number for each stage or substep can be counted. */
    const long long unknowns = (long long)t->states + t->algebraic + t->inner,
                    signals = unknowns + t->inputs + t->outputs + t->constraints + t->parameters + 1;
    if (unknowns * t->substeps > RUMO_LONGEST) return (rumo_fault){RUMO_TOO_LARGE, part, "substeps", -1};
    if (signals * (t->horizon + 1) > RUMO_LONGEST) return (rumo_fault){RUMO_TOO_LARGE, part, "horizon", -1};
    if (t->delay >= t->horizon) return (rumo_fault){RUMO_TOO_LARGE, part, "delay", -1};
    if (t->blocks > t->horizon - t->delay) return (rumo_fault){RUMO_TOO_LARGE, part, "blocks", -1};
    return no_fault;
}

RARE static rumo_fault check_settings(const rumo_settings *t) {
    const char *const part = "settings";
    rumo_fault fault = no_fault;
    RUMO_SETTINGS_TABLE(RULE_COUNT, RULE_REAL)
    return fault;
}

RUMO_TABLES(RULES)

/* Two numbers up to this size have a difference. */
static const double FARTHEST = 0x1p1022;

/* Lower limits (count,) against upper ones; those of moves must allow none. */
RARE static rumo_fault check_limits(const char *member, const double *lower, const double *upper, int count,
                                    int moves) {
    for (int i = 0; i < count; ++i) {
        if (lower[i] > upper[i]) return (rumo_fault){RUMO_CROSSED, "", member, i};
        if ((isfinite(lower[i]) && fabs(lower[i]) > FARTHEST) || (isfinite(upper[i]) && fabs(upper[i]) > FARTHEST))
            return (rumo_fault){RUMO_TOO_LARGE, "", member, i};
        if (moves && !(lower[i] <= 0.0 && upper[i] >= 0.0)) return (rumo_fault){RUMO_NO_REST, "", member, i};
    }
    return no_fault;
}

RARE static rumo_fault check_bounds(const rumo_bounds *b, const rumo_sizes *s) {
    rumo_fault fault = check_rumo_bounds("", b, s);
    if (!fault.error) fault = check_limits("input_lower", b->input_lower, b->input_upper, s->horizon * s->inputs, 0);
    if (!fault.error) fault = check_limits("move_lower", b->move_lower, b->move_upper, s->inputs, 1);
    return fault;
}

#endif
