"""Sparse convex quadratic programs with soft rows, and Newton's method on the limits that are active."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rumo.signals import Array

# By how much, in ranges, limits give way to their forces on the way to a solution, and in the factor that polishes it.
PROXIMAL = 1e-8
# Forces and violations below this share of what an input's range stands for are as good as none.
FLOOR = 1e-6
# The largest KKT residual of a solution.
KKT_TOLERANCE = 1e-9
# How many of Newton's steps a point may be away, how often active sets may change, and a factor be used to refine.
STEPS = 200
ACTIVE_SETS = 100
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
    def largest(self) -> float:
        """Size of the largest number, NaN if one is none; limits may be infinite."""
        limits = (self.lower, self.upper, self.row_lower, self.row_upper)
        matrices = (self.hessian.data, self.equations.data, self.rows.data)
        data = (*matrices, self.gradient, self.ends, *(limit[~np.isinf(limit)] for limit in limits))
        return float(np.abs(np.concatenate(data)).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class Point:
    """Variables (nq,), multipliers of equations (p,) and of limits (nl,)."""

    q: Array
    y: Array
    mu: Array

    @property
    def finite(self) -> bool:
        """Whether all of it is."""
        return all(np.isfinite(part).all() for part in (self.q, self.y, self.mu))


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

    @property
    def origin(self) -> Point:
        """Where nothing is known of a solution."""
        return Point(np.zeros(len(self.g)), np.zeros(len(self.e)), np.zeros(len(self.c)))

    def minimise(self, point: Point) -> tuple[Point, float]:
        """Newton's method on the limits that are active or exceeded, until these stay; and the last step of an input.

        Primal-dual active sets: Hintermueller, Ito and Kunisch (2003).
        """
        before, last, moved = None, np.inf, np.inf
        for _ in range(ACTIVE_SETS):
            where = self.C @ point.q - self.c + point.mu
            state = (where > 0.0).astype(int) + (where > self.l1)
            if before is not None:
                if (state == before).all():
                    return point, last
                if moved <= KKT_TOLERANCE and self._holds(point, before) and self.residual(point) <= KKT_TOLERANCE:
                    return point, moved  # limits come and go with rounding
            start, before = point, state
            point, last = self._minimise_on(state, start)
            moved = max(last, self._change(point.q - start.q))
        return point, np.inf

    def _holds(self, point: Point, state: np.ndarray) -> bool:
        """Whether active limits hold at a point: they cannot all where there are too many of them."""
        return bool((np.abs(self.C @ point.q - self.c)[state == 1] <= KKT_TOLERANCE).all())

    def approach(self, point: Point) -> Point:
        """A point near the minimiser, from anywhere, and however many limits meet there.

        The proximal method of multipliers; each of its minima is found by Newton's method with an exact line search,
        which does not go in circles. Source: Hermans, Themelis and Patrinos (2022).
        """
        q, y, mu, nq, p, before = point.q, point.y, point.mu, len(point.q), len(point.y), None
        for _ in range(STEPS):
            pressed = self.C @ q - self.c + PROXIMAL * mu
            state = (pressed > 0.0).astype(int) + (pressed > PROXIMAL * self.l1)
            if before is not None and (state == before).all():
                mu, before = self._prices(pressed), None
                if self.residual(Point(q, y, mu)) <= KKT_TOLERANCE:
                    break
                continue
            matrix, right, weight = self._system(state, PROXIMAL)
            right[nq + p :] -= weight * PROXIMAL * mu[state > 0]
            factor = factored(matrix)
            if factor is None:
                break
            w = factor.solve(right)
            w = w + factor.solve(right - matrix @ w)
            if not np.isfinite(w).all():
                break
            step = w[:nq] - q
            q = q + (1.0 if before is None else self._length(q, step, pressed)) * step
            y, before = w[nq : nq + p], state
        return Point(q, y, mu)

    def _prices(self, pressed: Array) -> Array:
        """Multipliers of limits that are pressed so far, and give way by PROXIMAL times their multipliers."""
        pressed = np.maximum(pressed, 0.0)
        beyond = np.maximum(pressed - PROXIMAL * self.l1, 0.0)
        return (pressed - beyond) / PROXIMAL + 2.0 * self.l2 * beyond / (1.0 + 2.0 * self.l2 * PROXIMAL)

    def _length(self, q: Array, step: Array, pressed: Array) -> float:
        """The share of a step at which the cost, with limits that are pressed so far at q, is least."""
        from scipy.optimize import brentq  # not needed by the compiled backends

        start, curvature, pressing = step @ (self.H @ q + self.g), step @ (self.H @ step), self.C @ step

        def slope(share: float) -> float:
            return start + share * curvature + pressing @ self._prices(pressed + share * pressing)

        least: Any = brentq(slope, 0.0, 1.0) if slope(0.0) < 0.0 < slope(1.0) else 1.0
        return least

    def _minimise_on(self, state: np.ndarray, point: Point) -> tuple[Point, float]:
        """The minimiser on active limits, with the multipliers nearest to a point's where there are many.

        The proximal method of multipliers, as refinements of one regularised factor: Rockafellar (1976).
        """
        nq, p, active = len(point.q), len(point.y), state > 0
        gives = np.where(state[active] > 1, 0.0, PROXIMAL / (1.0 + np.abs(point.mu[active])))
        matrix, right, _ = self._system(state, gives)
        factor = factored(matrix)
        if factor is None:
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
        if not np.isfinite(w).all():
            return point, np.inf
        mu = np.zeros(len(self.c))
        mu[active] = w[nq + p :]
        return Point(w[:nq], w[nq : nq + p], mu), float(gained[0])

    def _system(self, state: np.ndarray, gives: Array | float) -> tuple[Any, Array, Array]:
        """Matrix, right side and weights of limits, for q, y and the multipliers of limits that are active or exceeded.

        `C q - gives mu = c` where a limit is active, and `2 l2 (C q - gives mu - c) - mu = -l1` where it is exceeded.
        """
        active, over = state > 0, state[state > 0] > 1
        nq, p = len(self.g), len(self.e)
        size = nq + p + len(over)
        H, E, C = entries(self.H), entries(self.E), chosen(self._entries, active)
        (values, rows, columns), own = C, np.arange(nq + p, size)
        weight = np.where(over, 2.0 * self.l2[active], 1.0)
        below = (E[0], nq + E[1], E[2]), (weight[rows] * values, nq + p + rows, columns)
        beside = (E[0], E[2], nq + E[1]), (values, columns, nq + p + rows)
        matrix = sparse((size, size), H, *below, *beside, (-weight * gives - over, own, own))
        right = np.r_[-self.g, self.e, weight * self.c[active] - np.where(over, self.l1[active], 0.0)]
        return matrix, right, weight

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


def factored(matrix: Any) -> Any:
    """The L U factor of a sparse matrix, or None if it is exactly singular."""
    from scipy.sparse.linalg import splu  # not needed by the compiled backends

    try:
        return splu(matrix)
    except RuntimeError:
        return None
