"""What a moving horizon solves at each sample: least squares with bounds, and a loss that forgives outliers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from rumo.signals import Array
from rumo.status import Status

TOLERANCE = 1e-9
ROUNDS = 20
"""In which residuals may turn out to be outliers, one after the other."""


@dataclass(frozen=True, eq=False)
class WindowProgram:
    """Minimise `|v|^2 / 2 + sum loss(r - G v)` over v with `lower <= E v <= upper`.

    The loss is half of the square up to `huber`, and grows linearly from there (Huber, 1964).

    Attributes
    ----------
    G, r : ndarray, shapes (m, n), (m,)
        Residuals, in standard deviations.
    E, lower, upper : ndarray, shapes (b, n), (b,), (b,)
        Bounds.
    huber : float
        In standard deviations; infinite for squares alone.
    """

    G: Array
    r: Array
    E: Array
    lower: Array
    upper: Array
    huber: float

    def solve(self) -> tuple[Array, Status]:
        """The minimiser (n,), and whether it is one: where there is none, that without bounds and outliers.

        Squares alone are tried first: where they keep the bounds and show no outliers, that is it. Residuals that are
        outliers get variables of their own, until there are no others; the loss is convex, so that is the minimum.
        """
        free = self._free()
        outliers = self._beyond(free)
        if not outliers.any() and self._within(free):
            return free, Status.OPTIMAL
        v = free
        for _ in range(ROUNDS):
            solved = self._bounded(np.flatnonzero(outliers))
            if solved is None:
                return free, Status.SOLVER_FAILED
            v, more = solved, self._beyond(solved) & ~outliers
            if not more.any():
                return v, Status.OPTIMAL
            outliers |= more
        return v, Status.BUDGET_EXCEEDED

    def weights(self, v: Array) -> Array:
        """By what share each residual counts as a square (m,): 1, less for outliers."""
        size = np.abs(self.r - self.G @ v)
        return np.where(size > self.huber, self.huber / np.maximum(size, 1e-300), 1.0)

    def _free(self) -> Array:
        hessian = np.eye(self.G.shape[1]) + self.G.T @ self.G
        return cho_solve(cho_factor(hessian, check_finite=False), self.G.T @ self.r, check_finite=False)

    def _beyond(self, v: Array) -> NDArray[np.bool_]:
        return np.abs(self.r - self.G @ v) > self.huber * (1.0 + TOLERANCE)

    def _within(self, v: Array) -> bool:
        values = self.E @ v
        slack = TOLERANCE * (1.0 + np.abs(values))
        return bool(((values >= self.lower - slack) & (values <= self.upper + slack)).all())

    def _bounded(self, outliers: NDArray[np.intp]) -> Array | None:
        """With bounds, and the excess of some residuals, positive and negative parts, paid for linearly."""
        import piqp  # only where something binds

        n, o = self.G.shape[1], len(outliers)
        pick = np.zeros((len(self.r), o))
        pick[outliers, np.arange(o)] = 1.0
        residuals = np.hstack([self.G, pick, -pick])
        hessian = residuals.T @ residuals
        hessian[:n, :n] += np.eye(n)
        gradient = -residuals.T @ self.r
        limited = np.isfinite(self.lower) | np.isfinite(self.upper)
        rows = np.hstack([self.E[limited], np.zeros((int(limited.sum()), 2 * o))])
        lower = np.concatenate([np.full(n, -np.inf), np.zeros(2 * o)])
        if o:
            gradient[n:] += self.huber
        solver: Any = piqp.DenseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = TOLERANCE
        size = n + 2 * o
        nothing = np.zeros((0, size)), np.zeros(0)
        limits = self.lower[limited], self.upper[limited]
        solver.setup(hessian, gradient, *nothing, rows, *limits, lower, np.full(size, np.inf))
        return solver.result.x[:n] if solver.solve() == piqp.PIQP_SOLVED else None
