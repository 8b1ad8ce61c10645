"""What a vehicle does that drives along a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from rumo.checks import as_names
from rumo.errors import ArgumentError, UnknownNameError
from rumo.references.paths import PathPoints
from rumo.signals import Array

SIGNALS = ("p_x", "p_y", "psi", "course", "speed", "v_x", "omega")
"""Of every vehicle: position, where it points, where it moves to, how fast, and its speed ahead and rate of turning."""
STATES = ("p_x", "p_y", "psi", "v_x", "omega")
"""Those that are states of the car's models."""


class Rolling(Protocol):
    """A vehicle that knows its own motion along a curve."""

    def rolling(self, speed: Array, curvature: Array) -> Mapping[str, Array]:
        """Further states while it drives along a curvature [1/m] at a speed [m/s] without slip."""
        ...


def check_vehicle(vehicle: Rolling | None) -> None:
    """Raise for what is no vehicle."""
    if vehicle is not None and (isinstance(vehicle, type) or not hasattr(vehicle, "rolling")):
        raise ArgumentError("vehicle", repr(vehicle), "what knows its rolling, such as rumo.vehicles.PAPER_CAR")


def known_signals(vehicle: Rolling | None) -> tuple[str, ...]:
    """Names of all that `motion` gives."""
    further = () if vehicle is None else tuple(vehicle.rolling(np.ones(1), np.zeros(1)))
    return (*SIGNALS, *(name for name in further if name not in SIGNALS))


def checked_outputs(outputs: object, vehicle: Rolling | None) -> tuple[str, ...]:
    """Names of signals, all of which `motion` gives."""
    names, known = as_names(outputs, "outputs"), known_signals(vehicle)
    for name in names:
        if name not in known:
            cure = "" if vehicle is not None else "Further states of a car come with vehicle=..."
            raise UnknownNameError("outputs", name, known, cure)
    return names


def motion(points: PathPoints, speed: Array, vehicle: Rolling | None, reverse: bool = False) -> dict[str, Array]:
    """Signals (n,) of driving through points of a path at speeds (n,) [m/s], slip aside.

    In reverse the vehicle moves along the path as well, but points the other way: psi is the course and half a turn,
    and v_x is negative.
    """
    ahead, bend, psi = speed, points.curvature, points.heading
    if reverse:
        ahead, bend, psi = -speed, -bend, psi + np.pi
    signals = {
        "p_x": points.x,
        "p_y": points.y,
        "psi": psi,
        "course": points.heading,
        "speed": speed,
        "v_x": ahead,
        "omega": speed * points.curvature,
    }
    return signals if vehicle is None else signals | dict(vehicle.rolling(ahead, bend))
