"""How late a response follows its command, as seen while driving."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from rumo.checks import finite_number, positive_number, whole_number
from rumo.errors import ArgumentError
from rumo.signals import Array


class DelayMonitor:
    """Delay between a command and its response, by cross-correlation over a sliding window.

    Both are signals of the same kind: an angle commanded and measured, or a rate and a rate. What is found is all that
    lies between them: transport, computation, actuator lag. A parabola through the largest correlation and its
    neighbours gives fractions of a sample (Jacovitti, Scarano, 1993).

    Parameters
    ----------
    sampling_time : float
        [s].
    window : int
        Samples of the response that are compared.
    longest : int
        Samples that the delay may be.
    least_correlation : float
        Below which there is no answer: too little happens, or something else.

    Attributes
    ----------
    delay : float
        Of the last update [s], NaN where it is not known.
    correlation : float
        At this delay, -1 to 1; NaN where nothing can be compared.
    """

    def __init__(
        self, sampling_time: float, *, window: int = 100, longest: int = 20, least_correlation: float = 0.7
    ) -> None:
        self._dt = positive_number(sampling_time, "sampling_time")
        self._window, self._longest = whole_number(window, "window", 10), whole_number(longest, "longest", 1)
        self._least = finite_number(least_correlation, "least_correlation")
        if not 0.0 < self._least <= 1.0:
            raise ArgumentError("least_correlation", f"{self._least:g}", "a number above 0, at most 1")
        # A response is compared once the next command is known: a parabola needs neighbours on both sides.
        self._commands = np.full(self._window + self._longest + 1, np.nan)
        self._responses = np.full(self._window, np.nan)
        self.delay = self.correlation = float("nan")

    def update(self, command: float, response: float) -> float:
        """The delay [s], from a sample more; NaN while it is not known.

        Parameters
        ----------
        command : float
            Given at this sample.
        response : float
            Measured at this sample; NaN where it is missing.
        """
        self._commands = np.append(self._commands[1:], command)
        correlations = self._correlations()
        self._responses = np.append(self._responses[1:], response)
        self.delay = self.correlation = float("nan")
        if np.isnan(correlations).all():
            return self.delay
        best = int(np.nanargmax(correlations))
        self.correlation = float(correlations[best])
        if self.correlation >= self._least and best <= self._longest:
            lag = best - 1 + _vertex(correlations[max(best - 1, 0) : best + 2])
            self.delay = self._dt * max(lag, 0.0)
        return self.delay

    def _correlations(self) -> Array:
        """Of the response with the command one sample later, and each number of samples before (longest + 2,)."""
        before = sliding_window_view(self._commands, self._window)[::-1]
        known = np.isfinite(before) & np.isfinite(self._responses)
        count = np.maximum(known.sum(axis=1, keepdims=True), 1)
        whole = known.all(axis=1) | (2 * count[:, 0] > self._window)
        x, y = (np.where(known, signal, 0.0) for signal in (before, self._responses))
        x, y = (np.where(known, signal - signal.sum(axis=1, keepdims=True) / count, 0.0) for signal in (x, y))
        sizes = np.sqrt((x**2).sum(axis=1) * (y**2).sum(axis=1))
        enough = whole & (sizes > 0.0)
        return np.where(enough, (x * y).sum(axis=1) / np.where(enough, sizes, 1.0), np.nan)


def _vertex(around: Array) -> float:
    """Where the parabola through three values is highest, from the one in the middle; 0 where there are not three."""
    if len(around) < 3 or not np.isfinite(around).all():
        return 0.0
    bend = around[0] - 2.0 * around[1] + around[2]
    return float(0.5 * (around[0] - around[2]) / bend) if bend < 0.0 else 0.0
