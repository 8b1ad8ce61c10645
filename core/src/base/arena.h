/* One allocation, dealt out in pieces. Run once without memory, the same calls measure what is needed. */
#ifndef RUMO_ARENA_H
#define RUMO_ARENA_H

#include "base/system.h"

#define ALIGNMENT 64

typedef struct arena {
    unsigned char *base; /* NULL: measure only */
    size_t used;
} arena;

static inline void *alloc(arena *a, size_t bytes) {
    void *piece = a->base ? a->base + a->used : NULL;
    a->used += (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    if (piece) memset(piece, 0, bytes);
    return piece;
}

static inline double *alloc_doubles(arena *a, ptrdiff_t count) {
    return (double *)alloc(a, (size_t)count * sizeof(double));
}

static inline int *alloc_ints(arena *a, ptrdiff_t count) { return (int *)alloc(a, (size_t)count * sizeof(int)); }

static inline double *copy_doubles(arena *a, const double *from, ptrdiff_t count) {
    double *to = alloc_doubles(a, count);
    if (to && count > 0) memcpy(to, from, (size_t)count * sizeof(double));
    return to;
}

static inline int *copy_ints(arena *a, const int *from, ptrdiff_t count) {
    int *to = alloc_ints(a, count);
    if (to && count > 0) memcpy(to, from, (size_t)count * sizeof(int));
    return to;
}

static inline unsigned char *aligned(void *memory) {
    const uintptr_t address = (uintptr_t)memory;
    return (unsigned char *)memory + (ALIGNMENT - address % ALIGNMENT) % ALIGNMENT;
}

#endif
