/* One iteration: linearise at the guess, solve for the step, and add it up to a plan. */
#ifndef RUMO_ITERATE_C
#define RUMO_ITERATE_C

#include "base/clock.h"
#include "controller.h"
#include "guard/shift.c"
#include "solve/influence.h"
#include "stages/defects.c"
#include "stages/inner.c"
#include "stages/linearise.c"

/* Steps below this share of the inputs' ranges are rounding. */
#define NO_STEP 1e-12
/* Iterations converge if each step is less than this share of the one before. */
#define CONVERGING 0.5
/* One that is less may be luck. */
#define LEAST_CONTRACTION 0.05
/* What inputs may lose of a step added to a guess, over their ranges, or over the longest step where that is longer. */
#define MOST_LOST 1e-6
/* The most that a state may be multiplied by within an interval. */
#define FASTEST_GROWTH 1e8

/* Linearise about this next. */
static void set_guess(rumo_controller *ctl, const double *u, const double *x, const double *inner) {
    const dims *s = &ctl->s;
    copy(ctl->stages.guess_u, u, s->N * s->nu);
    copy(ctl->stages.guess_x, x, (s->N + 1) * s->nx);
    copy(ctl->stages.guess_inner, inner, s->ni * s->lanes);
}

/* Put the guess somewhere else. */
static void copy_guess(const rumo_controller *ctl, double *u, double *x, double *inner) {
    const dims *s = &ctl->s;
    copy(u, ctl->stages.guess_u, s->N * s->nu);
    copy(x, ctl->stages.guess_x, (s->N + 1) * s->nx);
    copy(inner, ctl->stages.guess_inner, s->ni * s->lanes);
}

/* Set aside what a plan has besides u, x and its unknowns. */
static void keep_rest(const rumo_controller *ctl) { copy(ctl->guess_rest, plan_constraints(ctl), rest_of_plan(&ctl->s)); }

static void guess_plan(rumo_controller *ctl) {
    set_guess(ctl, plan_u(ctl), plan_x(ctl), ctl->inner);
    keep_rest(ctl);
}

/* What the iteration before found is the plan again: it is the guess. */
static void recall_guess(rumo_controller *ctl) {
    copy_guess(ctl, plan_u(ctl), plan_x(ctl), ctl->inner);
    copy(plan_constraints(ctl), ctl->guess_rest, rest_of_plan(&ctl->s));
}

/* A guess of a state at rest, with the last input decided. */
static void start_guess(rumo_controller *ctl, const double *x) {
    const dims *s = &ctl->s;
    stage_maps *m = &ctl->stages;
    for (int k = 0; k <= s->N; ++k) copy(m->guess_x + k * s->nx, x, s->nx);
    rest(&ctl->guard, m->guess_u);
    guess_inner(m, x);
    ctl->still = 1;
    ctl->last_step = NAN;
    ctl->prepared = ctl->has_stored = ctl->behind = 0;
    solver_of(&ctl->problem.sizes)->forget(&ctl->solving);
}

/* A guess of the caller's; what lies within its intervals is on the way from state to state. */
RARE static void engage(rumo_controller *ctl, const double *x, const double *u) {
    stage_maps *m = &ctl->stages;
    const dims *s = &ctl->s;
    start_guess(ctl, x);
    ctl->still = 0;
    copy(m->guess_x, x, (s->N + 1) * s->nx);
    copy(m->guess_u, u, s->N * s->nu);
    for (int i = 0; i < s->ni; ++i) {
        const int signal = ctl->problem.inner_signals[i];
        for (int k = 0; signal < s->nx && k < s->lanes; ++k) {
            const double *begin = x + (k < s->N ? k : s->N - 1) * s->nx;
            m->guess_inner[(ptrdiff_t)i * s->lanes + k] = between(begin, s->nx, signal, ctl->problem.inner_nodes[i]);
        }
    }
}

/* Whether an interval, but the last, multiplies a state by so much that rounding decides what follows. */
static int runs_away(const stage_maps *m) {
    const dims *s = &m->s;
    for (int r = 0; !is_wide(m) && r < s->nx; ++r)
        for (int e = m->map.start[r]; m->reach[r] > 0.0 && e < m->end_of_A[r]; ++e)
            if (m->map.column[e] == r && largest_before_last(m->maps + (ptrdiff_t)e * s->lanes, s->N) > FASTEST_GROWTH) return 1;
    return 0;
}

