"""The reference's quadratic programs: solved by PIQP, polished on the active set, and judged."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rumo.controllers.engines.conditions import (
    KKT_TOLERANCE,
    Conditions,
    Point,
    SparseProgram,
    entries,
    factored,
    sparse,
)
from rumo.controllers.settings import QpOptions
from rumo.signals import Array
from rumo.status import Status

# PIQP takes values beyond this as infinite.
INFINITE = 1e30
# Accuracy with which a program has to be infeasible; PIQP's own, 1e-4, gives up what weights of 1e6 ask for.
INFEASIBLE = 1e-8
# Accuracy of an interior point that is tried where a coarser one does not show what is active: prices beyond 1e8.
FINEST = 1e-13
# Iterations after which an interior point gets no nearer.
ENOUGH = 200
# The largest step of an input over its range that Newton's method still takes at a solution.
STEP_TOLERANCE = 1e-7


@dataclass(frozen=True, eq=False)
class Solution:
    """What came of a program.

    Attributes
    ----------
    q : ndarray, shape (n + p,)
        The minimiser; NaN if there is none.
    status : Status
        OPTIMAL, BUDGET_EXCEEDED, ILL_CONDITIONED or SOLVER_FAILED.
    residual : float
        Of the optimality conditions, see `Conditions.residual`; NaN if nothing was judged.
    """

    q: Array
    status: Status
    residual: float = np.nan


def solve(program: SparseProgram, options: QpOptions) -> Solution:
    """Solve by an interior point, then by Newton's method on the limits that it shows to be active.

    Where the cost is flat, an interior point with residuals of 1e-12 can be 1e-6 away from the minimiser. What comes of
    it is the solution if the optimality conditions hold and Newton's method has nothing left to change, whatever the
    interior point had to say. Where that leads nowhere, as where more limits meet than there are inputs, Newton's
    method finds its own way.
    """
    nothing = np.full(len(program.gradient), np.nan)
    most = options.iterations(len(program.lower) + len(program.row_upper))
    if most == 0:
        return Solution(nothing, Status.BUDGET_EXCEEDED)
    if not program.largest < 1e-3 * INFINITE:
        return Solution(nothing, Status.ILL_CONDITIONED if program.largest < np.inf else Status.SOLVER_FAILED)
    conditions = Conditions(program)
    for accuracy in (max(options.tolerance, KKT_TOLERANCE), FINEST):
        solution = _attempt(conditions, program, most, accuracy)
        if solution.status is not Status.ILL_CONDITIONED:
            return solution
    return _polished(conditions, conditions.approach(conditions.origin))


def _attempt(conditions: Conditions, program: SparseProgram, most: int, accuracy: float) -> Solution:
    """Solve from an interior point of an accuracy, which is relative to the largest price."""
    import piqp  # not needed by the compiled backends

    solver: Any = piqp.SparseSolver()  # its type hints ask for float64 where any float array does
    solver.settings.max_iter = min(most, ENOUGH)
    solver.settings.eps_abs = solver.settings.eps_rel = accuracy
    solver.settings.kkt_solver = piqp.sparse_ldlt_eq_cond  # on unstable plants, others stall in one case of ten
    solver.settings.eps_primal_inf = solver.settings.eps_dual_inf = INFEASIBLE
    solver.setup(*_with_slacks(conditions, program))
    outcome, result = solver.solve(), solver.result
    n, size = len(program.lower), len(program.gradient)
    if outcome == piqp.PIQP_MAX_ITER_REACHED and most <= ENOUGH:
        return Solution(np.full(size, np.nan), Status.BUDGET_EXCEEDED)
    multipliers = np.concatenate([result.z_l, result.z_u, result.z_bl[:n], result.z_bu[:n]])
    start = Point(result.x[:size], result.y, multipliers[conditions.finite])
    # What proves, or seems to prove, that there is no solution is nowhere near one.
    infeasible = outcome == piqp.PIQP_PRIMAL_INFEASIBLE
    solution = _polished(conditions, conditions.origin if infeasible or not start.finite else start)
    # Huge states may look like a proof.
    if infeasible and solution.status is not Status.OPTIMAL and _may_refuse(program):
        return replace(solution, status=Status.SOLVER_FAILED)
    return solution


def _with_slacks(conditions: Conditions, program: SparseProgram) -> tuple[Any, ...]:
    """Matrices and limits as PIQP takes them, a slack variable for each soft row after the others."""
    n, nq, m, p = len(program.lower), len(program.gradient), len(program.row_upper), len(program.ends)
    soft = np.flatnonzero(np.isfinite(program.l1))
    s, size, cost = nq + np.arange(len(soft)), nq + len(soft), conditions.cost
    hessian = sparse((size, size), entries(conditions.H), (2.0 * cost * program.l2[soft], s, s))
    rows = sparse((m, size), entries(program.rows), (np.full(len(soft), -1.0), soft, s))
    lower, upper = np.full(size, -np.inf), np.full(size, np.inf)
    lower[:n], upper[:n], lower[s] = program.lower, program.upper, 0.0
    limits = (np.clip(limit, -INFINITE, INFINITE) for limit in (program.row_lower, program.row_upper, lower, upper))
    gradient = np.r_[conditions.g, cost * program.l1[soft]]
    return hessian, gradient, sparse((p, size), entries(program.equations)), program.ends, rows, *limits


def _may_refuse(program: SparseProgram) -> bool:
    """Whether no inputs satisfy the hard rows, each in units of what inputs do to it; False if rounding hides it."""
    from scipy.optimize import linprog  # not needed by the compiled backends

    hard, n = np.isinf(program.l1), len(program.lower)
    if not hard.any():
        return False
    rows, E, e = program.rows.tocsr()[hard], program.equations, program.ends
    moved, fixed = np.zeros((len(e), n)), np.zeros(len(e))
    if len(e):
        factor = factored(E[:, n:])
        if factor is None:
            return False
        moved, fixed = -factor.solve(E[:, :n].toarray()), factor.solve(e)
    row, begin = rows[:, :n].toarray() + rows[:, n:] @ moved, rows[:, n:] @ fixed
    within = np.vstack([row, -row])
    ends = np.r_[program.row_upper[hard] - begin, begin - program.row_lower[hard]]
    size = np.abs(within).max(axis=1)
    size[size == 0.0] = 1.0
    finite, bounds = np.isfinite(ends), np.c_[program.lower, program.upper]
    if not (np.isfinite(within).all() and np.isfinite(begin).all()):
        return False
    result: Any = linprog(np.zeros(n), (within / size[:, None])[finite], (ends / size)[finite], bounds=bounds)
    return result.status == 2  # infeasible


def _polished(conditions: Conditions, start: Point) -> Solution:
    """The solution near a point, if there is one."""
    point, step = conditions.minimise(start)
    residual = conditions.residual(point)
    if residual <= KKT_TOLERANCE and step <= STEP_TOLERANCE:
        return Solution(point.q, Status.OPTIMAL, residual)
    return Solution(np.full(len(point.q), np.nan), Status.ILL_CONDITIONED, residual)
