/* The maps of all stages as rows and as columns of F, G and c; what a row of outputs or constraints is over zeta. */
#ifndef RUMO_HORIZON_C
#define RUMO_HORIZON_C

#include "solve/riccati/riccati.h"
#include "stages/along.c"

/* Entry of zeta that column i of F belongs to. */
static inline int moved_entry(const dims *s, int i) { return i < s->nx ? i : s->rows + i - s->nx; }

/* The parts of stages that do not depend on numbers: what becomes of v. */
RARE static void lay_out_inputs(const dims *s, const layout *p, const rumo_blocking *held, riccati *r) {
    for (int l = 0; l < p->ld; ++l) {
        r->kept[l] = l < (unblocked(s) ? s->rows : p->zeta) ? 1.0 : 0.0;
        r->of_v[l] = unblocked(s) && l >= p->v && l < p->zeta ? 1.0 : 0.0;
    }
    for (int j = 0; j < s->nu; ++j) r->unit[j * p->ld + p->v + j] = 1.0;
    for (int k = s->d; k < s->N; ++k) {
        double *rows = rows_of_stage(r, p, k), *columns = columns_of_stage(r, p, k);
        const int fresh = begins(s, held, k);
        for (int j = 0; j < s->nu; ++j) {
            if (fresh) columns[(p->moving + j) * p->ld + p->v + j] = 1.0;
            if (unblocked(s)) continue;
            /* v follows from G if new, else from v; that before from v if new, else from that before. */
            rows[(p->v + j) * p->ld + (fresh ? p->B : p->v) + j] = 1.0;
            rows[(p->before + j) * p->ld + (fresh ? p->v : p->before) + j] = 1.0;
            if (!fresh) columns[(s->nx + j) * p->ld + p->v + j] = 1.0;
            columns[(s->nx + (fresh ? 0 : s->nu) + j) * p->ld + p->before + j] = 1.0;
        }
    }
}

/* Most groups of entries that a stage can be made of. */
static inline int most_laid(const dims *s, const layout *p) {
    return s->rows * ((p->c + 4) / 4) + s->width * ((s->rows + 3) / 4);
}

/* Where an entry of a map comes from: its lanes in the maps or, if negative, ~ of those in `scaled`, which are zeros where the
 * map has no such entry. */
static int source_of(const dims *s, const stage_maps *m, int row, int column) {
    int of_inputs = 0;
    for (int e = 0; e < m->map.start[row + 1]; ++e) {
        const int input = m->map.column[e] >= s->nx && m->map.column[e] < s->nx + s->nu;
        of_inputs += input;
        if (e >= m->map.start[row] && m->map.column[e] == column) return input ? ~(of_inputs * s->lanes) : e * s->lanes;
    }
    return ~0;
}

/* Unless none of its entries is there. */
static void lay_entries(riccati *r, laid_entries laid) {
    int there = 0;
    for (int i = 0; i < laid.count; ++i) there |= laid.of[i] != ~0;
    if (there) r->laid[r->laid_count++] = laid;
}

/* What stages are made of where inputs are not held, or before the first free one. */
RARE static void place_entries(const dims *s, const layout *p, const stage_maps *m, riccati *r) {
    r->laid_count = 0;
    for (int i = 0; i < s->rows; ++i)
        for (int at = 0; at <= p->c; at += 4) {
            laid_entries laid = {{~0, ~0, ~0, ~0}, 4, i * p->ld + at, {NULL}};
            for (int q = 0; q < 4; ++q) {
                const int column = at + q < s->nx ? at + q : at + q - p->B + s->nx;
                if (at + q < s->nx || (at + q >= p->B && at + q <= p->c)) laid.of[q] = source_of(s, m, i, column);
            }
            lay_entries(r, laid);
        }
    for (int c = 0; c < s->width; ++c)
        for (int i = 0; i < s->rows; i += 4) {
            const int column = c < s->nx ? c : c - s->nx + p->moving, left = s->rows - i;
            laid_entries laid = {{~0, ~0, ~0, ~0}, left < 4 ? left : 4, (p->rows + column) * p->ld + i, {NULL}};
            for (int q = 0; q < laid.count; ++q) laid.of[q] = source_of(s, m, i + q, c);
            lay_entries(r, laid);
        }
}

/* The input of a stage is a mixture of v and of the value before: of new ones and of v, if it begins a block. */
RARE static void mix_inputs(const dims *s, const layout *p, const rumo_blocking *held, int k, double *rows, double *columns) {
    const double share = share_at(s, held, k);
    const int fresh = begins(s, held, k);
    for (int j = 0; j < s->nu; ++j)
        for (int i = 0; i < s->rows; ++i) {
            double *row = rows + i * p->ld, *column = columns + i;
            const double b = row[p->B + j];
            row[p->v + j] = (fresh ? 1.0 - share : share) * b;
            if (!fresh) row[p->before + j] = (1.0 - share) * b;
            row[p->B + j] = fresh ? share * b : 0.0;
            column[(s->nx + j) * p->ld] = row[p->v + j];
            column[(s->nx + s->nu + j) * p->ld] = row[p->before + j];
            column[(p->moving + j) * p->ld] = row[p->B + j];
        }
}

/* From the maps (entries, lanes) to the stages. */
static void lay_stages(riccati *r, const stage_maps *m) {
    const dims s = dims_of(&r->problem->sizes);
    const layout p = layout_of(&s);
    const ptrdiff_t stage = (ptrdiff_t)(p.rows + p.columns) * p.ld;
    double *scaled = r->scaled;
    for (int i = 0; i < s.rows; ++i)
        for (int e = m->end_of_A[i]; e < m->map.start[i + 1] && m->map.column[e] < s.nx + s.nu; ++e) {
            const double scale = r->problem->numbers.input_scales[m->map.column[e] - s.nx];
            scaled += s.lanes;
            for (int k = 0; k < s.lanes; ++k) scaled[k] = scale * m->maps[(ptrdiff_t)e * s.lanes + k];
        }
    laid_entries *const end = r->laid + r->laid_count;
    for (laid_entries *laid = r->laid; laid < end; ++laid)
        for (int i = 0; i < 4; ++i) laid->lanes[i] = laid->of[i] < 0 ? r->scaled + ~laid->of[i] : m->maps + laid->of[i];
    for (int k = 0; k < s.N; k += LANES) {
        double *first = rows_of_stage(r, &p, k);
        for (const laid_entries *laid = r->laid; laid < end; ++laid)
            for (int l = 0; l < LANES; l += 4) turn_fours(laid->lanes, k + l, laid->count, first + l * stage + laid->to, stage);
    }
    for (int k = s.d; !unblocked(&s) && k < s.N; ++k)
        mix_inputs(&s, &p, &r->problem->blocking, k, rows_of_stage(r, &p, k), columns_of_stage(r, &p, k));
}

#endif
