"""What a controller step returns."""

from __future__ import annotations

from dataclasses import dataclass

from rumo.signals import NamedArray
from rumo.status import Status


@dataclass(frozen=True)
class Timings:
    """Wall-clock time of one step.

    Attributes
    ----------
    prepare, feedback : float
        Time before and after the measurement was known [s].
    """

    prepare: float
    feedback: float

    @property
    def total(self) -> float:
        """Preparation and feedback together [s]."""
        return self.prepare + self.feedback


@dataclass(frozen=True)
class Plan:
    """Inputs and predicted states over the horizon, and what they are worth.

    Attributes
    ----------
    command : NamedArray, shape (nu,)
        The input to apply `delay` samples after the measurement; always finite and within bounds.
    u : NamedArray, shape (N, nu)
        Inputs of the horizon; the first `delay` are those already decided, then comes the command.
    x : NamedArray, shape (N + 1, nx)
        Predicted states, the measurement first; NaN where nothing was predicted.
    slacks : NamedArray, shape (N, nc)
        Amount by which each path constraint is violated at stages 1 to N, as linearised where the controller
        linearises; NaN where nothing was solved.
    status : Status
        Outcome of the step.
    cause : Status
        The same, but when the plan is exhausted: then what kept this step from being solved.
    timings : Timings
        Wall-clock times.
    """

    command: NamedArray
    u: NamedArray
    x: NamedArray
    slacks: NamedArray
    status: Status
    cause: Status
    timings: Timings
