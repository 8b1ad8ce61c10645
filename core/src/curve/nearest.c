/* The point of a curve nearest to a place: from the nearest break on by Newton's method, or halving, between its neighbours.
 *
 * Values 0 and 1 are the position, to which a lap adds nothing. Breaks count as nodes but for the ends of an open curve, whose
 * first and last pieces are what leads to it and away from it. */
#ifndef RUMO_NEAREST_C
#define RUMO_NEAREST_C

#include "base/lanes.h"
#include "curve/pieces.c"

#define CLOSE_ENOUGH 1e-9 /* Newton's step that ends the search */
#define MOST_DESCENTS 100 /* halving alone gets from a kilometre to a nanometre in forty */

typedef struct descent {
    double slope, second; /* derivatives of half the squared distance */
} descent;

/* Node j, counted on from lap to lap. */
static double node_at(const rumo_curve *c, int j) {
    return j < c->pieces ? c->breaks[j] : c->breaks[j - c->pieces] + period_of(c);
}

/* The last node up to an argument of the first two laps. */
static int last_node(const rumo_curve *c, double s) {
    if (!c->shift || s < c->breaks[c->pieces]) return piece_of(c, s, 0);
    return c->pieces + piece_of(c, s - period_of(c), 0);
}

static double squared_distance(const rumo_curve *c, int j, double x, double y) {
    const int piece = j < c->pieces ? j : j - c->pieces, last = c->order - 1;
    const double dx = coefficients_of(c, piece, 0)[last] - x, dy = coefficients_of(c, piece, 1)[last] - y;
    return dx * dx + dy * dy;
}

static descent descent_at(const rumo_curve *c, double x, double y, double s, int *piece) {
    const double share = c->shift && s >= c->breaks[c->pieces] ? s - period_of(c) : s, place[2] = {x, y};
    *piece = piece_of(c, share, *piece);
    const double d = share - c->breaks[*piece];
    descent at = {0.0, 0.0};
    for (int v = 0; v < 2; ++v) {
        const double *const a = coefficients_of(c, *piece, v);
        double value = 0.0, first = 0.0, half_second = 0.0;
        for (int j = 0; j < c->order; ++j) {
            half_second = half_second * d + first;
            first = first * d + value;
            value = value * d + a[j];
        }
        at.slope += (value - place[v]) * first;
        at.second += first * first + (value - place[v]) * 2.0 * half_second;
    }
    return at;
}

static double squared_distance_at(const rumo_curve *c, double x, double y, double s) {
    const double share = c->shift && s >= c->breaks[c->pieces] ? s - period_of(c) : s, place[2] = {x, y};
    const int piece = piece_of(c, share, 0);
    const double d = share - c->breaks[piece];
    double squared = 0.0;
    for (int v = 0; v < 2; ++v) {
        const double *const a = coefficients_of(c, piece, v);
        double value = 0.0;
        for (int j = 0; j < c->order; ++j) value = value * d + a[j];
        squared += (value - place[v]) * (value - place[v]);
    }
    return squared;
}

/* From s on to where the distance is least, or to an end that is nearer: between the ends it may rise before it falls. */
static double descend(const rumo_curve *c, double x, double y, double s, double low, double high) {
    const double ends[2] = {low, high};
    int piece = 0;
    for (int k = 0; k < MOST_DESCENTS; ++k) {
        const descent at = descent_at(c, x, y, s, &piece);
        if (at.slope < 0.0) low = s;
        else high = s;
        double next = at.second > 0.0 ? s - at.slope / at.second : NAN;
        if (!(low <= next && next <= high)) next = 0.5 * low + 0.5 * high;
        const int there = fabs(next - s) < CLOSE_ENOUGH;
        s = next;
        if (there) break;
    }
    double least = squared_distance_at(c, x, y, s);
    for (int i = 0; i < 2; ++i) {
        const double distance = squared_distance_at(c, x, y, ends[i]);
        if (distance < least) {
            least = distance;
            s = ends[i];
        }
    }
    return s;
}

/* The argument of the nearest point of those from `low` to `high`; of a closed curve, of the lap in their middle at most. */
static double curve_nearest(const rumo_curve *c, double x, double y, double low, double high) {
    if (!(isfinite(x) && isfinite(y) && isfinite(low) && isfinite(high) && low <= high)) return NAN;
    double width = high - low, laps;
    if (c->shift && width > period_of(c)) {
        width = period_of(c);
        low = 0.5 * low + 0.5 * high - 0.5 * width;
    }
    const double from = within_lap(c, low, &laps), to = c->shift ? from + width : high;
    const int first = last_node(c, from) + 1, last = last_node(c, to);
    if (last < first) return low - from + descend(c, x, y, 0.5 * from + 0.5 * to, from, to);
    int best = first;
    double least = INFINITY;
    for (int j = first; j <= last; ++j) {
        const double distance = squared_distance(c, j, x, y);
        if (distance < least) {
            least = distance;
            best = j;
        }
    }
    const double before = best > first ? node_at(c, best - 1) : from, after = best < last ? node_at(c, best + 1) : to;
    return low - from + descend(c, x, y, node_at(c, best), before, after);
}

#endif
