/* From the maps of an interval's substeps to its own: dx_i = A dx_{i-1} + B du_{i-1} + c. */
#ifndef RUMO_COMPOSE_C
#define RUMO_COMPOSE_C

#include "rumo_core.h"

#include "base/lanes.h"

/* One substep more: from the map of those before (entries, lanes) and its own result to `after`. */
static void compose(const rumo_composition *recipe, const double *restrict result, const double *restrict before, int lanes,
                    double *restrict after) {
    const int *product = recipe->product;
    for (int e = 0; e < recipe->entries; ++e) {
        double *restrict sum = after + (ptrdiff_t)e * lanes;
        if (recipe->own[e] >= 0) copy(sum, result + (ptrdiff_t)recipe->own[e] * lanes, lanes);
        else zero(sum, lanes);
        for (int i = 0; i < recipe->products[e]; ++i, product += 2) {
            const double *restrict a = result + (ptrdiff_t)product[0] * lanes;
            const double *restrict b = before + (ptrdiff_t)product[1] * lanes;
            for (int k = 0; k < lanes; k += LANES)
                for (int l = 0; l < LANES; ++l) sum[k + l] += a[k + l] * b[k + l];
        }
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
