/* Time that only goes forward. */
#ifndef RUMO_CLOCK_H
#define RUMO_CLOCK_H

#include "base/system.h"

#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#undef near /* left over from other times */
#undef far
#endif

static inline double seconds_now(void) {
#ifdef _WIN32
    LARGE_INTEGER count, frequency;
    QueryPerformanceCounter(&count);
    QueryPerformanceFrequency(&frequency);
    return (double)count.QuadPart / (double)frequency.QuadPart;
#else
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
#endif
}

/* Whether a time is over; infinite, it never is, and costs no look at the clock. */
static inline int is_over(double end) { return end < INFINITY && seconds_now() > end; }

#endif
