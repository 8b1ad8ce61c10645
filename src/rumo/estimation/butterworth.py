"""Low-pass filter on every measured signal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from rumo.checks import whole_number
from rumo.errors import ArgumentError
from rumo.problem import Problem
from rumo.signals import Array


@dataclass(frozen=True)
class Butterworth:
    """Butterworth low-pass, discretised by Tustin's method with the cutoff kept in place.

    Parameters
    ----------
    cutoff : float
        Frequency [Hz] of 3 dB attenuation.
    order : int
        Order of the filter; the paper's is 1.
    """

    cutoff: float = 3.5
    order: int = 1

    def start(self, problem: Problem) -> RunningButterworth:
        """Return a filter for the states of the problem's model; those in rad are unwrapped."""
        nyquist = 0.5 / problem.sampling_time
        if not 0.0 < self.cutoff < nyquist:
            raise ArgumentError("cutoff", f"{self.cutoff:g} Hz", f"a frequency between 0 and {nyquist:g} Hz")
        whole_number(self.order, "order", 1)
        sections = signal.butter(self.order, self.cutoff, fs=2.0 * nyquist, output="sos")
        return RunningButterworth(np.asarray(sections), problem.model.states.angles)


class RunningButterworth:
    """A filter with memory; it starts at the first finite sample, in steady state."""

    def __init__(self, sections: Array, angles: np.ndarray) -> None:
        self._sections = sections
        self._angles = angles
        self._memory: Array | None = None
        self._previous: Array | None = None

    def __call__(self, measurement: Array, applied: Array) -> Array:
        """Filter a sample (n,). A sample with NaN or infinity passes through and leaves the memory as it was."""
        if not np.isfinite(measurement).all():
            return measurement
        if self._previous is None or self._memory is None:
            self._previous = measurement
            self._memory = signal.sosfilt_zi(self._sections)[:, :, None] * measurement
        turn = 2.0 * np.pi * np.round((measurement - self._previous) / (2.0 * np.pi))
        measurement = measurement - np.where(self._angles, turn, 0.0)
        self._previous = measurement
        filtered, self._memory = signal.sosfilt(self._sections, measurement[None], axis=0, zi=self._memory)
        return filtered[0]
