"""What is applied when a step has no solution: the previous plan, shifted, then the safe input."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.problem import Problem
from rumo.signals import Array


@dataclass(frozen=True)
class Trajectory:
    """Inputs (N, nu), states (N + 1, nx) and the intervals' other unknowns (N, nw - nx) over a horizon."""

    u: Array
    x: Array
    inner: Array

    @classmethod
    def at_rest(cls, x: Array, u: Array, inner: Array, horizon: int) -> Trajectory:
        """Stay at state x (nx,) with input u (nu,)."""
        return cls(np.tile(u, (horizon, 1)), np.tile(x, (horizon + 1, 1)), np.tile(inner, (horizon, 1)))

    def shifted(self, signals: np.ndarray) -> Trajectory:
        """One sample later: u(t+N) = u(t+N-1), the last state extrapolated.

        `signals` says which state each inner unknown is a value of; numbers beyond the states are algebraic variables.
        """
        nx = self.x.shape[1]
        last_move = self.x[-1] - self.x[-2]
        inner_move = np.r_[last_move, np.zeros(signals.max(initial=nx) + 1 - nx)][signals]
        return Trajectory(
            np.vstack([self.u[1:], self.u[-1]]),
            np.vstack([self.x[1:], self.x[-1] + last_move]),
            np.vstack([self.inner[1:], self.inner[-1] + inner_move]),
        )

    @property
    def resting(self) -> bool:
        """Whether the state never changes."""
        return bool((self.x == self.x[0]).all())

    @property
    def finite(self) -> bool:
        """Whether every number is finite."""
        return all(np.isfinite(array).all() for array in (self.u, self.x, self.inner))


def admissible(problem: Problem, u: Array, previous: Array) -> Array:
    """The inputs nearest to u that respect bounds and move bounds, one after the other.

    Parameters
    ----------
    problem : Problem
        Has the limits.
    u : ndarray, shape (n, nu)
        Inputs wanted, finite.
    previous : ndarray, shape (nu,)
        Input before the first of them.
    """
    result = np.empty_like(u)
    for k, wanted in enumerate(u):
        # An admissible input stays what it is, to the last digit.
        move = wanted - previous
        low, high = move < problem.move_lower, move > problem.move_upper
        reached = np.where(low, previous + problem.move_lower, np.where(high, previous + problem.move_upper, wanted))
        result[k] = previous = np.clip(reached, problem.input_lower, problem.input_upper)
    return result
