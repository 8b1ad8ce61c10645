/* From the maps of an interval's substeps to its own: dx_i = A dx_{i-1} + B du_{i-1} + c. */

/* One substep more: from the map of those before (entries, lanes) and its own result to `after`. */
static void compose(const rumo_composition *plan, const double *restrict result, const double *restrict before, int lanes,
                    double *restrict after) {
    const int *product = plan->product;
    for (int e = 0; e < plan->entries; ++e) {
        double *restrict sum = after + (ptrdiff_t)e * lanes;
        if (plan->own[e] >= 0) copy(sum, result + (ptrdiff_t)plan->own[e] * lanes, lanes);
        else zero(sum, lanes);
        for (int i = 0; i < plan->products[e]; ++i, product += 2) {
            const double *restrict a = result + (ptrdiff_t)product[0] * lanes;
            const double *restrict b = before + (ptrdiff_t)product[1] * lanes;
            for (int k = 0; k < lanes; k += LANES)
                for (int l = 0; l < LANES; ++l) sum[k + l] += a[k + l] * b[k + l];
        }
    }
}

/* The first substep alone. */
static void start_composition(const rumo_composition *plan, const double *restrict result, int lanes,
                              double *restrict map) {
    for (int e = 0; e < plan->entries; ++e) {
        if (plan->start[e] >= 0) copy(map + (ptrdiff_t)e * lanes, result + (ptrdiff_t)plan->start[e] * lanes, lanes);
        else zero(map + (ptrdiff_t)e * lanes, lanes);
    }
}
