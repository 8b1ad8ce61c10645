/* Bytes of a fuzzer as choices and numbers; behind their end, all are zero. */
#ifndef RUMO_STREAM_H
#define RUMO_STREAM_H

#include <limits.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

typedef struct stream {
    const uint8_t *next;
    size_t left;
} stream;

/* What must hold, whatever the bytes. */
#define REQUIRE(condition)                                                    \
    do {                                                                      \
        if (!(condition)) {                                                   \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);   \
            abort();                                                          \
        }                                                                     \
    } while (0)

static inline void take(stream *s, void *to, size_t size) {
    const size_t known = size < s->left ? size : s->left;
    memset(to, 0, size);
    if (known) memcpy(to, s->next, known);
    s->next += known;
    s->left -= known;
}

static inline int take_below(stream *s, int count) {
    uint8_t bytes[2] = {0};
    take(s, bytes, count > 256 ? 2 : 1);
    return (bytes[0] + 256 * bytes[1]) % count;
}

/* Near the number that was there, at an end of the range, or any. */
static inline int take_int(stream *s, int was) {
    static const int ends[] = {0, 1, -1, 2, 1 << 16, (1 << 20) - 1, 1 << 20, INT_MAX, INT_MAX - 1, INT_MIN, INT_MAX / 2 + 1};
    int any;
    switch (take_below(s, 4)) {
    case 0: return (int)((unsigned)was + 1u + (unsigned)take_below(s, 8));
    case 1: return (int)((unsigned)was - 1u - (unsigned)take_below(s, 8));
    case 2: return ends[take_below(s, (int)(sizeof ends / sizeof *ends))];
    default: take(s, &any, sizeof any); return any;
    }
}

static inline double take_double(stream *s, double was) {
    static const double wild[] = {0.0,   -0.0,   1.0,    -1.0,  1e-308, 5e-324, 1e308, -1e308, 1e160,
                                  1e-160, 1e20,  -1e20,  1e9,   1e-9,   NAN,    (double)INFINITY, -(double)INFINITY};
    double any;
    switch (take_below(s, 4)) {
    case 0: return was * (1 + take_below(s, 16));
    case 1: return (take_below(s, 256) - 128) / 16.0;
    case 2: return wild[take_below(s, (int)(sizeof wild / sizeof *wild))];
    default: take(s, &any, sizeof any); return any;
    }
}

#endif
