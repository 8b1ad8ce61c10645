/* The whole core as one translation unit, so that it can be compiled into a wheel and, with the sizes and the model of
 * one problem as constants (RUMO_TAILORED), for that problem alone.
 *
 *   RUMO_TABLE     name of the exported table of functions
 *   RUMO_BUILD     what it was built for, a string
 *   RUMO_SOLVER    file that defines another stage solver, see solve/stage_solver.h
 *   RUMO_TAILORED  with RUMO_SIZES, the members of rumo_sizes, and RUMO_EVALUATE, a file that defines evaluate() and
 *                  evaluate_inner() of tape.c, eliminate_in_order() of eliminate.c and compose_in_code() of compose.c for
 *                  one model; RUMO_SPARSE and RUMO_WIDE, see base/dims.h
 */
#include "base/system.h"

#include "rumo_core.h"

#include "set_up.c"
#include "step.c"
#ifndef RUMO_TAILORED
#include "check.c"
#include "curve/nearest.c"
#include "curve/when.c"
#include "estimate/filter.c"
#include "guard/alone.c"
#include "integrate/advance.c"
#include "solve/active_set/program.c"
#else /* what a build for one problem has no use for: the portable one has it */
#define check_problem NULL
#define program_size NULL
#define solve_program NULL
#define check_guard_data NULL
#define guard_size NULL
#define create_guard NULL
#define update_guard NULL
#define guard_applied NULL
#define guard_counts NULL
#define admit NULL
#define unwind NULL
#define taken NULL
#define health NULL
#define is_surprised NULL
#define expect NULL
#define drop_guess NULL
#define follow_candidate NULL
#define guard_state NULL
#define check_filter NULL
#define filter_size NULL
#define create_filter NULL
#define filter_covariance NULL
#define filter_advance NULL
#define filter_linearise NULL
#define check_system NULL
#define integrator_size NULL
#define create_integrator NULL
#define tailor_integrator NULL
#define reset_integrator NULL
#define advance_integrator NULL
#define algebraic_variables NULL
#define seek_algebraic NULL
#define integrator_work NULL
#define curve_at NULL
#define curve_nearest NULL
#define curve_when NULL
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
    RUMO_CORE_VERSION,
    RUMO_BUILD,
    controller_size,
    create_controller,
    configure,
    update_numbers,
    reset_controller,
    start_guess,
    engage,
    applied_inputs,
    status_counts,
    is_prepared,
    prepare,
    feedback,
    step,
    taken_measurement,
    wanted_beginnings,
    adopt,
    error_text,
    check_problem,
    check_settings,
    check_guard_data,
    guard_size,
    create_guard,
    configure_guard,
    update_guard,
    reset_guard,
    guard_applied,
    guard_counts,
    rest,
    keep_guess,
    drop_guess,
    unwind,
    admit,
    taken,
    health,
    is_surprised,
    follow_candidate,
    take_back,
    expect,
    guard_state,
    program_size,
    solve_program,
    check_filter,
    filter_size,
    create_filter,
    filter_covariance,
    filter_advance,
    filter_linearise,
    check_system,
    integrator_size,
    create_integrator,
    tailor_integrator,
    reset_integrator,
    advance_integrator,
    algebraic_variables,
    seek_algebraic,
    integrator_work,
    curve_at,
    curve_nearest,
    curve_when,
};
