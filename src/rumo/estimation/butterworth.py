"""Low-pass filter on every measured signal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rumo.checks import whole_number
from rumo.discretization import Discretization
from rumo.errors import ArgumentError
from rumo.estimation.base import Estimate, state_columns
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

    def start(
        self,
        problem: Problem,
        measured: Sequence[str] | None = None,
        discretization: Discretization | None = None,
    ) -> RunningButterworth:
        """Return a filter for the states of the problem's model, all measured; the problem's angles are unwrapped."""
        nyquist = 0.5 / problem.sampling_time
        cutoff = self.cutoff
        if not isinstance(cutoff, int | float | np.number) or not 0.0 < cutoff < nyquist:
            raise ArgumentError("cutoff", f"{cutoff} Hz", f"a frequency between 0 and {nyquist:g} Hz")
        whole_number(self.order, "order", 1)
        from scipy import signal  # takes longer to import than all the rest of a study

        sections = signal.butter(self.order, self.cutoff, fs=2.0 * nyquist, output="sos")
        columns = state_columns(problem.model, measured)
        return RunningButterworth(np.asarray(sections), problem.sensors.turn > 0.0, columns)


class RunningButterworth:
    """A filter with memory; it starts at the first finite sample, in steady state."""

    def __init__(self, sections: Array, angles: np.ndarray, columns: list[int]) -> None:
        from scipy.signal import sosfilt, sosfilt_zi

        self._sections, self._steady, self._filter = sections, np.asarray(sosfilt_zi(sections)), sosfilt
        self._angles = angles
        self._columns = columns
        self._memory: Array | None = None
        self._previous: Array | None = None

    def update(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        """Filter a sample (m,). States with NaN or infinity among them pass through and leave the memory as it was."""
        states = np.asarray(measured, dtype=float)[self._columns]
        if not np.isfinite(states).all():
            return Estimate(states)
        if self._previous is None or self._memory is None:
            self._previous = states
            self._memory = self._steady[:, :, None] * states
        turn = 2.0 * np.pi * np.round((states - self._previous) / (2.0 * np.pi))
        states = states - np.where(self._angles, turn, 0.0)
        self._previous = states
        filtered, self._memory = self._filter(self._sections, states[None], axis=0, zi=self._memory)
        return Estimate(filtered[0])
