/* From the maps of an interval's substeps to its own: dx_i = A dx_{i-1} + B du_{i-1} + c. */
#ifndef RUMO_COMPOSE_C
#define RUMO_COMPOSE_C

#include "rumo_core.h"

#include "base/lanes.h"
#include "stages/tape.c"

/* The same in code, in a tailored build, if there is not too much of it; 0 if nothing was done. */
#ifndef RUMO_TAILORED
#define compose_in_code(result, before, after) 0
#endif

/* One substep more: from the map of those before (entries, lanes) and its own result to `after`. */
static void compose(const rumo_composition *recipe, const double *restrict result, const double *restrict before, int lanes,
                    double *restrict after) {
    const int *product = recipe->product;
    if (compose_in_code(result, before, after)) return;
    for (int e = 0; e < recipe->entries; ++e) {
        for (int k = 0; k < lanes; k += LANES) {
            double sum[LANES] = {0.0};
            if (recipe->own[e] >= 0) copy(sum, result + (ptrdiff_t)recipe->own[e] * lanes + k, LANES);
            for (int i = 0; i < recipe->products[e]; ++i) {
                const double *restrict a = result + (ptrdiff_t)product[2 * i] * lanes + k;
                const double *restrict b = before + (ptrdiff_t)product[2 * i + 1] * lanes + k;
                for (int l = 0; l < LANES; ++l) sum[l] += a[l] * b[l];
            }
            copy(after + (ptrdiff_t)e * lanes + k, sum, LANES);
        }
        product += 2 * recipe->products[e];
    }
}

/* The first substep alone. */
static void start_composition(const rumo_composition *recipe, const double *restrict result, int lanes,
                              double *restrict map) {
    for (int e = 0; e < recipe->entries; ++e) {
        if (recipe->start[e] >= 0) copy(map + (ptrdiff_t)e * lanes, result + (ptrdiff_t)recipe->start[e] * lanes, lanes);
        else zero(map + (ptrdiff_t)e * lanes, lanes);
    }
}

#endif
