"""What watches a loop: how late it really is."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

import numpy as np

from rumo.actuation import Actuation
from rumo.estimation import DelayMonitor
from rumo.signals import Array, NamedArray, Signals, read_only

logger = logging.getLogger("rumo")


@dataclass(frozen=True)
class DelayWatch:
    """Finds, while driving, how late the response to an input's commands is: a `DelayMonitor` in the loop.

    Parameters
    ----------
    command : str
        The input.
    response : str
        What is measured of it.
    integral : bool
        The response is the integral of the input, as a steering angle is of its rate: such are compared without
        derivatives of noise, and to fractions of a sample.
    window : int
        Samples that are compared; as many answers are judged together.
    longest, least_correlation
        See `DelayMonitor`.
    """

    command: str
    response: str
    integral: bool = False
    window: int = 200
    longest: int = 20
    least_correlation: float = 0.7

    def monitor(self, sampling_time: float) -> DelayMonitor:
        """One without memory; raises if a number cannot work."""
        return DelayMonitor(
            sampling_time, window=self.window, longest=self.longest, least_correlation=self.least_correlation
        )


class Monitors:
    """Watches at work.

    Parameters
    ----------
    watches : mapping of str to DelayWatch
        By name.
    believed : Actuation
        By the controller.
    inputs, measured : Signals
        Of the controller's model, and of the sensors.
    late : ndarray, shape (m,)
        Samples that each measurement needs to arrive.
    sampling_time : float
        [s].

    Attributes
    ----------
    expected : dict of str to float
        What each would find if the controller were right: computation, dead time, lag, and lateness of the sensor [s].

    Raises
    ------
    UnknownNameError
        If there is no such input, or no such measurement.
    """

    def __init__(
        self,
        watches: Mapping[str, DelayWatch],
        believed: Actuation,
        inputs: Signals,
        measured: Signals,
        late: Array,
        sampling_time: float,
    ) -> None:
        self._watches, self._dt = watches, sampling_time
        self.signals = Signals(dict.fromkeys(watches, "s"), "monitors")
        self._nothing: NamedArray[float] = NamedArray(self.signals, read_only(np.empty(len(watches))))
        self._inputs = [inputs.index(watch.command, f"monitors[{n!r}].command") for n, watch in watches.items()]
        self._rows = [measured.index(watch.response, f"monitors[{n!r}].response") for n, watch in watches.items()]
        delays = believed.delays(inputs)
        self.expected = {
            name: float(delays[i] + believed.of(watch.command).lag + late[j] * sampling_time)
            for (name, watch), i, j in zip(watches.items(), self._inputs, self._rows, strict=True)
        }
        self.reset(np.zeros(len(inputs)))

    def reset(self, first: Array) -> None:
        """Begin a run, with an input (nu,) before it."""
        self._monitors = [watch.monitor(self._dt) for watch in self._watches.values()]
        self._command, self._sum = first, np.zeros(len(first))
        self._recent = {name: deque[float](maxlen=watch.window) for name, watch in self._watches.items()}
        self._said: set[str] = set()

    def update(self, time: float, command: Array | None, received: Array) -> NamedArray[float]:
        """Delays found [s], NaN where not known, from the command (nu,) and the measurements (m,) of a sample.

        None for a sample at which nothing is computed.
        """
        if not self._monitors:
            return self._nothing
        found = np.full(len(self._monitors), np.nan)
        self._command = self._command if command is None else command
        parts = zip(self._watches.items(), self._monitors, self._inputs, self._rows, strict=True)
        for n, ((name, watch), monitor, i, row) in enumerate(parts):
            given = self._sum[i] if watch.integral else self._command[i]
            found[n] = monitor.update(float(given), float(received[row]))
            self._judge(name, watch, time, float(found[n]))
        self._sum = self._sum + self._dt * self._command
        return NamedArray(self.signals, read_only(found))

    def _judge(self, name: str, watch: DelayWatch, time: float, found: float) -> None:
        """Say once where the median of recent answers is off by more than a sample."""
        expected, recent = self.expected[name], self._recent[name]
        recent.append(found)
        known = [value for value in recent if isfinite(value)]
        if name in self._said or 2 * len(known) <= watch.window:
            return
        usual = float(np.median(known))
        if abs(usual - expected) > self._dt:
            self._said.add(name)
            logger.warning(
                "%s: at %.2f s, %s follows the commands of %s by %.3f s, not by the %.3f s that are believed.",
                name,
                time,
                watch.response,
                watch.command,
                usual,
                expected,
            )
