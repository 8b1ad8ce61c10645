/* Sparse matrices of the stages, by rows. */
#ifndef RUMO_SPARSE_H
#define RUMO_SPARSE_H

#include "base/system.h"

#include "rumo_core.h"

#include "base/arena.h"

/* A sparse matrix of a stage: entries start[r] .. start[r + 1] of row r, entry e being term first + e of the stage. */
typedef struct sparse {
    int first;
    const int *start, *column;
} sparse;

static inline sparse rows_of(arena *a, const rumo_pattern *pattern, int rows) {
    int *start = alloc_ints(a, rows + 1);
    if (start)
        for (int e = 0; e < pattern->count; ++e) ++start[pattern->row[e] + 1];
    if (start)
        for (int r = 0; r < rows; ++r) start[r + 1] += start[r];
    return (sparse){pattern->first, start, copy_ints(a, pattern->column, pattern->count)};
}

#endif
