/* Copies of a problem's arrays, member by member as the tables say. */
#ifndef RUMO_COPIES_C
#define RUMO_COPIES_C

#include "base/system.h"

#include "rumo_core.h"

#include "base/arena.h"
#include "base/lanes.h"

/* A struct is copied whole, then its arrays; lengths are those of the original: a measuring arena has no copies. */
#define KEEP_COUNT(name, least)
#define KEEP_INTS(name, rows, columns) to->name = copy_ints(a, t->name, (ptrdiff_t)(rows) * (columns));
#define KEEP_DOUBLES(name, rows, columns, rule) to->name = copy_doubles(a, t->name, (ptrdiff_t)(rows) * (columns));
#define KEEP_STRUCT(type, name) copy_##type(a, &to->name, &t->name, s);
#define KEEP(type, table)                                                                           \
    RARELY static inline void copy_##type(arena *a, type *to, const type *t, const rumo_sizes *s) { \
        (void)a;                                                                                    \
        (void)s;                                                                                    \
        *to = *t;                                                                                   \
        table(KEEP_COUNT, KEEP_INTS, KEEP_DOUBLES, KEEP_STRUCT)                                     \
    }

RARELY static inline void copy_rumo_sizes(arena *a, rumo_sizes *to, const rumo_sizes *t, const rumo_sizes *s) {
    (void)a;
    (void)s;
    *to = *t;
}

RUMO_TABLES(KEEP)

/* Of what is given, and of the rest as it is: arrays that are NULL stay. */
#define MERGE_COUNT(name, least)
#define MERGE_INTS(name, rows, columns)
#define MERGE_DOUBLES(name, rows, columns, rule) to->name = given->name ? given->name : t->name;
#define MERGE_STRUCT(type, name) merge_##type(&to->name, &given->name, &t->name, s);
#define MERGE(type, table)                                                                                    \
    RARELY static inline void merge_##type(type *to, const type *given, const type *t, const rumo_sizes *s) { \
        (void)s;                                                                                              \
        table(MERGE_COUNT, MERGE_INTS, MERGE_DOUBLES, MERGE_STRUCT)                                           \
    }

/* Numbers into arrays that are the core's own. */
#define ASSIGN_DOUBLES(name, rows, columns, rule) \
    if (to->name != t->name) memcpy((double *)to->name, t->name, (size_t)((rows) * (columns)) * sizeof(double));
#define ASSIGN_STRUCT(type, name) assign_##type(&to->name, &t->name, s);
#define ASSIGN(type, table)                                                                 \
    RARELY static inline void assign_##type(type *to, const type *t, const rumo_sizes *s) { \
        table(MERGE_COUNT, MERGE_INTS, ASSIGN_DOUBLES, ASSIGN_STRUCT)                       \
    }

MERGE(rumo_bounds, RUMO_BOUNDS_TABLE)
MERGE(rumo_numbers, RUMO_NUMBERS_TABLE)
ASSIGN(rumo_bounds, RUMO_BOUNDS_TABLE)
ASSIGN(rumo_numbers, RUMO_NUMBERS_TABLE)

#endif
