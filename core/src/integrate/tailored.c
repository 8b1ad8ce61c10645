/* The right-hand side of one system as a library: with RUMO_TAILORED and RUMO_EVALUATE, a file in which evaluate_inner() is the
 * tape of its rates, and evaluate() that of its Jacobian. */
#ifndef RUMO_RIGHT_SIDE_TAILORED_C
#define RUMO_RIGHT_SIDE_TAILORED_C

#include "base/system.h"

#include "rumo_core.h"

#include "stages/tape.c"

#if defined(_WIN32) && defined(RUMO_TAILORED)
#define RUMO_EXPORT __declspec(dllexport)
#else
#define RUMO_EXPORT
#endif

extern RUMO_EXPORT const rumo_right_side rumo_right_side_tailored;

RUMO_EXPORT const rumo_right_side rumo_right_side_tailored = {RUMO_CORE_VERSION, evaluate_inner, evaluate};

#endif
