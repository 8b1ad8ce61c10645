"""What an actuator makes of its command between two samples, in closed form."""

from __future__ import annotations

from math import ceil, copysign, exp, expm1

from rumo.actuation import Actuator

RESOLUTION = 8
"""Pieces of a lag, and of a sample, in which the mean of a moving actuator stands for its motion."""
MOST = 64
"""Pieces of a sample, however short the lag."""


class Channel:
    """One actuator behind its dead time: `y' = (command - y) / lag`, within its rate.

    Attributes
    ----------
    value : float
        What it does now, y.
    """

    def __init__(self, actuator: Actuator, value: float) -> None:
        self._lag, self._rate, self._at_once = actuator.lag, actuator.rate, actuator.follows_at_once
        self.value = value

    def pieces(self, command: float, share: float, sampling_time: float) -> int:
        """In how many pieces a share of a sample is to be taken."""
        if self._at_once or self.value == command:
            return 1
        longest = min(self._lag / sampling_time, 1.0) if self._lag > 0.0 else 1.0
        return ceil(share * min(RESOLUTION / longest, MOST))

    def go(self, command: float, duration: float) -> float:
        """Mean over a duration [s] with this command; the value is that at its end afterwards.

        While the lag asks for more than the rate, y moves straight on; what is left then decays.
        """
        if self._at_once or duration <= 0.0:
            self.value = command if self._at_once else self.value
            return self.value
        left = command - self.value
        straight = min(max(abs(left) / self._rate - self._lag, 0.0), duration)
        moved = copysign(self._rate * straight, left) if straight > 0.0 else 0.0
        area = (self.value + 0.5 * moved) * straight
        left, rest = left - moved, duration - straight
        if rest > 0.0:
            # With no lag, nothing is left after the straight part.
            decay, lasting = (
                (exp(-rest / self._lag), -self._lag * expm1(-rest / self._lag)) if self._lag else (0.0, 0.0)
            )
            area += command * rest - left * lasting
            left *= decay
        self.value = command - left
        return area / duration
