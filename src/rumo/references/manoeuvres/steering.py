"""Steering inputs by the clock: ISO 7401 and UN R140."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rumo.checks import finite_number, non_negative_number, positive_number
from rumo.references.base import OfTime
from rumo.signals import Array


@dataclass(frozen=True)
class StepSteer(OfTime):
    """A step of the steering angle that takes as long as a steering rate allows (ISO 7401).

    Parameters
    ----------
    amplitude : float
        Angle after the step [rad].
    rate : float
        While it is turned [rad/s].
    begin : float
        Of the step [s].
    signal : str
        Which signal it is.
    """

    pointwise: ClassVar[bool] = True

    amplitude: float
    rate: float = 0.5
    begin: float = 1.0
    signal: str = "delta"

    def __post_init__(self) -> None:
        finite_number(self.amplitude, "amplitude")
        positive_number(self.rate, "rate")
        finite_number(self.begin, "begin")

    def __call__(self, t: Array) -> dict[str, Array]:
        """Values at times t (n,) [s]."""
        turned = self.rate * (np.asarray(t, dtype=float) - self.begin)
        return {self.signal: np.sign(self.amplitude) * np.clip(turned, 0.0, abs(self.amplitude))}


@dataclass(frozen=True)
class SineWithDwell(OfTime):
    """One period of a sine of the steering angle, held at its second peak (ISO 19365, UN R140).

    Parameters
    ----------
    amplitude : float
        [rad]
    frequency : float
        [Hz]
    dwell : float
        How long the second peak is held [s]; 0 for the single sine of ISO 7401.
    begin : float
        Of the sine [s].
    signal : str
        Which signal it is.
    """

    pointwise: ClassVar[bool] = True

    amplitude: float
    frequency: float = 0.7
    dwell: float = 0.5
    begin: float = 1.0
    signal: str = "delta"

    def __post_init__(self) -> None:
        finite_number(self.amplitude, "amplitude")
        positive_number(self.frequency, "frequency")
        non_negative_number(self.dwell, "dwell")
        finite_number(self.begin, "begin")

    @property
    def end(self) -> float:
        """When the steering is straight again, for good [s]."""
        return self.begin + 1.0 / self.frequency + self.dwell

    def __call__(self, t: Array) -> dict[str, Array]:
        """Values at times t (n,) [s]."""
        since = np.asarray(t, dtype=float) - self.begin
        peak = 0.75 / self.frequency
        since = since - np.clip(since - peak, 0.0, self.dwell)
        phase = np.clip(self.frequency * since, 0.0, 1.0)
        return {self.signal: self.amplitude * np.sin(2.0 * np.pi * phase) * (phase < 1.0)}
