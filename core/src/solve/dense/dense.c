/* Dense condensing: the states are eliminated, and a dense quadratic program in the free inputs is left. */
#ifndef RUMO_DENSE_C
#define RUMO_DENSE_C

#include "solve/dense/prepare.c"
#include "solve/dense/solve.c"

static const stage_solver dense_solver = {dense_lay_out, dense_renumber, dense_forget, dense_damp,
                                          dense_prepare, dense_reach,    dense_solve};

#endif
