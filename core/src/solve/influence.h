/* What all inputs' ranges do to a constraint, and the unit in which it has to hold. */
#ifndef RUMO_INFLUENCE_H
#define RUMO_INFLUENCE_H

#include "base/lanes.h"

/* A constraint that they move by less than this share of its scale is not imposed. */
#define NO_INFLUENCE 1e-10
/* One that they move by more than so many times its scale holds as exactly as one that they move so far: it may be the first
 * inputs of a plant that runs away which move it, and others hold those; or ranges may be far too wide. */
#define MOST_INFLUENCE 1e3

static inline double unit_of_row(double norm, double scale) { return smaller(norm, MOST_INFLUENCE * scale); }

#endif