/* What something amounts to that did not come to an end: it ran out of time, or else what is said. */
static rumo_status out_of_time_or(const rumo_controller *ctl, rumo_status status) {
    return is_over(ctl->end) ? RUMO_BUDGET_EXCEEDED : status;
}

/* Let the solver prepare for the stages as linearised; what it keeps of the sample before is shifted once. OPTIMAL, or why
 * there can be no solution. */
static rumo_status make_ready(rumo_controller *ctl) {
    stage_maps *const m = &ctl->stages;
    if (!solver_of(&ctl->problem.sizes)->prepare(&ctl->solving, m, ctl->behind, ctl->end))
        return out_of_time_or(ctl, RUMO_ILL_CONDITIONED);
    solver_of(&ctl->problem.sizes)->reach(&ctl->solving, ctl->s.N, m->reach);
    if (is_over(ctl->end)) return RUMO_BUDGET_EXCEEDED;
    if (runs_away(m)) return RUMO_ILL_CONDITIONED;
    ctl->behind = 0;
    ctl->straying = straying(m);
    return RUMO_OPTIMAL;
}

/* Linearise about the guess, and make ready. */
static rumo_status linearize(rumo_controller *ctl) {
    const int usable = linearise(&ctl->stages, last_decided(&ctl->guard), ctl->end);
    ctl->linearized_at = seconds_now();
    return usable ? make_ready(ctl) : out_of_time_or(ctl, RUMO_SOLVER_FAILED);
}

/* Copy the algebraic variables into the plan's numbers. */
static void show_algebraic(const rumo_controller *ctl) {
    const dims *s = &ctl->s;
    for (int k = 0; k < s->N; ++k)
        for (int i = 0; i < s->nz; ++i) plan_z(ctl)[k * s->nz + i] = ctl->inner[(ptrdiff_t)i * s->lanes + k];
}

/* A hard constraint is exceeded beyond what the solver was asked for: no input moves it where it was linearised. They are
 * noted, and how many there are is returned. */
RARE static int note_broken(rumo_controller *ctl, double allowed) {
    const rumo_problem *p = &ctl->problem;
    const dims *s = &ctl->s;
    int count = 0;
    for (int i = 0; i < s->N * s->nc; ++i) {
        const int r = i % s->nc;
        if (p->imposed[i] && isinf(p->numbers.l1[r]) &&
            plan_constraints(ctl)[i] > allowed * p->numbers.constraint_scales[r])
            ctl->broken[count++] = (rumo_conflict){RUMO_PATH_CONSTRAINT, i / s->nc + 1, r};
    }
    return count;
}

/* Inputs of guess and step; what free ones lose of the step, over their ranges. */
static double add_up(double *u, const double *guess, const double *du, const double *scales, const dims *s) {
    double lost = 0.0;
    for (int k = 0; k < s->N; ++k)
        for (int i = k * s->nu, j = 0; j < s->nu; ++i, ++j) {
            u[i] = guess[i] + du[i];
            if (k >= s->d) lost = larger(lost, fabs(u[i] - guess[i] - du[i]) / scales[j]);
        }
    return lost;
}

