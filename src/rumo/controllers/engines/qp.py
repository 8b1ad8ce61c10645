"""Sparse convex quadratic programs with soft rows: solved by PIQP, polished on the active set, and judged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

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
# By how much, in ranges, limits give way to their forces in the factor with which solutions are polished.
PROXIMAL = 1e-8
# Forces and violations below this share of what an input's range stands for are as good as none.
FLOOR = 1e-6
# A solution's largest KKT residual, and the largest step of an input over its range that Newton's method still takes.
KKT_TOLERANCE = 1e-9
STEP_TOLERANCE = 1e-7
# How often active sets may change, and a factor be used to refine.
ACTIVE_SETS = 20
REFINEMENTS = 30


@dataclass(frozen=True, eq=False)
class SparseProgram:
    """Minimise `q' H q / 2 + g' q + sum(l1 s + l2 s^2)` subject to `E q = e`, bounds and two-sided rows.

    The first n variables are inputs in units of their ranges, and the only ones with bounds; the other p follow from
    them by the p equations. A row is hard where its `l1` is infinite; a soft row may exceed its upper limit by s >= 0.

    Attributes
    ----------
    hessian, gradient : sparse array and ndarray, shapes (n + p, n + p), (n + p,)
    equations, ends : sparse array and ndarray, shapes (p, n + p), (p,)
    lower, upper : ndarray, shape (n,)
    rows : sparse array, shape (m, n + p)
    row_lower, row_upper, l1, l2 : ndarray, shape (m,)
    signals : ndarray of int, shape (n + p,)
        Which input or state each variable is a value of.
    """

    hessian: Any
    gradient: Array
    equations: Any
    ends: Array
    lower: Array
    upper: Array
    rows: Any
    row_lower: Array
    row_upper: Array
    l1: Array
    l2: Array
    signals: np.ndarray

    @property
    def sane(self) -> bool:
        """Whether all numbers are finite and far below what the solver takes as infinite; limits may be infinite."""
        limits = (self.lower, self.upper, self.row_lower, self.row_upper)
        matrices = (self.hessian.data, self.equations.data, self.rows.data)
        data = (*matrices, self.gradient, self.ends, *(limit[~np.isinf(limit)] for limit in limits))
        return all((np.abs(array) < 1e-3 * INFINITE).all() for array in data)


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
    interior point had to say.
    """
    nothing = np.full(len(program.gradient), np.nan)
    if options.max_iterations == 0:
        return Solution(nothing, Status.BUDGET_EXCEEDED)
    if not program.sane:
        return Solution(nothing, Status.SOLVER_FAILED)
    conditions, solution = Conditions(program), Solution(nothing, Status.ILL_CONDITIONED)
    for accuracy in (max(options.tolerance, KKT_TOLERANCE), FINEST):
        solution = _attempt(conditions, program, options.max_iterations, accuracy)
        if solution.status is not Status.ILL_CONDITIONED:
            break
    return solution


def _attempt(conditions: Conditions, program: SparseProgram, most: int, accuracy: float) -> Solution:
    """Solve from an interior point of an accuracy, which is relative to the largest price."""
    import piqp  # not needed by the compiled backends

    solver: Any = piqp.SparseSolver()  # its type hints ask for float64 where any float array does
    solver.settings.max_iter = min(most, ENOUGH)
    solver.settings.eps_abs = solver.settings.eps_rel = accuracy
    solver.settings.kkt_solver = piqp.sparse_ldlt_eq_cond  # on unstable plants, others stall in one case of ten
    solver.settings.eps_primal_inf = solver.settings.eps_dual_inf = INFEASIBLE
    solver.setup(*conditions.with_slacks(program))
    outcome, result = solver.solve(), solver.result
    n, size = len(program.lower), len(program.gradient)
    nothing = np.full(size, np.nan)
    multipliers = np.concatenate([result.z_l, result.z_u, result.z_bl[:n], result.z_bu[:n]])
    start = Point(result.x[:size], result.y, multipliers[conditions.finite])
    if outcome == piqp.PIQP_MAX_ITER_REACHED and most <= ENOUGH:
        return Solution(nothing, Status.BUDGET_EXCEEDED)
    point, step = conditions.minimise(start)
    residual = conditions.residual(point)
    if residual <= KKT_TOLERANCE and step <= STEP_TOLERANCE:
        return Solution(point.q, Status.OPTIMAL, residual)
    # Without hard rows any input within its bounds is feasible, whatever huge states look like.
    infeasible = outcome == piqp.PIQP_PRIMAL_INFEASIBLE and bool(np.isinf(program.l1).any())
    return Solution(nothing, Status.SOLVER_FAILED if infeasible else Status.ILL_CONDITIONED, residual)


