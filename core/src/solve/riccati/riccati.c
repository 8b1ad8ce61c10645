/* The structured solver: Riccati sweeps along the stages, and the active-set method in the space they make. */
#ifndef RUMO_RICCATI_C
#define RUMO_RICCATI_C

#include "solve/riccati/prepare.c"
#include "solve/riccati/solve.c"

static const stage_solver riccati_solver = {riccati_lay_out, riccati_renumber, riccati_forget, riccati_damp,
                                            riccati_prepare, riccati_reach,    riccati_solve};

#endif
