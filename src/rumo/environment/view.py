"""What a driver is told: where the car is beside the path, how it moves, what is decided, and what lies ahead."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np

from rumo.environment.place import Place
from rumo.errors import ArgumentError
from rumo.references import PathTracking, Track
from rumo.signals import Array, NamedArray, Signals
from rumo.simulation import ClosedLoop

RANGES = {"m/s": 100.0, "rad/s": 1e3, "rad": pi}
"""Sizes by unit within which states are shown."""
LARGE = 1e6
"""The same for other units."""


class View:
    """The observation of an environment.

    Parameters
    ----------
    loop : ClosedLoop
        Of the environment.
    track : Track
        That is driven.
    reference : PathTracking
        Path and speeds.
    ahead : sequence of float
        Distances along the path at which it is seen [m].

    Attributes
    ----------
    signals : Signals
        Names and units of what is observed: lateral_deviation, yaw_deviation, states of the observed model but for
        position and heading, inputs decided before (the last one is the newest), curvatures and speeds of the profile
        ahead.
    low, high : ndarray
        Bounds of each.
    """

    def __init__(self, loop: ClosedLoop, track: Track, reference: PathTracking, ahead: Sequence[float]) -> None:
        problem, states = loop.controller.problem, loop.observed.states
        for name in (*reference.position, "psi"):
            if name not in states:
                raise ArgumentError("scenario", f"one that observes no {name}", "a car whose position is observed")
        self._reference, self._ahead = reference, np.asarray(ahead, dtype=float)
        path, profile = reference.path, reference.profile
        widest = max(np.abs(side).max() for side in track.limits(path.nodes))
        sharpest = np.abs(path.at(path.nodes).curvature).max()
        own = [name for name in states if name not in (*reference.position, "psi")]
        self._own = [states.index(name) for name in own]
        shown: dict[str, tuple[str, float, float]] = {
            "lateral_deviation": ("m", -2.0 * widest, 2.0 * widest),
            "yaw_deviation": ("rad", -pi, pi),
        }
        for name in own:
            size = RANGES.get(states.unit(name), LARGE)
            shown[name] = (states.unit(name), -size, size)
        for row in range(max(problem.delay, 1)):
            for name, low, high in zip(problem.model.inputs, problem.input_lower, problem.input_upper, strict=True):
                shown[f"{name}_{row}"] = (problem.model.inputs.unit(name), low, high)
        shown |= {f"curvature_{i}": ("1/m", -2.0 * sharpest - 1e-3, 2.0 * sharpest + 1e-3) for i in range(len(ahead))}
        shown |= {f"speed_{i}": ("m/s", 0.0, 1.1 * profile.v.max()) for i in range(len(ahead))}
        self.signals = Signals({name: unit for name, (unit, _, _) in shown.items()}, "observation")
        self.low, self.high = (np.array([values[i] for values in shown.values()], dtype=np.float32) for i in (1, 2))

    def of(self, x: NamedArray[float], decided: Array, s: float, place: Place) -> Array:
        """Observation (n,) of an estimated state, inputs decided before (max(delay, 1), nu), and an arc length [m]."""
        there = s + self._ahead
        seen = [
            *place.beside(x, s),
            *x.values[self._own],
            *decided.ravel(),
            *self._reference.path.at(there).curvature,
            *self._reference.profile.speed_at(there),
        ]
        return np.clip(np.array(seen, dtype=np.float32), self.low, self.high)
