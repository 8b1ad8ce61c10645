"""Implausible measurements: held back, unless they go on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.checks import positive_number, whole_number
from rumo.signals import Array


@dataclass(frozen=True)
class InnovationGate:
    """A wide gate around the predicted state, outside of which a measurement is not believed.

    A state's gate is `width` times what all inputs together can move it over the horizon, plus what the plan does.
    Measurements outside of it count as `Status.BAD_MEASUREMENT`. The gate cannot lock itself out: more than
    `patience` of them in a row that agree with each other are believed, and without a plan there is no gate.

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


class Gatekeeper:
    """Applies a gate sample by sample; none admits everything.

    Attributes
    ----------
    surprised : bool
        Whether the last sample was believed against the prediction.
    """

    def __init__(self, gate: InnovationGate | None) -> None:
        self._gate = gate
        self._held = 0
        self._suspect: Array | None = None
        self.surprised = False

    def admits(self, x: Array, predicted: Array, reach: Array | None) -> bool:
        """Whether a measurement x (nx,) may be used.

        Parameters
        ----------
        x : ndarray, shape (nx,)
            Finite.
        predicted : ndarray, shape (N + 1, nx)
            States of the last plan, from now on.
        reach : ndarray, shape (nx,)
            How far the inputs can move each state; where it is 0, there is nothing to compare with.
        """
        self.surprised = False
        if self._gate is None or reach is None:
            return True
        width = self._gate.width * (reach + np.abs(predicted - predicted[0]).max(axis=0))
        width[reach == 0.0] = np.inf
        if (np.abs(x - predicted[0]) <= width).all():
            self._held = 0
            return True
        agrees = self._held > 0 and self._suspect is not None and bool((np.abs(x - self._suspect) <= width).all())
        self._held = self._held + 1 if agrees else 1
        self._suspect = x.copy()
        if self._held <= self._gate.patience:
            return False
        self._held = 0
        self.surprised = True
        return True
