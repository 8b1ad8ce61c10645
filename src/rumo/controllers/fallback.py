"""What is applied when a step has no solution: the previous plan, shifted, then the safe input."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.problem import Problem
from rumo.signals import Array
from rumo.transcription import Transcription


class Shift:
    """Where on a horizon one sample later is.

    Parameters
    ----------
    transcription : Transcription
        Its grid and its intervals' unknowns.

    Attributes
    ----------
    stages, shares : ndarray, shape (N + 1,)
        The stage before, and how far towards the next, as a share; beyond 1 at the end.
    intervals : ndarray, shape (N,)
        The interval in whose time the middle of each lies then.
    bent : ndarray of bool, shape (nw - nx,)
        Which inner unknowns are values of states.
    """

    def __init__(self, transcription: Transcription) -> None:
        problem = transcription.problem
        times, steps, last = problem.times, problem.steps, problem.horizon - 1
        later = times + problem.sampling_time
        # A time that is a stage's but for rounding is that stage's.
        nearly = 1e-9 * problem.sampling_time
        self.stages = np.minimum(np.searchsorted(times, later + nearly, side="right") - 1, last).astype(np.int32)
        self.shares = np.round((later - times[self.stages]) / steps[self.stages], 9)
        middle = 0.5 * (later[:-1] + later[1:])
        self.intervals = np.minimum(np.searchsorted(times, middle, side="right") - 1, last).astype(np.int32)
        self.bent = transcription.inner_signals < len(problem.model.states)
        self._signals = transcription.inner_signals[self.bent]
        self._nodes = transcription.inner_nodes[self.bent]

    def between(self, begin: Array, end: Array) -> Array:
        """On the straight line from states (N, nx) to states (N, nx), where the inner unknowns lie."""
        return (1.0 - self._nodes) * begin[:, self._signals] + self._nodes * end[:, self._signals]


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

    def shifted(self, shift: Shift) -> Trajectory:
        """One sample later: u(t+N) = u(t+N-1), the last state extrapolated."""
        i, j = shift.stages, shift.intervals
        x = self.x[i] + shift.shares[:, None] * (self.x[i + 1] - self.x[i])
        inner = self.inner[j].copy()
        # Unknowns inside an interval keep their distance from the straight line between its ends.
        bend = inner[:, shift.bent] - shift.between(self.x[j], self.x[j + 1])
        inner[:, shift.bent] = shift.between(x[:-1], x[1:]) + bend
        return Trajectory(self.u[j], x, inner)

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