@dataclass(frozen=True, eq=False)
class Point:
    """Variables (nq,), multipliers of equations (p,) and of limits (nl,)."""

    q: Array
    y: Array
    mu: Array


class Conditions:
    """Optimality conditions: `H q + g + E' y + C' mu = 0`, `E q = e`, and mu a price of the excess `C q - c`.

    The limits C are all finite ones, of rows, then of variables, lower ones first. Their multiplier is 0 below the
    limit, `l1 + 2 l2 (C q - c)` above it, and between 0 and l1 at it; l1 is infinite where a limit is hard. The cost is
    divided by its smallest curvature along an input.
    """

    def __init__(self, program: SparseProgram) -> None:
        n, nq, m = len(program.lower), len(program.gradient), len(program.row_upper)
        cost = 1.0 / program.hessian.diagonal()[:n].min()
        self.inputs, self.signals, self.cost = n, program.signals, cost
        self.H, self.g = cost * program.hessian, cost * program.gradient
        self.E, self.e = program.equations, program.ends

        values, rows, columns = entries(program.rows)
        one, each, free = np.ones(n), np.arange(n), np.full(n, np.inf)
        stacked = (
            np.r_[-values, values, -one, one],
            np.r_[rows, m + rows, 2 * m + each, 2 * m + n + each],
            np.r_[columns, columns, each, each],
        )
        ends = np.concatenate([-program.row_lower, program.row_upper, -program.lower, program.upper])
        self.finite = np.isfinite(ends)
        self.c, self._entries = ends[self.finite], chosen(stacked, self.finite)
        self.C = sparse((len(self.c), nq), self._entries)
        l1 = np.concatenate([np.full(m, np.inf), cost * program.l1, free, free])
        l2 = np.concatenate([np.zeros(m), cost * program.l2, 0.0 * one, 0.0 * one])
        self.l1, self.l2 = l1[self.finite], l2[self.finite]

    def minimise(self, point: Point) -> tuple[Point, float]:
        """Newton's method on the limits that are active or exceeded, until these stay; and the last step of an input.

        Primal-dual active sets: Hintermueller, Ito and Kunisch (2003).
        """
        before, last, moved = None, np.inf, np.inf
        for _ in range(ACTIVE_SETS):
            where = self.C @ point.q - self.c + point.mu
            state = (where > 0.0).astype(int) + (where > self.l1)
            if before is not None and (state == before).all():
                return point, last
            if moved <= KKT_TOLERANCE and self.residual(point) <= KKT_TOLERANCE:
                break  # limits come and go with rounding
            start, before = point, state
            point, last = self._minimise_on(state > 0, state > 1, start)
            moved = max(last, self._change(point.q - start.q))
        return point, moved

    def _minimise_on(self, active: np.ndarray, exceeded: np.ndarray, point: Point) -> tuple[Point, float]:
        """The minimiser on active limits, with the multipliers nearest to a point's where there are many.

        The proximal method of multipliers, as refinements of one regularised factor: Rockafellar (1976).
        """
        from scipy.sparse.linalg import splu  # not needed by the compiled backends

        nq, p, m, over = len(point.q), len(point.y), int(active.sum()), exceeded[active]
        H, E, C, l2 = entries(self.H), entries(self.E), chosen(self._entries, active), 2.0 * self.l2[active]
        values, rows, columns = C
        # C q = c where a limit is kept, but for the compliance; 2 l2 (C q - c) - mu = -l1 where it is exceeded.
        weight, own = np.where(over, l2, 1.0), nq + p + np.arange(m)
        gives = np.where(over, 0.0, PROXIMAL / (1.0 + np.abs(point.mu[active])))
        below = (E[0], nq + E[1], E[2]), (weight[rows] * values, nq + p + rows, columns)
        beside = (E[0], E[2], nq + E[1]), (values, columns, nq + p + rows)
        matrix = sparse((nq + p + m, nq + p + m), H, *below, *beside, (-gives - over, own, own))
        right = np.r_[-self.g, self.e, weight * self.c[active] - np.where(over, self.l1[active], 0.0)]
        try:
            factor = splu(matrix)
        except RuntimeError:  # exactly singular
            return point, np.inf
        w, gained = np.r_[point.q, point.y, point.mu[active]], np.full(2, np.inf)
        for i in range(REFINEMENTS):
            off = right - matrix @ w
            off[nq + p :] -= gives * w[nq + p :]
            step = factor.solve(off)
            w = w + step
            before, gained = gained, np.array([self._change(step), np.abs(off).max()])
            if i > 2 and not (gained < 0.5 * before).any():
                break
        mu = np.zeros(len(self.c))
        mu[active] = w[nq + p :]
        return Point(w[:nq], w[nq : nq + p], mu), float(gained[0])

    def residual(self, point: Point) -> float:
        """Largest of what the optimality conditions lack.

        Forces that nothing balances, over the largest of those on the same signal, and violations: of equations over
        the largest of their terms, of hard limits in units of the inputs' ranges. A multiplier counts as far as there
        may be one, where a limit is near enough.
        """
        q, y, H, E, C = point.q, point.y, self.H, self.E, self.C
        excess, hard = C @ q - self.c, np.isinf(self.l1)
        within = [
            np.where(e > 0.0, self.l1 + 2.0 * self.l2 * e, 0.0)
            for e in (excess - KKT_TOLERANCE, excess + KKT_TOLERANCE)
        ]
        mu = np.clip(point.mu, np.where(hard, 0.0, within[0]), within[1])
        slope, unmet = H @ q + self.g, E @ q - self.e
        forces = np.abs(slope) + abs(E).T @ np.abs(y) + abs(C).T @ mu
        unbalanced = np.abs(slope + E.T @ y + C.T @ mu) / self._largest(forces, self.signals)
        terms = abs(E) @ np.abs(q) + np.abs(self.e)
        lacking = np.abs(unmet) / self._largest(terms, self.signals[self.inputs :])
        return float(max(unbalanced.max(), lacking.max(initial=0.0), excess[hard].max(initial=0.0)))

    def with_slacks(self, program: SparseProgram) -> tuple[Any, ...]:
        """Matrices and limits as PIQP takes them, a slack variable for each soft row after the others."""
        n, nq, m = self.inputs, len(self.g), len(program.row_upper)
        soft = np.flatnonzero(np.isfinite(program.l1))
        s, size, p = nq + np.arange(len(soft)), nq + len(soft), len(self.e)
        hessian = sparse((size, size), entries(self.H), (2.0 * self.cost * program.l2[soft], s, s))
        rows = sparse((m, size), entries(program.rows), (np.full(len(soft), -1.0), soft, s))
        lower, upper = np.full(size, -np.inf), np.full(size, np.inf)
        lower[:n], upper[:n], lower[s] = program.lower, program.upper, 0.0
        limits = (np.clip(limit, -INFINITE, INFINITE) for limit in (program.row_lower, program.row_upper, lower, upper))
        gradient = np.r_[self.g, self.cost * program.l1[soft]]
        return hessian, gradient, sparse((p, size), entries(self.E)), self.e, rows, *limits

    def _largest(self, sizes: Array, signals: np.ndarray) -> Array:
        """For each entry, the largest of its signal, not less than what a millionth of a range stands for."""
        largest = np.full(self.signals.max() + 1, FLOOR)
        np.maximum.at(largest, signals, sizes)
        return largest[signals]

    def _change(self, step: Array) -> float:
        """Largest step of an input, over its range."""
        return float(np.abs(step[: self.inputs]).max())


Entries = tuple[Array, np.ndarray, np.ndarray]


def sparse(shape: tuple[int, int], *parts: Entries) -> Any:
    """A sparse matrix by columns from values, rows and columns, which broadcast; what coincides adds up."""
    from scipy.sparse import csc_array  # not needed by the compiled backends

    flat = [[array.ravel() for array in np.broadcast_arrays(*part)] for part in parts]
    values, rows, columns = (np.concatenate(arrays) for arrays in zip(*flat, strict=True))
    kept = values != 0.0
    return csc_array((values[kept], (rows[kept], columns[kept])), shape)


def entries(matrix: Any) -> Entries:
    """Values, rows and columns of a sparse matrix by columns."""
    return matrix.data, matrix.indices, np.repeat(np.arange(matrix.shape[1]), np.diff(matrix.indptr))


def chosen(parts: Entries, which: np.ndarray) -> Entries:
    """Those of some rows, which are counted anew."""
    values, rows, columns = parts
    kept = which[rows]
    return values[kept], (np.cumsum(which) - 1)[rows[kept]], columns[kept]
