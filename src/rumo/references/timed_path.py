"""A path driven by the clock: with stops, and in reverse, which no reference by place can have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, cast

import numpy as np

from rumo.checks import as_list, as_mapping, checked, finite_number, positive_number
from rumo.errors import ArgumentError
from rumo.references.base import OfTime
from rumo.references.motion import (
    Axled,
    Rolling,
    axle_motion,
    axle_signals,
    check_vehicle,
    checked_outputs,
    known_signals,
    motion,
    state_signals,
    wanted_signals,
)
from rumo.references.paths import Path
from rumo.references.speed_profile import SpeedProfile
from rumo.signals import Array

if TYPE_CHECKING:
    from rumo.problem import Problem

STANDING = 1e-6
"""Speed at which a vehicle is taken to stand [m/s]."""


@dataclass(frozen=True, eq=False)
class TimedPath(OfTime):
    """A path at a speed profile, each place at its time, wherever the vehicle is.

    It gives the `outputs` that are named, or, in a run, all that the controller's problem knows: p_x, p_y, psi (the
    path's tangent, not wrapped), v_x, omega, course (the direction of motion), speed, velocity_x and velocity_y, and
    with a vehicle what else there is of rolling along it, as `SinePath`.

    Parameters
    ----------
    path : Path
        To be driven.
    profile : SpeedProfile
        How fast where.
    vehicle : VehicleParameters, optional
        The car that is to drive it, or anything else that is `Rolling`.
    outputs : tuple of str, optional
        Which signals to give.
    pauses : mapping of float to float
        How long the vehicle stands at arc lengths where the profile's speed is 0 [m] -> [s].
    reverse : bool
        The vehicle drives the path backwards foremost: psi is the course and half a turn, v_x is negative.
    begin : float
        Arc length at which it is at time 0 [m].
    rear_axle : bool
        The path is that of the rear axle's middle, and not of the centre of gravity: in tight bends at walking speed a
        car can follow that exactly, forwards and in reverse. It needs a vehicle with `l_r`.
    """

    pointwise: ClassVar[bool] = True

    path: Path
    profile: SpeedProfile
    vehicle: Rolling | None = None
    outputs: tuple[str, ...] | None = None
    pauses: Mapping[float, float] = field(default_factory=dict[float, float])
    reverse: bool = False
    begin: float = 0.0
    rear_axle: bool = False
    _waits: tuple[tuple[float, float], ...] = field(init=False, repr=False)
    _names: tuple[str, ...] = field(init=False, repr=False)
    _first: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        profile = checked(self.profile, "profile", SpeedProfile)
        check_on(checked(self.path, "path", Path), profile)
        check_vehicle(self.vehicle)
        if self.rear_axle and not hasattr(self.vehicle, "l_r"):
            expected = "one that knows how far its centre of gravity is before its rear axle, l_r"
            raise ArgumentError("vehicle", repr(self.vehicle), expected, "Write rumo.vehicles.PASSENGER_CAR.")
        finite_number(self.begin, "begin")
        names = (
            state_signals(self.vehicle)
            if self.outputs is None
            else checked_outputs(self.outputs, self._known, self.vehicle)
        )
        object.__setattr__(self, "_names", names)
        pauses = as_mapping(self.pauses, "pauses")
        if pauses and profile.closed:
            raise ArgumentError("pauses", f"{pauses}", "none on a flying lap", "Make a profile with laps=...")
        for place, seconds in pauses.items():
            positive_number(seconds, f"pauses[{place!r}]")
            if profile.speed_at(finite_number(place, "pauses")) > STANDING:
                speed = f"a place that is passed at {profile.speed_at(place):.3g} m/s"
                raise ArgumentError(
                    f"pauses[{place!r}]", speed, "one with speed 0", "speed_profile(stops=...) has such."
                )
        waits = sorted((float(profile.time_at(place)), float(seconds)) for place, seconds in pauses.items())
        object.__setattr__(self, "_waits", tuple(waits))
        object.__setattr__(self, "_first", self._moving_to_clock(float(profile.time_at(self.begin))))

    @property
    def _known(self) -> tuple[str, ...]:
        return axle_signals(self.vehicle) if self.rear_axle else known_signals(self.vehicle)

    @property
    def duration(self) -> float:
        """From the profile's first station to its last, pauses included [s]."""
        return self.profile.duration + sum(seconds for _, seconds in self._waits)

    def time_at(self, station: float) -> float:
        """When an arc length is reached [s]."""
        return self._moving_to_clock(float(self.profile.time_at(station))) - self._first

    def start(self, problem: Problem) -> TimedPath:
        """The same with the signals that a problem knows, if none are named."""
        return self if self.outputs is not None else replace(self, outputs=wanted_signals(problem, self._known))

    def __call__(self, t: Array) -> dict[str, Array]:
        """Signals at times t (n,) [s]."""
        clock = np.asarray(t, dtype=float) + self._first
        moving, stood = clock, 0.0
        for at, seconds in self._waits:
            moving = moving - np.clip(clock - (at + stood), 0.0, seconds)
            stood += seconds
        s, speed, _ = self.profile.at_time(moving)
        for at, _ in self._waits:
            speed = np.where(moving == at, 0.0, speed)
        points = self.path.at(s)
        if self.rear_axle:
            signals = axle_motion(points, speed, cast("Axled", self.vehicle), self.reverse)
            return {name: signals[name] for name in self._names}
        return motion(s, points, speed, self.vehicle, self._names, self.reverse)

    def _moving_to_clock(self, moving: float) -> float:
        return moving + sum(seconds for at, seconds in self._waits if at < moving)


