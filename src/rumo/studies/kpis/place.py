"""Where the car was: laps, deviations from path, point and speed, and the edges of the track."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rumo.signals import Array
from rumo.simulation.log import names, signal
from rumo.studies.kpis.base import Kpi, largest, rms, spread, table
from rumo.studies.kpis.driven import Driven

if TYPE_CHECKING:
    import xarray as xr

SETTLED = 2.0
"""Errors "after 2 s" leave out the approach from the initial error [s]."""


def tracking_error(log: xr.Dataset) -> Array:
    """Distance of the plant from the reference point at each sample of a log (K,) [m]."""
    return np.hypot(
        signal(log, "plant", "p_x") - signal(log, "reference", "p_x"),
        signal(log, "plant", "p_y") - signal(log, "reference", "p_y"),
    )


def heading_error(log: xr.Dataset) -> Array:
    """Heading of the plant less the reference's at each sample of a log (K,), full turns included [rad]."""
    return signal(log, "plant", "psi") - signal(log, "reference", "psi")


def _error(drive: Driven) -> Array | None:
    points = {"p_x", "p_y"}
    known = points <= {*names(drive.log, "plant_state")} and points <= {*names(drive.log, "output")}
    return tracking_error(drive.log) if known else None


def _settled(drive: Driven) -> Array | None:
    error = _error(drive)
    return None if error is None else error[drive.time >= SETTLED]


def _lap_time(drive: Driven) -> float | None:
    return min(drive.laps, default=None)


def _profile_time(drive: Driven) -> float | None:
    if drive.profile is None:
        return None
    if drive.profile.closed or drive.path is None:
        return drive.profile.duration
    return float(drive.profile.time_at(drive.path.length) - drive.profile.time_at(drive.begin))


def _over_profile(drive: Driven) -> float | None:
    lap, profile = _lap_time(drive), _profile_time(drive)
    return None if lap is None or profile is None else 100.0 * (lap / profile - 1.0)


def _distance(drive: Driven) -> float | None:
    progress = drive.deviations.get("progress")
    return None if progress is None else float(np.nanmax(progress, initial=drive.begin) - drive.begin)


def _off_track(drive: Driven) -> float | None:
    return None if drive.room is None else drive.sampling_time * int((drive.room < 0.0).sum())


def _least_room(drive: Driven) -> float | None:
    return None if drive.room is None else float(np.nanmin(drive.room))


POINT = table(
    [
        Kpi(
            "tracking_error_rms",
            "RMS error",
            "m",
            "Distance of the car from the reference point, root mean square.",
            lambda d: rms(_error(d)),
        ),
        Kpi(
            "tracking_error_rms_after_2s",
            "RMS error after 2 s",
            "m",
            "Distance from the reference point without the first 2 s, root mean square; none if the drive is shorter.",
            lambda d: rms(_settled(d)),
        ),
        Kpi(
            "tracking_error_max_after_2s",
            "Largest error after 2 s",
            "m",
            "Largest distance from the reference point after 2 s.",
            lambda d: largest(_settled(d)),
        ),
    ]
)
"""Of drives after a point that moves on."""

PLACE = table(
    [
        Kpi(
            "lap_time",
            "Lap time",
            "s",
            "Time of the fastest lap; on an open path, from its beginning to its end.",
            _lap_time,
        ),
        Kpi(
            "profile_time",
            "Lap time of the speed profile",
            "s",
            "Time of a lap by the speed profile.",
            _profile_time,
            "",
        ),
        Kpi(
            "lap_time_over_profile",
            "Lap time over the profile's",
            "%",
            "By how much the fastest lap took longer than the profile's.",
            _over_profile,
        ),
        Kpi("distance", "Distance along the path", "m", "How far the car got along the path.", _distance, "more"),
        *spread(
            "lateral_deviation",
            "Lateral deviation",
            "m",
            "the distance to the left of the path",
            lambda d: d.deviations.get("lateral_deviation"),
        ),
        *spread(
            "yaw_deviation",
            "Yaw deviation",
            "rad",
            "the heading from the path's tangent",
            lambda d: d.deviations.get("yaw_deviation"),
        ),
        Kpi(
            "speed_deviation_rms",
            "Speed deviation, RMS",
            "m/s",
            "Root mean square of the speed less the profile's at the car's place.",
            lambda d: rms(d.deviations.get("speed_deviation")),
        ),
        Kpi(
            "time_off_track",
            "Time off track",
            "s",
            "Time with any part of the car beyond an edge of the track.",
            _off_track,
        ),
        Kpi(
            "least_room",
            "Least room to the edge",
            "m",
            "Least distance from the car's outline to an edge of the track; negative beyond it.",
            _least_room,
            "more",
        ),
    ]
)
"""Of drives along a path."""
