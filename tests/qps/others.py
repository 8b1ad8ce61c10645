"""What other solvers find, as accurately as they can."""

from __future__ import annotations

import warnings
from collections import Counter

import numpy as np
import qpsolvers

from qps.proofs import residuals
from qps.random import in_units
from rumo.bench.qp import QuadraticProgram, Solution, posed

TIGHT = {
    "daqp": {"primal_tol": 1e-11, "dual_tol": 1e-13},
    "piqp": {
        "eps_abs": 1e-11,
        "eps_rel": 0.0,
        "eps_duality_gap_abs": 1e-10,
        "eps_duality_gap_rel": 0.0,
        "max_iter": 500,
    },
    "clarabel": {"tol_gap_abs": 1e-13, "tol_gap_rel": 1e-13, "tol_feas": 1e-13, "max_iter": 500},
    "quadprog": {},
}
SEMIDEFINITE = ("piqp", "clarabel")
"""Those that take slack variables without curvature (l2 = 0)."""


def solve_with(name: str, program: QuadraticProgram) -> Solution | None:
    """Solution by another solver, or None if it found none."""
    n, m = len(program.gradient), len(program.rows)
    # Units of the solvers' tolerances: the cost over its least curvature, rows over their norms.
    cost = 1.0 / np.diag(program.hessian).min()
    norm = np.linalg.norm(program.rows, axis=1) if m else np.ones(0)
    norm = np.where(norm > 0.0, norm, 1.0)
    scaled = in_units(program, 1.0 / norm, cost)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of dense matrices turned into sparse ones, and of tolerances not reached
        solution = qpsolvers.solve_problem(posed(scaled), solver=name, **TIGHT[name])
    if not solution.found or solution.x is None:
        return None
    z, finite = np.zeros(2 * m), np.isfinite(np.r_[scaled.row_upper, -scaled.row_lower])
    if finite.any():
        z[finite] = solution.z
    bounds = np.zeros(n) if solution.z_box is None or not len(solution.z_box) else solution.z_box[:n]
    return Solution(solution.x[:n], np.r_[bounds, (z[:m] - z[m:]) / norm] / cost)


def assert_agreement(program: QuadraticProgram, ours: Solution) -> Counter[str]:
    """Compare with all solvers that can take the program; returns how many times each of them had an answer.

    The minimiser is unique, but interior-point methods stop beside it. Where one is farther than 1e-7 from ours, its
    residuals of the optimality conditions must show that it is the other one that is inaccurate.
    """
    answered: Counter[str] = Counter()
    flat = (np.isfinite(program.l1) & (program.l2 == 0.0)).any()
    for name in SEMIDEFINITE if flat else TIGHT:
        theirs = solve_with(name, program)
        if theirs is None:
            continue
        answered[name] += 1
        if np.abs(theirs.v - ours.v).max() <= 1e-7:
            continue
        here, there = (residuals(program, s.v, s.multipliers).worst for s in (ours, theirs))
        assert here < 1e-10, (name, here, there)
        assert there > 100.0 * here, (name, here, there)
    return answered
