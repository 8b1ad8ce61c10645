/* The QP solver by itself, for tests and comparisons: any dense program. */

typedef struct program {
    qp q;
    double *hessian, *factor, *inverse, *transpose, *rows, *gradient;
    int *imposed;
} program;

static void lay_out_program(arena *a, program *p, int n, int rows) {
    take_qp(a, &p->q, n, 0, rows, 0);
    const ptrdiff_t square = (ptrdiff_t)n * p->q.ld;
    p->hessian = take_doubles(a, square);
    p->factor = take_doubles(a, square);
    p->inverse = take_doubles(a, square);
    p->transpose = take_doubles(a, square);
    p->rows = take_doubles(a, (ptrdiff_t)rows * p->q.ld);
    p->gradient = take_doubles(a, p->q.ld);
    p->imposed = take_ints(a, rows);
    p->q.hessian = p->hessian;
    p->q.inverse = p->inverse;
    p->q.transpose = p->transpose;
    p->q.matrix = p->rows;
}

static size_t program_size(int variables, int rows) {
    program p;
    arena a = {NULL, 0};
    (void)take(&a, sizeof p);
    lay_out_program(&a, &p, variables, rows);
    return a.used + ALIGNMENT;
}

static rumo_qp_result solve_program(const rumo_qp_data *data, const rumo_settings *settings, int warm, void *memory,
                                    double *v, double *multipliers, int *conflict) {
    const int n = data->variables, m = data->rows;
    rumo_qp_result result = {RUMO_SOLVER_FAILED, 0, 0, 0.0, 0.0};
    arena a = {aligned(memory), 0};
    program *p;
    if (warm) {
        p = (program *)(void *)a.base;
    } else {
        p = (program *)take(&a, sizeof *p);
        lay_out_program(&a, p, n, m);
        clear_members(&p->q);
    }
    qp *q = &p->q;
    for (int i = 0; i < n; ++i) copy(p->hessian + (ptrdiff_t)i * q->ld, data->hessian + (ptrdiff_t)i * n, n);
    for (int i = 0; i < m; ++i) {
        double *row = p->rows + (ptrdiff_t)i * q->ld;
        copy(row, data->matrix + (ptrdiff_t)i * n, n);
        const double norm = sqrt(dot(row, row, q->ld));
        p->imposed[i] = 1;
        q->weight[q->dense + i] = norm > 0.0 ? 1.0 / norm : 1.0;
        q->extent[i] = q->ld;
    }
    copy(q->lower, data->lower, n);
    copy(q->upper, data->upper, n);
    copy(q->lower + q->dense, data->row_lower, m);
    copy(q->upper + q->dense, data->row_upper, m);
    copy(q->l1 + q->dense, data->l1, m);
    copy(q->l2 + q->dense, data->l2, m);
    copy(p->gradient, data->gradient, n);
    const qp_limits limits = {settings->qp_iterations, settings->qp_tolerance, settings->qp_seconds};
    double start = seconds_now();
    const int definite = factorize(n, q->ld, p->hessian, p->factor, p->inverse, p->transpose);
    result.factor_seconds = seconds_now() - start;
    if (!definite) return result;
    start = seconds_now();
    renew_members(q, 0, 0, p->imposed);
    watch_members(q);
    result.status = solve_qp(q, p->gradient, &limits);
    result.seconds = seconds_now() - start;
    result.iterations = q->iterations;
    result.conflicts = q->conflicts;
    copy(v, q->v, n);
    for (int i = 0; i < n + m; ++i) multipliers[i] = q->state[i] == SATURATED ? q->l1[i] : 0.0;
    for (int i = 0; i < q->count; ++i) multipliers[q->member[i]] = q->mu[i];
    memcpy(conflict, q->conflict, (size_t)q->conflicts * sizeof *conflict);
    return result;
}
