/* One allocation, dealt out in pieces. Run once without memory, the same calls measure what is needed. */
#ifndef RUMO_ARENA_H
#define RUMO_ARENA_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define ALIGNMENT 64

typedef struct arena {
    unsigned char *base; /* NULL: measure only */
    size_t used;
} arena;

static inline void *take(arena *a, size_t bytes) {
    void *piece = a->base ? a->base + a->used : NULL;
    a->used += (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    if (piece) memset(piece, 0, bytes);
    return piece;
}

static inline double *take_doubles(arena *a, ptrdiff_t count) { return (double *)take(a, (size_t)count * sizeof(double)); }

static inline int *take_ints(arena *a, ptrdiff_t count) { return (int *)take(a, (size_t)count * sizeof(int)); }

static inline double *keep_doubles(arena *a, const double *from, ptrdiff_t count) {
    double *to = take_doubles(a, count);
    if (to && count > 0) memcpy(to, from, (size_t)count * sizeof(double));
    return to;
}

static inline int *keep_ints(arena *a, const int *from, ptrdiff_t count) {
    int *to = take_ints(a, count);
    if (to && count > 0) memcpy(to, from, (size_t)count * sizeof(int));
    return to;
}

static inline unsigned char *aligned(void *memory) {
    const uintptr_t address = (uintptr_t)memory;
    return (unsigned char *)memory + (ALIGNMENT - address % ALIGNMENT) % ALIGNMENT;
}

#endif
