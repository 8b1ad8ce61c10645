/* Whether iterations have settled or have to end, and what every one of them does. */
#ifndef RUMO_SETTLED_C
#define RUMO_SETTLED_C

#include "guard/stray.c"
#include "iterate.c"

/* Settled: what is left of the inputs' changes over their ranges or, where that is not known, the last change. */
#define SETTLED 0.01
#define SETTLED_STEP 1e-3
/* The share of what a step promises that it has to hold. */
#define SHARE_HELD 0.1

/* A plan that costs so many times what the guess does is worse. */
#define WORSE 1.01

/* Whether steps are taken as they come, and not judged. */
static inline int is_plain(const rumo_controller *ctl) { return isinf(ctl->settings.trusted_step); }

/* Whether no further iteration is needed, this one's step being full, and the one before `before` long, NaN if that is not
 * known. */
static inline int is_settled(const rumo_controller *ctl, int iterations, double before) {
    const double size = ctl->step.size;
    if (iterations < ctl->settings.sqp_iterations && !(change(ctl) < ctl->settings.sqp_tolerance)) return 0;
    if (!(ctl->straying < STRAYED)) return 0;
    if (iterations == 1 && ctl->wary) return 0;
    if (iterations == 1 && size <= ctl->settings.trusted_step) return 1;
    if (iterations > 1 && !(change(ctl) < STRAYED)) return 0; /* states may go on where all inputs are at bounds */
    return size <= SETTLED_STEP || error_left(before, size) <= SETTLED;
}

/* Whether there is to be no other, however things are. */
static int is_last(const rumo_controller *ctl, int iterations) {
    const rumo_settings *set = &ctl->settings;
    return (iterations >= set->sqp_iterations && iterations > set->settling_iterations) || is_over(ctl->end);
}

/* Set the guess aside, or take one up that was. */
static void keep(const rumo_controller *ctl, const kept_guess *kept) { copy_guess(ctl, kept->u, kept->x, kept->inner); }

static void take_up(rumo_controller *ctl, const kept_guess *kept) { set_guess(ctl, kept->u, kept->x, kept->inner); }

/* An iteration after the first of a sample. */
static rumo_status iterate_again(rumo_controller *ctl, const double *x, const double *reference, rumo_plan *plan) {
    const rumo_status status = iterate(ctl, x, reference, plan);
    if (is_solved(status)) ctl->moved_later = larger(ctl->moved_later, ctl->step.size);
    return status;
}

#endif