/* Guess and step make the plan; returns the status it deserves. */
static WITHIN rumo_status expand(rumo_controller *ctl, const double *x, rumo_status status, rumo_plan *plan) {
    const rumo_problem *p = &ctl->problem;
    const dims s = dims_of(&p->sizes);
    const stage_maps *m = &ctl->stages;
    const stage_step *step = &ctl->step;
    double *u = plan_u(ctl), *states = plan_x(ctl);
    const double lost = add_up(u, m->guess_u, step->du, p->numbers.input_scales, &s);
    copy(states, x, s.nx);
    int violated = 0, broken = 0, usable = 1;
    for (int k = 0; k < s.N; ++k) {
        const double *dx = step->dx + (ptrdiff_t)(k + 1) * s.ldx;
        for (int r = 0; r < s.nx; ++r) states[(k + 1) * s.nx + r] = m->guess_x[(k + 1) * s.nx + r] + dx[r];
        for (int r = 0; r < s.nc; ++r) {
            const double value = step->constraints[k * s.nc + r];
            const int beyond = value > RUMO_SLACK_TOLERANCE * p->numbers.constraint_scales[r] && p->imposed[k * s.nc + r];
            const int soft = p->numbers.l1[r] < INFINITY;
            violated |= beyond & soft;
            broken |= beyond & !soft;
            usable &= value < INFINITY; /* below an infinite limit it is infinite itself */
        }
    }
    if (s.ni) expand_inner(m, step->dx, step->du, ctl->inner);
    if (s.ni) show_algebraic(ctl);
    if (!usable || !all_finite(ctl->numbers, s.N * s.nu + (s.N + 1) * s.nx)) return RUMO_SOLVER_FAILED;
    if (!all_finite(ctl->inner, s.ni * s.lanes)) return RUMO_SOLVER_FAILED;
    if (lost > MOST_LOST * larger(1.0, step->size)) return RUMO_ILL_CONDITIONED;
    if (status == RUMO_OPTIMAL && broken) {
        /* As exactly as rows are asked to hold, in the units that they have in a solver. */
        plan->conflicts = note_broken(ctl, larger(RUMO_SLACK_TOLERANCE, MOST_INFLUENCE * ctl->settings.qp_tolerance));
        plan->conflict = ctl->broken;
        if (plan->conflicts) return RUMO_SOLVER_FAILED;
    }
    return status == RUMO_OPTIMAL && violated ? RUMO_SOFT_VIOLATED : status;
}

/* What steps add up to that are still to come, if each is less than half the one before; NaN where this one was not. */
static inline double error_left(double before, double size) {
    return size < CONVERGING * before ? larger(size, LEAST_CONTRACTION * before) : NAN;
}

/* How far the iteration has come. */
static void diagnose(rumo_controller *ctl) {
    double *d = plan_diagnostics(ctl);
    const double size = ctl->step.size;
    d[RUMO_INTEGRATOR_RESIDUAL] = ctl->straying;
    d[RUMO_STEP] = size;
    d[RUMO_CONTRACTION] = ctl->last_step > NO_STEP ? size / ctl->last_step : NAN;
    d[RUMO_KKT_RESIDUAL] = ctl->step.kkt_residual;
    d[RUMO_COMMAND_ERROR] = ctl->last_step > NO_STEP ? error_left(ctl->last_step, size) : NAN;
    ctl->last_step = size;
}

/* One step from a prepared guess; SOLVER_FAILED leaves no plan. */
static rumo_status iterate(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan) {
    const budget limits = {ctl->settings.qp_iterations, ctl->settings.qp_tolerance, ctl->end};
    const stage_known known = {x, ctl->guard.applied, reference};
    stage_step *const step = &ctl->step;
    const rumo_status status = solver_of(&ctl->problem.sizes)->solve(&ctl->solving, &ctl->stages, &known, &limits, step);
    plan->iterations += step->iterations;
    plan->conflicts = step->conflicts;
    plan->conflict = step->conflict;
    if (status > RUMO_BUDGET_EXCEEDED) return status;
    diagnose(ctl);
    const rumo_status made = expand(ctl, x, status, plan);
    if (made <= RUMO_BUDGET_EXCEEDED) ctl->proposed = 1;
    return made;
}

static int is_solved(rumo_status status) { return status == RUMO_OPTIMAL || status == RUMO_SOFT_VIOLATED; }

/* Largest change of an input over its range, or of a state over the reach of the inputs, from guess to plan. */
static double change(const rumo_controller *ctl) {
    const dims *s = &ctl->s;
    const double *scales = ctl->problem.numbers.input_scales;
    double largest = 0.0;
    for (int i = 0; i < s->N * s->nu; ++i)
        largest = fmax(largest, fabs(plan_u(ctl)[i] - ctl->stages.guess_u[i]) / scales[i % s->nu]);
    for (int i = 0; i < (s->N + 1) * s->nx; ++i)
        if (ctl->stages.reach[i % s->nx] > 0.0)
            largest = fmax(largest, fabs(plan_x(ctl)[i] - ctl->stages.guess_x[i]) / ctl->stages.reach[i % s->nx]);
    return largest;
}

#endif
