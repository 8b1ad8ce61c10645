/* The real-time iteration of acados in a loop in C, with the clock of Rumo's own loop around its phases.

   acados is known by the addresses of its functions, as acados' interface to Python knows it: this file is compiled
   without acados. Every loop over a sample's data counts, the shift of the guess included; what acados returns beside
   the command is not read before the next sample needs it. */
#include "base/clock.h"

typedef struct {
    int horizon, states, inputs, outputs; /* N; those of the model, nx, nu, ny */
    int memory, told;                     /* inputs decided: those in acados' state, those told at each sample */
    int guess;                            /* how the integrator is told where to begin: see below */
    double sampling_time;
    void *config, *dims, *in, *out, *solver, *options, *capsule;
    int (*solve)(void *capsule);
    void (*set_all)(void *solver, void *in, void *out, const char *field, void *value);
    void (*get_all)(void *solver, void *in, void *out, const char *field, void *value);
    void (*set_guess)(void *solver, int stage, const char *field, void *value);
    void (*set_option)(void *config, void *options, const char *field, void *value);
    int (*set_cost)(void *config, void *dims, void *in, int stage, const char *field, void *value);
    int (*set_limits)(void *config, void *dims, void *in, void *out, int stage, const char *field, void *value);
    void (*get)(void *solver, const char *field, void *value);
    void (*get_at)(void *config, void *dims, void *out, int stage, const char *field, void *value);
} acados;

enum { NO_GUESS, SLOPES, END_STATES };

/* x (N + 1, states + memory * inputs) and u (N, inputs), and room for what is derived of them. */
typedef struct {
    double *x, *u, *derived, *yref, *initial;
} work;

/* All a sample later: the last input is kept, the last state goes on as it did. */
static void shift(const acados *a, double *x, double *u) {
    const int N = a->horizon, nx = a->states, nu = a->inputs, nz = nx + a->memory * nu;
    memmove(u, u + nu, (size_t)((N - 1) * nu) * sizeof *u);
    memmove(x, x + nz, (size_t)(N * nz) * sizeof *x);
    double *last = x + N * nz;
    const double *before = last - nz, *earlier = before - nz;
    for (int i = 0; i < nx; ++i) last[i] = 2.0 * before[i] - earlier[i];
    memcpy(last + nx, before + nx + nu, (size_t)((a->memory - 1) * nu) * sizeof *x);
    memcpy(last + nz - nu, u + (N - 1) * nu, (size_t)nu * sizeof *x);
}

static void tell_guess(const acados *a, work *w) {
    const int N = a->horizon, nx = a->states, nz = nx + a->memory * a->inputs;
    a->set_all(a->solver, a->in, a->out, "x", w->x);
    a->set_all(a->solver, a->in, a->out, "u", w->u);
    if (a->guess == SLOPES) {
        for (int k = 0; k < N; ++k) {
            for (int i = 0; i < nz; ++i)
                w->derived[i] = (w->x[(k + 1) * nz + i] - w->x[k * nz + i]) / a->sampling_time;
            a->set_guess(a->solver, k, "xdot_guess", w->derived);
        }
    } else if (a->guess == END_STATES) { /* parameters of the stages; the last is not used */
        for (int k = 0; k <= N; ++k)
            memcpy(w->derived + k * nx, w->x + (k < N ? k + 1 : N) * nz, (size_t)nx * sizeof(double));
        a->set_all(a->solver, a->in, a->out, "p", w->derived);
    }
}

/* No output is tracked at the first stage; the moves in yref stay zero. */
static void tell_reference(const acados *a, work *w, const double *reference, const double *offset) {
    for (int k = 1; k <= a->horizon; ++k) {
        for (int r = 0; r < a->outputs; ++r) w->yref[r] = reference[k * a->outputs + r] - offset[r];
        a->set_cost(a->config, a->dims, a->in, k, "yref", w->yref);
    }
}

static int phase(const acados *a, int number) {
    a->set_option(a->config, a->options, "rti_phase", &number);
    return a->solve(a->capsule);
}

/* A QP that reached its iteration limit is no failure to acados: it stands in the table of iterations, a row for each. */
static int qp_status(const acados *a) {
    const double *table = NULL;
    int row = 0, columns = 0;
    a->get(a->solver, "stat", &table);
    a->get(a->solver, "stat_n", &columns);
    a->get(a->solver, "nlp_iter", &row);
    return (int)table[row * columns];
}

/* What a recorded drive told: x (count, states), reference (count, N + 1, outputs), applied (count, told, inputs) in units
   of the inputs' ranges; offset (outputs) of outputs that are affine. guess and decided are where it begins and are
   overwritten. Gives times (count, 2) of preparation and feedback [s], commands (count, inputs), statuses (count). */
void replay(const acados *a, int count, const double *x, const double *reference, const double *applied,
            const double *offset, double *guess_x, double *guess_u, double *decided, double *room, double *times,
            double *commands, int *statuses) {
    const int N = a->horizon, nx = a->states, nu = a->inputs, ny = a->outputs, nz = nx + a->memory * nu;
    work w = {guess_x, guess_u, room, room + (N + 1) * nz, room + (N + 1) * nz + ny + nu};
    memset(w.yref, 0, (size_t)(ny + nu) * sizeof(double));
    for (int i = 0; i < count; ++i) {
        memcpy(decided + (a->memory - a->told) * nu, applied + i * a->told * nu, (size_t)(a->told * nu) * sizeof(double));

        const double start = seconds_now();
        if (i > 0) {
            a->get_all(a->solver, a->in, a->out, "x", w.x);
            a->get_all(a->solver, a->in, a->out, "u", w.u);
            shift(a, w.x, w.u);
        }
        tell_guess(a, &w);
        tell_reference(a, &w, reference + i * (N + 1) * ny, offset);
        phase(a, 1);
        const double middle = seconds_now();
        memcpy(w.initial, x + i * nx, (size_t)nx * sizeof(double));
        memcpy(w.initial + nx, decided, (size_t)(a->memory * nu) * sizeof(double));
        a->set_limits(a->config, a->dims, a->in, a->out, 0, "lbx", w.initial);
        a->set_limits(a->config, a->dims, a->in, a->out, 0, "ubx", w.initial);
        statuses[i] = phase(a, 2);
        a->get_at(a->config, a->dims, a->out, 0, "u", commands + i * nu);
        const double end = seconds_now();

        times[2 * i] = middle - start;
        times[2 * i + 1] = end - middle;
        if (statuses[i] == 0) statuses[i] = qp_status(a);
        memmove(decided, decided + nu, (size_t)((a->memory - 1) * nu) * sizeof(double));
        memcpy(decided + (a->memory - 1) * nu, commands + i * nu, (size_t)nu * sizeof(double));
    }
}
