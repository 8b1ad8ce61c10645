"""A road by its curvature, driven at a speed that may change along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from rumo.checks import as_numbers, finite_number
from rumo.errors import ArgumentError
from rumo.references.base import OfTime
from rumo.references.clothoids import check_at_stations, checked_curvature
from rumo.references.motion import Rolling, check_vehicle
from rumo.references.paths import Path
from rumo.references.speed_profile import SpeedProfile
from rumo.references.timed_path import TimedPath
from rumo.signals import Array


@dataclass(frozen=True)
class Road(OfTime):
    """A road whose curvature is linear between stations (clothoids), and that is straight beyond its ends.

    Gives p_x, p_y, psi (the road's tangent, not wrapped), v_x and omega; with a vehicle also what else there is of
    rolling along it, as `SinePath`. The road begins at the origin, along +x.

    Parameters
    ----------
    stations : sequence of float, (n,)
        Arc lengths, increasing [m].
    curvature : sequence of float, (n,)
        At the stations [1/m]; positive to the left.
    speed : float or sequence of float, (n,)
        At the stations [m/s]; the acceleration between them is constant.
    vehicle : VehicleParameters, optional
        The car that is to drive it, or anything else that is `Rolling`.
    start : float
        Arc length at which it begins at time 0 [m], the first station's if not given.
    """

    pointwise: ClassVar[bool] = True

    stations: Sequence[float]
    curvature: Sequence[float]
    speed: float | Sequence[float]
    vehicle: Rolling | None = None
    start: float | None = None
    _driven: TimedPath = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        s, curvature = checked_curvature(self.stations, self.curvature)
        speed = as_numbers(self.speed, "speed")
        if speed.ndim:
            check_at_stations(speed, s, "speed")
        if not ((speed > 0.0) & (speed < np.inf)).all():
            raise ArgumentError("speed", repr(self.speed), "positive finite numbers [m/s]")
        check_vehicle(self.vehicle)
        start = float(s[0]) if self.start is None else finite_number(self.start, "start")
        path, profile = Path.from_curvature(s, curvature), SpeedProfile(s - s[0], np.broadcast_to(speed, s.shape))
        object.__setattr__(self, "_driven", TimedPath(path, profile, self.vehicle, begin=start - float(s[0])))

    @property
    def path(self) -> Path:
        """The road without its speeds; its arc lengths begin with 0 at the first station."""
        return self._driven.path

    def time_at(self, station: float) -> float:
        """When an arc length is reached [s]."""
        return self._driven.time_at(station - self.stations[0])

    def __call__(self, t: Array) -> dict[str, Array]:
        """Reference at times t (n,) [s]."""
        return self._driven(t)
