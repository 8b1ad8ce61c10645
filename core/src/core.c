/* The whole core as one translation unit, so that it can be compiled into a wheel and, with the sizes and the model of
 * one problem as constants (RUMO_TAILORED), for that problem alone.
 *
 *   RUMO_TABLE     name of the exported table of functions
 *   RUMO_BUILD     what it was built for, a string
 *   RUMO_TAILORED  with RUMO_SIZES, the members of rumo_sizes, and RUMO_EVALUATE, a file that defines evaluate() and
 *                  evaluate_inner() of tape.c for one model
 */
#if !defined(_WIN32) && !defined(_POSIX_C_SOURCE)
#define _POSIX_C_SOURCE 200809L
#endif

#include "rumo_core.h"

#include <math.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#undef near /* left over from other times */
#undef far
#endif

static double seconds_now(void) {
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

#include "lanes.h"
#include "elementary.h"
#include "arena.h"
#include "tape.c"
#ifdef RUMO_TAILORED
#include RUMO_EVALUATE
#endif
#include "eliminate.c"
#include "compose.c"
#include "condense.c"
#include "rows.c"
#include "working_set.c"
#include "refinement.c"
#include "qp.c"
#include "controller.h"
#include "inner.c"
#include "policy.c"
#include "set_up.c"
#include "linearize.c"
#include "iterate.c"
#include "step.c"
#ifndef RUMO_TAILORED
#include "program.c"
#else
#define program_size NULL
#define solve_program NULL
#endif

#ifndef RUMO_TABLE
#define RUMO_TABLE rumo_core
#endif
#ifndef RUMO_BUILD
#define RUMO_BUILD "portable"
#endif
#if defined(_WIN32) && defined(RUMO_TAILORED)
#define RUMO_EXPORT __declspec(dllexport)
#else
#define RUMO_EXPORT
#endif

extern RUMO_EXPORT const rumo_api RUMO_TABLE;

RUMO_EXPORT const rumo_api RUMO_TABLE = {
    RUMO_CORE_VERSION, RUMO_BUILD,     controller_size, create_controller, configure, reset_controller,
    start_guess,       set_parameters, applied_inputs,  status_counts,     prepare,   feedback,
    step,              program_size,   solve_program,
};
