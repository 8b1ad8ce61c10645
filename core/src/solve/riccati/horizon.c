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
        r->ones[l] = 1.0;
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

/* Where the maps' entries lie where inputs are not held, or before the first free one; those of inputs come last. */
RARE static void place_entries(const dims *s, const layout *p, const stage_maps *m, riccati *r) {
    int count = 0;
    for (int of_inputs = 0; of_inputs < 2; ++of_inputs) {
        for (int e = 0; e < m->map.start[s->rows]; ++e) {
            const int c = m->map.column[e], j = c - s->nx, row = m->map_row[e];
            if (of_inputs != (j >= 0 && j < s->nu)) continue;
            r->entries[count++] =
                (laid_entry){e * s->lanes, row * p->ld + (j < 0 ? c : j < s->nu ? p->B + j : p->c),
                             (j < 0 ? c : j < s->nu ? p->moving + j : p->columns - 1) * p->ld + row, of_inputs ? j : 0};
        }
        if (!of_inputs) r->plain_entries = count;
    }
    r->entry_count = count;
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
    const double *scales = r->problem->numbers.input_scales;
    const laid_entry *restrict of = r->entries;
    const int plain = r->plain_entries, count = r->entry_count;
    for (int k = 0; k < s.N; ++k) {
        double *restrict rows = rows_of_stage(r, &p, k), *restrict columns = columns_of_stage(r, &p, k);
        const double *restrict maps = m->maps + k;
        if (!unblocked(&s))
            for (int i = 0; i < s.rows; ++i) zero(rows + i * p.ld + p.B, s.nu); /* of entries that are not there */
        for (int e = 0; e < plain; ++e) rows[of[e].in_rows] = columns[of[e].in_columns] = maps[of[e].from];
        for (int e = plain; e < count; ++e)
            rows[of[e].in_rows] = columns[of[e].in_columns] = scales[of[e].input] * maps[of[e].from];
        if (!unblocked(&s) && k >= s.d) mix_inputs(&s, &p, &r->problem->blocking, k, rows, columns);
    }
}

#endif
