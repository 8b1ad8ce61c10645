"""Proofs of an answer that need no other solver: optimality conditions, and an LP for conflicts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from rumo.bench.qp import QuadraticProgram, Solution
from rumo.status import Status


@dataclass(frozen=True)
class Residuals:
    """How far an answer is from the optimality conditions, which are sufficient: the program is convex.

    Attributes
    ----------
    stationarity
        Of the Lagrangian's gradient, over its largest term.
    rows
        Largest distance of a row's value and multiplier from its limits and the multipliers they allow, units of v.
    """

    stationarity: float
    rows: float

    @property
    def worst(self) -> float:
        return max(self.stationarity, self.rows)


def stacked(program: QuadraticProgram) -> tuple[np.ndarray, ...]:
    """(rows, lower, upper, l1, l2, norms of the rows), with the bounds as rows before the others."""
    n = len(program.gradient)
    rows = np.vstack([np.eye(n), program.rows])
    norm = np.linalg.norm(rows, axis=1)
    return (
        rows,
        np.r_[program.lower, program.row_lower],
        np.r_[program.upper, program.row_upper],
        np.r_[np.full(n, np.inf), program.l1],
        np.r_[np.zeros(n), program.l2],
        np.where(norm > 0.0, norm, 1.0),
    )


def residuals(program: QuadraticProgram, v: np.ndarray, multipliers: np.ndarray) -> Residuals:
    """Residuals of the optimality conditions at v and the multipliers of bounds and rows.

    A row's multiplier mu is a slope of the price h(a'v) of its value: infinite outside of hard limits, the penalty
    beyond a soft one. That is so exactly if a'v minimises h(y) + (y - a'v - t mu)^2 / (2 t), for any t > 0.
    """
    rows, lower, upper, l1, l2, norm = stacked(program)
    terms = np.vstack([program.hessian * v[:, None], program.gradient, rows * multipliers[:, None]])
    stationarity = np.abs(terms.sum(axis=0)).max() / max(np.abs(terms).max(), 1e-300)

    t = norm**2 / np.diag(program.hessian).max()
    value = rows @ v
    z = value + t * multipliers
    with np.errstate(invalid="ignore", over="ignore"):
        beyond = upper + (z - upper - t * l1) / (1.0 + 2.0 * t * l2)
    nearest = np.where(z - upper > t * l1, beyond, np.minimum(z, upper))
    return Residuals(float(stationarity), float(np.max(np.abs(np.maximum(nearest, lower) - value) / norm, initial=0.0)))


def assert_solved(program: QuadraticProgram, solution: Solution, tolerance: float = 1e-9) -> None:
    """Prove that a solution is one."""
    assert solution.status is Status.OPTIMAL
    worst = residuals(program, solution.v, solution.multipliers)
    assert worst.worst < tolerance, worst


def assert_answered(program: QuadraticProgram, solution: Solution, tolerance: float = 1e-9) -> None:
    """Prove that a solution is one, or that there is none."""
    if solution.conflict:
        assert solution.status is Status.SOLVER_FAILED
        assert least_violation(program, solution.conflict) > 1e-9
    else:
        assert_solved(program, solution, tolerance)


def least_violation(program: QuadraticProgram, conflict: tuple[int, ...]) -> float:
    """Least distance from the hard limits of some rows (bounds first) that any v has, by an LP; in units of v."""
    rows, lower, upper, l1, _, norm = stacked(program)
    chosen = list(conflict)
    n, A = rows.shape[1], (rows / norm[:, None])[chosen]
    lower, upper = (lower / norm)[chosen], (np.where(np.isfinite(l1), np.inf, upper) / norm)[chosen]
    one = np.ones((len(chosen), 1))
    A_ub, b_ub = np.vstack([np.hstack([A, -one]), np.hstack([-A, -one])]), np.r_[upper, -lower]
    finite = np.isfinite(b_ub)
    if not finite.any():
        return 0.0
    least = linprog(
        np.r_[np.zeros(n), 1.0], A_ub[finite], b_ub[finite], bounds=[(None, None)] * n + [(0.0, None)], method="highs"
    )
    assert least.status == 0, least.message
    return least.fun
