/* One allocation, dealt out in pieces. Run once without memory, the same calls measure what is needed. */
#ifndef RUMO_ARENA_H
#define RUMO_ARENA_H

#include "base/system.h"

#define ALIGNMENT 64

/* Under the address sanitizer no piece may be left by its ends: it knows nothing of pieces, but of a gap after each. */
#if defined(__SANITIZE_ADDRESS__)
#define RUMO_GAPS 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define RUMO_GAPS 1
#endif
#endif
#ifdef RUMO_GAPS
void __asan_poison_memory_region(void const volatile *, size_t);
void __asan_unpoison_memory_region(void const volatile *, size_t);
#define GAP ALIGNMENT
#else
#define GAP 0
#define __asan_poison_memory_region(piece, size) (void)(piece)
#define __asan_unpoison_memory_region(piece, size) (void)(piece)
#endif

typedef struct arena {
    unsigned char *base; /* NULL: measure only */
    size_t used;
} arena;

static inline void *alloc(arena *a, size_t bytes) {
    void *piece = a->base ? a->base + a->used : NULL;
    const size_t size = (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT + GAP;
    a->used += size;
    if (piece && GAP) __asan_unpoison_memory_region(piece, bytes); /* it may have been a gap of others before */
    if (piece) memset(piece, 0, bytes);
    if (piece && GAP) __asan_poison_memory_region((unsigned char *)piece + bytes, size - bytes);
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
