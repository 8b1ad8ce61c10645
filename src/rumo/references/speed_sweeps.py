"""Sweeps along a path: up to what driving reaches from station to station, down to what braking comes from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf, sqrt
from typing import TYPE_CHECKING

import numpy as np

from rumo.signals import Array

if TYPE_CHECKING:
    from rumo.references.speed_limits import SpeedLimits

LAPS = 50
"""Sweeps around a closed path; one is enough, but for a top speed that drag does not let the car reach."""


def around(cap: Array, bends: Array, gaps: Array, limits: SpeedLimits, share: Array) -> Array:
    """Squared speeds of a flying lap: laps until one ends as fast as it began."""
    cap = cap.copy()
    for _ in range(LAPS):
        w = there_and_back(cap, bends, gaps, limits, share)
        settled = abs(w[0] - w[-1]) <= 1e-12 * limits.top**2
        cap[0] = cap[-1] = min(w[0], w[-1])
        if settled:
            break
    w = there_and_back(cap, bends, gaps, limits, share)
    w[0] = w[-1] = min(w[0], w[-1])
    return w


def there_and_back(cap: Array, bends: Array, gaps: Array, limits: SpeedLimits, share: Array) -> Array:
    """Squared speeds (n,) up to `cap` that driving reaches from station to station, and braking back from each."""
    lateral = bends / (limits.lateral * share)
    driving, braking = left(limits.driving_left), left(limits.braking_left)
    turning = interpolated((0.0, 0.0) if limits.resistance is None else limits.resistance)

    used, grip = lateral.tolist(), share.tolist()
    used_back, grip_back = used[::-1], grip[::-1]

    def push(i: int, w: float) -> float:
        most = limits.driving * grip[i] * driving(w * used[i])
        most = min(most, limits.power / sqrt(w)) if limits.power < inf and w > 0.0 else most
        return most - grip[i] ** 2 * turning(w * used[i])

    def brake(i: int, w: float) -> float:
        # What turning takes is no brake: a car that counts on it has all its tyres at their limits.
        return limits.braking * grip_back[i] * braking(w * used_back[i])

    w = _sweep(cap.tolist(), gaps.tolist(), push, -limits.drag)
    return np.array(_sweep(w[::-1], gaps[::-1].tolist(), brake, limits.drag)[::-1])


def held(limits: SpeedLimits) -> float:
    """Share of the lateral limit up to which turning takes no more than driving and braking together.

    Beyond, the car gets slower by more than the profile lets it brake, whatever it does.
    """
    if limits.resistance is None:
        return 1.0
    used = np.linspace(0.0, 1.0, 1001)
    there = [np.array([of(u) for u in used]) for of in map(left, (limits.braking_left, limits.driving_left))]
    taken = np.interp(used, np.linspace(0.0, 1.0, len(limits.resistance)), limits.resistance)
    beyond = taken > limits.braking * there[0] + limits.driving * there[1] + 1e-9
    return float(used[max(int(np.argmax(beyond)) - 1, 0)]) if beyond.any() else 1.0


def _ellipse(used: float) -> float:
    return sqrt(max(0.0, 1.0 - used * used))


def left(shares: tuple[float, ...] | None) -> Callable[[float], float]:
    """Share that is left along the path while a share across it is used."""
    return _ellipse if shares is None else interpolated(shares)


def interpolated(values: tuple[float, ...]) -> Callable[[float], float]:
    """Values at even places from 0 to 1, and between."""
    steps = len(values) - 1

    def value(used: float) -> float:
        place = min(used, 1.0) * steps
        i = min(int(place), steps - 1)
        return values[i] + (place - i) * (values[i + 1] - values[i])

    return value


def _sweep(w: list[float], gaps: Sequence[float], along: Callable[[int, float], float], drag: float) -> list[float]:
    """Squared speeds no higher than an acceleration leads to from the station before.

    Parameters
    ----------
    along : callable
        The acceleration by the number of a station and its squared speed, without drag.
    """
    for i, gap in enumerate(gaps):
        reached = w[i] + 2.0 * (along(i, w[i]) + drag * w[i]) * gap
        if reached < w[i + 1]:
            w[i + 1] = max(reached, 0.0)
    return w
