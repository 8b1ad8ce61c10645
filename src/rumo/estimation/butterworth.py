"""Low-pass filter on every measured signal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from rumo.checks import whole_number
from rumo.discretization import Discretization
from rumo.errors import ArgumentError
from rumo.estimation.base import Estimate, state_columns
from rumo.measurements import TURN
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
    """A filter with memory; it starts at the first finite sample, in steady state.

    SciPy's `sosfilt` computes the same of a whole signal; for one sample, what it checks takes longer than this.
    """

    def __init__(self, sections: Array, angles: np.ndarray, columns: list[int]) -> None:
        from scipy.signal import sosfilt_zi

        count, steady = len(columns), np.asarray(sosfilt_zi(sections))
        # Rows (nx,): NumPy takes longer for products with single numbers.
        self._sections = [tuple(np.full(count, value) for value in section) for section in np.delete(sections, 3, 1)]
        self._steady = [(first, second) for first, second in steady.tolist()]
        self._angles = np.flatnonzero(angles).tolist()
        self._columns = np.array(columns)
        self._memory: list[tuple[Array, Array]] = []
        self._previous: list[float] = []

    def update(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        """Filter a sample (m,). States with NaN or infinity among them pass through and leave the memory as it was."""
        states = np.asarray(measured, dtype=float)[self._columns]
        now = states.tolist()
        if not all(map(isfinite, now)):
            return Estimate(states)
        if not self._memory:
            self._previous = now
            self._memory = [(first * states, second * states) for first, second in self._steady]
        for i in self._angles:
            turns = (now[i] - self._previous[i]) / TURN
            if abs(turns) > 0.5:
                states[i] -= TURN * np.round(turns)
                now[i] = states.item(i)
        self._previous = now
        return Estimate(self._filtered(states))

    def _filtered(self, values: Array) -> Array:
        """Sections of second order, one after the other: the transposed direct form II."""
        for i, (b0, b1, b2, a1, a2) in enumerate(self._sections):
            first, second = self._memory[i]
            filtered = b0 * values + first
            self._memory[i] = b1 * values - a1 * filtered + second, b2 * values - a2 * filtered
            values = filtered
        return values
