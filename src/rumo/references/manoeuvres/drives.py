"""Drives by the clock: the circle of ISO 4138, stop-and-go, and back into a parking space."""

from __future__ import annotations

import numpy as np

from rumo.checks import non_negative_number, positive_number, whole_number
from rumo.errors import ArgumentError
from rumo.references.fastest import speed_profile
from rumo.references.generators import Bend, bends, circle, straight
from rumo.references.motion import Rolling
from rumo.references.paths import Path
from rumo.references.speed_limits import SpeedLimits
from rumo.references.speed_profile import SpeedProfile
from rumo.references.timed_path import Legs, TimedPath

SLOW = SpeedLimits(lateral=1.0, braking=1.0, driving=0.8, top=1.5)
"""Of parking."""


def constant_radius(
    radius: float = 100.0, *, lateral: float = 8.0, start: float = 5.0, acceleration: float = 0.2, left: bool = True
) -> tuple[Path, SpeedProfile]:
    """A circle driven ever faster, slowly enough to be steady at any moment (ISO 4138, constant radius).

    Parameters
    ----------
    radius : float
        [m]
    lateral : float
        Acceleration across at the end [m/s^2].
    start : float
        Speed at the beginning [m/s].
    acceleration : float
        Along the circle [m/s^2].
    left : bool
        Which way round.

    Returns
    -------
    path, profile
        For `TimedPath` or `PathTracking`.
    """
    first, gain = positive_number(start, "start"), positive_number(acceleration, "acceleration")
    path = circle(radius, left=left)
    last = float(np.sqrt(positive_number(lateral, "lateral") * radius))
    if last <= first:
        raise ArgumentError("lateral", repr(lateral), f"more than {first**2 / radius:.3g} m/s^2, that of the start")
    return path, SpeedProfile((0.0, 0.5 * (last**2 - first**2) / gain), (first, last))


def stop_and_go(
    stops: int = 3,
    distance: float = 60.0,
    pause: float = 3.0,
    *,
    limits: SpeedLimits | None = None,
    vehicle: Rolling | None = None,
) -> TimedPath:
    """A straight with stops, from rest to rest.

    Parameters
    ----------
    stops : int
        How many there are, the last one at the end.
    distance : float
        From stop to stop [m].
    pause : float
        How long the vehicle stands at each, and before it starts [s].
    limits : SpeedLimits, optional
        Of comfort, up to 14 m/s, if not given.
    vehicle : VehicleParameters, optional
        See `TimedPath`.
    """
    n, gap = whole_number(stops, "stops", 1), positive_number(distance, "distance")
    path = straight(n * gap)
    places = [i * gap for i in range(1, n)]
    profile = speed_profile(path, limits or SpeedLimits.comfort(top=14.0), start=0.0, end=0.0, stops=places)
    wait = positive_number(pause, "pause")
    return TimedPath(path, profile, vehicle, pauses=dict.fromkeys((0.0, *places, path.length), wait))


def reverse_parking(
    radius: float = 6.0,
    clothoid: float = 3.0,
    pause: float = 1.5,
    *,
    limits: SpeedLimits = SLOW,
    vehicle: Rolling | None = None,
) -> Legs:
    """Past a parking space on the right, and backwards into it, at a right angle to the road.

    Parameters
    ----------
    radius, clothoid : float
        Of the bend that is driven backwards [m].
    pause : float
        Standing before each of both legs, and at the end [s].
    limits : SpeedLimits
        Of both.
    vehicle : VehicleParameters, optional
        Whose rear axle drives the path, see `TimedPath`; the path is that of the centre of gravity without.
    """
    wait = non_negative_number(pause, "pause")
    past = straight(3.0 * radius)
    shape = bends([1.0, Bend(radius, 0.5 * np.pi, clothoid), 4.0])
    # Backwards the course points to -x; it is counted down from 0, so that the vehicle's own heading goes on from 0.
    kappa = shape.at(shape.nodes).curvature
    back = Path.from_curvature(shape.nodes, kappa, start=(past.length, 0.0, -np.pi))

    def leg(path: Path, reverse: bool) -> TimedPath:
        profile = speed_profile(path, limits, start=0.0, end=0.0, spacing=0.05)
        pauses = dict.fromkeys((0.0, *((path.length,) if reverse else ())), wait) if wait else {}
        return TimedPath(path, profile, vehicle, pauses=pauses, reverse=reverse, rear_axle=vehicle is not None)

    return Legs((leg(past, False), leg(back, True)))
