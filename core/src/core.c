/* The whole core as one translation unit, so that it can be compiled into a wheel and, with the sizes and the model of
 * one problem as constants (RUMO_TAILORED), for that problem alone.
 *
 *   RUMO_TABLE     name of the exported table of functions
 *   RUMO_BUILD     what it was built for, a string
 *   RUMO_TAILORED  with RUMO_SIZES, the members of rumo_sizes, and RUMO_EVALUATE, a file that defines evaluate() and
 *                  evaluate_inner() of tape.c for one model
 */
#include "base/system.h"

#include "rumo_core.h"

#include "set_up.c"
#include "step.c"
#ifndef RUMO_TAILORED
#include "solve/active_set/program.c"
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