def check_on(path: Path, profile: SpeedProfile) -> None:
    """Raise if a profile cannot be one of a path."""
    length = profile.s[-1] - profile.s[0]
    if profile.closed and not (path.closed and abs(length - path.length) <= 1e-6 * path.length):
        kind = "a closed path" if path.closed else "an open path"
        raise ArgumentError(
            "profile", f"one of a lap of {length:.6g} m", f"one of this path, {kind} of {path.length:.6g} m"
        )


@dataclass(frozen=True, eq=False)
class Legs(OfTime):
    """One timed path after the other, such as forwards, and back into a parking space.

    Where one ends the next begins: place, direction of the vehicle, and speed are the caller's business.

    Parameters
    ----------
    legs : sequence of TimedPath
        At least one, all with the same signals. None but the last may be a flying lap.
    """

    pointwise: ClassVar[bool] = True

    legs: Sequence[TimedPath]
    _begins: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        legs = tuple(as_list(self.legs, "legs", "some of rumo.references.TimedPath"))
        for i, leg in enumerate(legs):
            checked(leg, f"legs[{i}]", TimedPath)
            if set(leg(np.zeros(1))) != set(legs[0](np.zeros(1))):
                raise ArgumentError(
                    f"legs[{i}]", "other signals than those of the first", "the same outputs and vehicle"
                )
        object.__setattr__(self, "legs", legs)
        object.__setattr__(self, "_begins", np.r_[0.0, np.cumsum([leg.duration for leg in legs[:-1]])])

    @property
    def duration(self) -> float:
        """Of all of them [s]."""
        return sum(leg.duration for leg in self.legs)

    def start(self, problem: Problem) -> Legs:
        """The same with the signals that a problem knows, see `TimedPath`."""
        return Legs(tuple(leg.start(problem) for leg in self.legs))

    def __call__(self, t: Array) -> dict[str, Array]:
        """Signals at times t (n,) [s]."""
        t = np.asarray(t, dtype=float)
        which = np.maximum(np.searchsorted(self._begins, t, side="right") - 1, 0)
        signals: dict[str, Array] = {}
        for i, leg in enumerate(self.legs):
            for name, values in leg(t - self._begins[i]).items():
                signals[name] = np.where(which == i, values, signals.get(name, values))
        return signals
