"""What a vehicle does that drives along a path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

import numpy as np

from rumo.checks import as_names
from rumo.errors import ArgumentError, UnknownNameError
from rumo.references.paths import PathPoints
from rumo.signals import Array

if TYPE_CHECKING:
    from rumo.problem import Problem

SIGNALS = ("p_x", "p_y", "psi", "course", "speed", "v_x", "omega")
"""Of every vehicle: position, where it points, where it moves to, how fast, and its speed ahead and rate of turning."""
VELOCITIES = ("velocity_x", "velocity_y")
"""Over ground: what to track where a vehicle stands, and has no course."""
BESIDE = ("s", "n", "heading_error", "course_error", "velocity_along", "velocity_across")
"""Of a vehicle that is known by its place beside the path: how far along it, and no error of any kind."""
STATES = ("p_x", "p_y", "psi", "v_x", "omega")
"""Those that are states of the car's models."""


class Rolling(Protocol):
    """A vehicle that knows its own motion along a curve."""

    def rolling(self, speed: Array, curvature: Array) -> Mapping[str, Array]:
        """Further states while it drives along a curvature [1/m] at a speed [m/s] without slip."""
        ...


class Axled(Rolling, Protocol):
    """One that knows how far its centre of gravity is before its rear axle."""

    @property
    def l_r(self) -> float:
        """[m]."""
        ...


def check_vehicle(vehicle: Rolling | None) -> None:
    """Raise for what is no vehicle."""
    if vehicle is not None and (isinstance(vehicle, type) or not hasattr(vehicle, "rolling")):
        raise ArgumentError("vehicle", repr(vehicle), "what knows its rolling, such as rumo.vehicles.PAPER_CAR")


def known_signals(vehicle: Rolling | None) -> tuple[str, ...]:
    """Names of all that `motion` gives."""
    return tuple(dict.fromkeys((*SIGNALS, *VELOCITIES, *BESIDE, *_further(vehicle))))


def state_signals(vehicle: Rolling | None) -> tuple[str, ...]:
    """Names of those that are states of the car's models by position."""
    return tuple(dict.fromkeys((*STATES, *_further(vehicle))))


def wanted_signals(problem: Problem, known: tuple[str, ...]) -> tuple[str, ...]:
    """Names of those known that a problem tracks, or that its model has as states or outputs."""
    model = problem.model
    wanted = {*problem.outputs, *model.states, *model.outputs}
    return tuple(name for name in known if name in wanted)


def _further(vehicle: Rolling | None) -> tuple[str, ...]:
    return () if vehicle is None else tuple(vehicle.rolling(np.ones(1), np.zeros(1)))


def checked_outputs(outputs: object, known: tuple[str, ...], vehicle: Rolling | None) -> tuple[str, ...]:
    """Names of signals, all of which are known."""
    names = as_names(outputs, "outputs")
    for name in names:
        if name not in known:
            cure = "" if vehicle is not None else "Further states of a car come with vehicle=..."
            raise UnknownNameError("outputs", name, known, cure)
    return names


def motion(
    s: Array,
    points: PathPoints,
    speed: Array,
    vehicle: Rolling | None,
    names: tuple[str, ...],
    reverse: bool = False,
) -> dict[str, Array]:
    """Signals (n,) of driving through points of a path, at arc lengths s (n,) [m], at speeds (n,) [m/s], slip aside.

    In reverse the vehicle moves along the path as well, but points the other way: psi is the course and half a turn,
    and v_x is negative. Several may be the same array.
    """
    ahead, bend, psi = _foremost(points, speed, reverse)
    none = np.zeros(speed.shape)
    known = {
        "p_x": points.x,
        "p_y": points.y,
        "psi": psi,
        "course": points.heading,
        "speed": speed,
        "v_x": ahead,
        "omega": speed * points.curvature,
        "s": s,
        "n": none,
        "heading_error": none + np.pi if reverse else none,
        "course_error": none,
        "velocity_along": speed,
        "velocity_across": none,
    }
    if "velocity_x" in names or "velocity_y" in names:
        known |= {"velocity_x": speed * np.cos(points.heading), "velocity_y": speed * np.sin(points.heading)}
    further = {} if vehicle is None or known.keys() >= {*names} else vehicle.rolling(ahead, bend)
    return {name: _own(further[name]) if name in further else known[name] for name in names}


def axle_signals(vehicle: Rolling | None) -> tuple[str, ...]:
    """Names of all that `axle_motion` gives."""
    return tuple(name for name in known_signals(vehicle) if name not in BESIDE)


def axle_motion(points: PathPoints, speed: Array, vehicle: Axled, reverse: bool = False) -> dict[str, Array]:
    """Signals (n,) of a car whose rear axle's middle is at points of a path, at speeds (n,) [m/s], without slip.

    The axle has no sideslip, so the car points along the tangent, or backwards; its centre of gravity is `l_r` before
    the axle, and moves aside while the car turns. Exact for any curvature.
    """
    ahead, bend, psi = _foremost(points, speed, reverse)
    cos, sin, aside = np.cos(psi), np.sin(psi), vehicle.l_r * bend
    return {
        "p_x": points.x + vehicle.l_r * cos,
        "p_y": points.y + vehicle.l_r * sin,
        "psi": psi,
        "course": points.heading + np.arctan(aside),
        "speed": speed * np.hypot(1.0, aside),
        "v_x": ahead,
        "omega": ahead * bend,
        "velocity_x": ahead * (cos - aside * sin),
        "velocity_y": ahead * (sin + aside * cos),
        **_rolling(vehicle, ahead, bend),
    }


def _foremost(points: PathPoints, speed: Array, reverse: bool) -> tuple[Array, Array, Array]:
    """Speed ahead, curvature and heading (n,) each, as a vehicle has them that points along the path, or backwards."""
    if reverse:
        return -speed, -points.curvature, points.heading + np.pi
    return speed, points.curvature, points.heading


def _rolling(vehicle: Rolling, ahead: Array, bend: Array) -> dict[str, Array]:
    """Copies of what the vehicle says: its arrays are its own."""
    return {name: _own(values) for name, values in vehicle.rolling(ahead, bend).items()}


def _own(values: Array) -> Array:
    return np.array(values, dtype=float)
