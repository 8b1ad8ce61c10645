"""Dense convex quadratic programs with soft rows, solved by PIQP."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rumo.controllers.settings import QpOptions
from rumo.signals import Array
from rumo.status import Status

# PIQP takes values beyond this as infinite.
INFINITE = 1e30
# Curvature and compliance that are added to the factor with which solutions are polished.
PROXIMAL = 1e-8


@dataclass(frozen=True, eq=False)
class QuadraticProgram:
    """Minimise `v' H v / 2 + g' v + sum(l1 s + l2 s^2)` subject to bounds and two-sided rows.

    A row is hard where its `l1` is infinite; a soft row may exceed its upper limit by s >= 0.

    Attributes
    ----------
    hessian, gradient : ndarray, shapes (n, n), (n,)
    lower, upper : ndarray, shape (n,)
    rows : ndarray, shape (m, n)
    row_lower, row_upper, l1, l2 : ndarray, shape (m,)
    """

    hessian: Array
    gradient: Array
    lower: Array
    upper: Array
    rows: Array
    row_lower: Array
    row_upper: Array
    l1: Array
    l2: Array

    @property
    def sane(self) -> bool:
        """Whether all numbers are finite and far below what the solver takes as infinite; limits may be infinite."""
        limits = (self.lower, self.upper, self.row_lower, self.row_upper)
        data = (self.hessian, self.gradient, self.rows, *(limit[~np.isinf(limit)] for limit in limits))
        return all((np.abs(array) < 1e-3 * INFINITE).all() for array in data)


def solve(program: QuadraticProgram, options: QpOptions) -> tuple[Array, Status]:
    """Return the minimiser (n,) and OPTIMAL, BUDGET_EXCEEDED or SOLVER_FAILED.

    Slack variables are appended for the soft rows; their exact penalty makes the Hessian only semidefinite,
    which an interior-point solver takes as it is.
    """
    import piqp  # not needed by the compiled backends

    n, soft = len(program.gradient), np.flatnonzero(np.isfinite(program.l1))
    if options.max_iterations == 0:
        return np.full(n, np.nan), Status.BUDGET_EXCEEDED
    if not program.sane:
        return np.full(n, np.nan), Status.SOLVER_FAILED
    # Units of cost and constraints do not matter: the cost is divided by its smallest curvature along an input, each
    # row by its largest entry.
    cost = 1.0 / np.diag(program.hessian).min()
    largest = np.abs(program.rows).max(axis=1, initial=0.0)
    size = np.where(largest > 0.0, largest, 1.0)
    hessian = np.zeros((n + len(soft),) * 2)
    hessian[:n, :n] = cost * program.hessian
    hessian[range(n, n + len(soft)), range(n, n + len(soft))] = cost * 2.0 * (program.l2 * size**2)[soft]
    relief = np.zeros((len(program.rows), len(soft)))
    relief[soft, range(len(soft))] = -1.0

    gradient = cost * np.r_[program.gradient, (program.l1 * size)[soft]]
    rows = np.hstack([program.rows / size[:, None], relief])
    limits = [
        np.clip(limit, -INFINITE, INFINITE)
        for limit in (
            program.row_lower / size,
            program.row_upper / size,
            np.r_[program.lower, np.zeros(len(soft))],
            np.r_[program.upper, np.full(len(soft), np.inf)],
        )
    ]
    solver: Any = piqp.DenseSolver()  # its type hints ask for float64 where any float array does
    solver.settings.max_iter = options.max_iterations
    solver.settings.eps_abs = solver.settings.eps_rel = options.tolerance
    solver.setup(hessian, gradient, None, None, rows, *limits)
    outcome = solver.solve()
    if outcome == piqp.PIQP_SOLVED:
        return _polish(hessian, gradient, rows, limits, solver.result)[:n], Status.OPTIMAL
    status = Status.BUDGET_EXCEEDED if outcome == piqp.PIQP_MAX_ITER_REACHED else Status.SOLVER_FAILED
    return np.full(n, np.nan), status


def _polish(hessian: Array, gradient: Array, rows: Array, limits: Sequence[Array], result: Any) -> Array:
    """The minimiser on the constraints that an interior-point solution shows to be active, if it is one of all.

    Where the cost is flat, an interior point with residuals of 1e-12 can be 1e-6 away from it.
    """
    x = result.x
    identity = np.eye(len(x))
    normals = np.vstack([-rows, rows, -identity, identity])
    ends = np.concatenate([-limits[0], limits[1], -limits[2], limits[3]])
    multipliers = np.concatenate([result.z_l, result.z_u, result.z_bl, result.z_bu])
    size = 1e-9 * (1.0 + np.abs(multipliers).max(initial=0.0))
    # Primal-dual active sets: Hintermueller, Ito and Kunisch (2003).
    for _ in range(10):
        active = multipliers > ends - normals @ x
        x, on = _minimise_on(hessian, gradient, normals[active], ends[active], x, multipliers[active])
        multipliers = np.zeros(len(ends))
        multipliers[active] = on
        if np.all(normals @ x <= ends + 1e-9) and np.all(multipliers >= -size):
            return x
    return result.x


def _minimise_on(hessian: Array, gradient: Array, A: Array, b: Array, x: Array, mu: Array) -> tuple[Array, Array]:
    """Minimiser on A x = b and its multipliers, those nearest to x and mu where there are many.

    The proximal method of multipliers, as a few refinements of one regularised factor: Rockafellar (1976).
    """
    from scipy.linalg import lu_factor, lu_solve  # not needed by the compiled backends

    near_x, near_mu = PROXIMAL * np.eye(len(x)), PROXIMAL * np.eye(len(mu))
    factor = lu_factor(np.block([[hessian + near_x, A.T], [A, -near_mu]]), check_finite=False)
    for _ in range(6):
        residual = np.r_[hessian @ x + gradient + A.T @ mu, A @ x - b]
        step = lu_solve(factor, -residual, check_finite=False)
        x, mu = x + step[: len(x)], mu + step[len(x) :]
    return x, mu
