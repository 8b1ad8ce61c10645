"""Implausible measurements: held back, unless they go on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.checks import positive_number, whole_number
from rumo.problem import Problem
from rumo.signals import Array

STAGES = 15
"""Over which the gate asks how far a state can go: over a long horizon, anywhere."""

CHANGES = 5
"""Repeated samples are suspicious only after so many that differed: some callers always pass the same."""

MOTION = 1e-3
"""And only if the prediction has left them by more than this share of the gate's unit."""


@dataclass(frozen=True)
class InnovationGate:
    """Holds back measurements that cannot be: far from the prediction, or frozen.

    A state's gate is `width` times what all inputs together can move it over the next 15 stages, plus what the plan
    does. A sample is frozen if it repeats the one before in every state, although the plan moves on, after at least
    five that did not. Both count as `Status.BAD_MEASUREMENT`. The gate cannot lock itself out: more than `patience`
    samples in a row that agree with each other are believed, and without a plan there is no gate.

    Parameters
    ----------
    width : float
        Half-width of the gate.
    patience : int
        Number of consecutive implausible samples that are held back.
    """

    width: float = 5.0
    patience: int = 8

    def __post_init__(self) -> None:
        positive_number(self.width, "InnovationGate.width")
        whole_number(self.patience, "InnovationGate.patience", 0)


WIDE_GATE = InnovationGate()


def gate_stages(problem: Problem) -> int:
    """Number of stages that the gate looks ahead."""
    return min(problem.horizon, problem.delay + STAGES)


class Gatekeeper:
    """Applies a gate sample by sample; none admits everything.

    Attributes
    ----------
    surprised : bool
        Whether the last sample was believed against the prediction.
    """

    def __init__(self, gate: InnovationGate | None) -> None:
        self._gate = gate
        self._held = self._repeats = self._changes = 0
        self._suspect: Array | None = None
        self._last: Array | None = None
        self.surprised = False

    def admits(self, x: Array, predicted: Array | None, reach: Array | None) -> bool:
        """Whether a measurement x (nx,) may be used.

        Parameters
        ----------
        x : ndarray, shape (nx,)
            Finite.
        predicted : ndarray, shape (stages + 1, nx)
            States of the last plan, from now on; None without a plan.
        reach : ndarray, shape (nx,)
            How far the inputs can move each state; where it is 0, there is nothing to compare with.
        """
        self.surprised = False
        if self._gate is None or predicted is None or reach is None:
            return True
        unit = reach + np.abs(predicted - predicted[0]).max(axis=0)
        unit[reach == 0.0] = np.inf
        innovation = np.abs(x - predicted[0])
        if (innovation <= self._gate.width * unit).all():
            self._held = 0
            if self._last is None or not np.array_equal(x, self._last):
                self._last = x.copy()
                self._repeats, self._changes = 0, min(self._changes + 1, CHANGES)
                return True
            if self._changes < CHANGES or not (innovation > MOTION * unit).any():
                return True
            self._repeats += 1
            if self._repeats <= self._gate.patience:
                return False
            self._repeats = self._changes = 0
        else:
            suspect = self._suspect
            agrees = self._held > 0 and suspect is not None and (np.abs(x - suspect) <= self._gate.width * unit).all()
            self._held = self._held + 1 if agrees else 1
            self._suspect = x.copy()
            if self._held <= self._gate.patience:
                return False
            self._held = 0
        self.surprised = True
        return True
