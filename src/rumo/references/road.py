"""A road by its curvature, driven at a speed that may change along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rumo.checks import as_numbers, finite_number, positive_number
from rumo.errors import ArgumentError, ShapeError
from rumo.references.base import OfTime
from rumo.references.sine_path import Rolling, check_vehicle
from rumo.signals import Array

LONGEST = 1.0
"""Piece of a road that is integrated in one go [m]."""
NODES, SHARES = np.polynomial.legendre.leggauss(4)


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

    stations: Sequence[float]
    curvature: Sequence[float]
    speed: float | Sequence[float]
    vehicle: Rolling | None = None
    start: float | None = None
    _pieces: _Pieces = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        s, curvature = _checked(self.stations, self.curvature)
        speed = as_numbers(self.speed, "speed")
        if speed.ndim:
            _check_shape(speed, s, "speed")
        if not ((speed > 0.0) & (speed < np.inf)).all():
            raise ArgumentError("speed", repr(self.speed), "positive finite numbers [m/s]")
        check_vehicle(self.vehicle)
        start = float(s[0]) if self.start is None else finite_number(self.start, "start")
        object.__setattr__(self, "_pieces", _Pieces(s, curvature, np.broadcast_to(speed, s.shape), start))

    def time_at(self, station: float) -> float:
        """When an arc length is reached [s]."""
        return self._pieces.time_at(station)

    def __call__(self, t: Array) -> dict[str, Array]:
        """Reference at times t (n,) [s]."""
        (p_x, p_y, psi), curvature, speed = self._pieces.at(np.asarray(t, dtype=float))
        reference = {"p_x": p_x, "p_y": p_y, "psi": psi, "v_x": speed, "omega": speed * curvature}
        return reference if self.vehicle is None else reference | dict(self.vehicle.rolling(speed, curvature))


class _Pieces:
    """Short pieces of a road, each from a time on: the first before its beginning, the last after its end."""

    def __init__(self, stations: Array, curvature: Array, speed: Array, start: float) -> None:
        counts = np.ceil(np.diff(stations) / LONGEST).astype(int)
        starts = [np.linspace(a, b, n, False) for a, b, n in zip(stations[:-1], stations[1:], counts, strict=True)]
        s = np.concatenate([*starts, stations[-1:]])
        length, kappa = np.diff(s), np.interp(s, stations, curvature)
        v_squared = np.interp(s, stations, speed**2)
        v = np.sqrt(v_squared)
        self.station, self.time = s, np.r_[0.0, np.cumsum(2.0 * length / (v[:-1] + v[1:]))]
        # At the beginning of each piece; the one before the road begins at its end.
        first = np.r_[0, np.arange(len(s))]
        self.speed, self.acceleration = v[first], np.r_[0.0, 0.5 * np.diff(v_squared) / length, 0.0]
        self.curvature, self.sharpness = kappa[first], np.r_[0.0, np.diff(kappa) / length, 0.0]
        self.curvature[[0, -1]] = 0.0
        self.pose = np.zeros((3, len(first)))
        self.pose[2, 2:] = np.cumsum(0.5 * length * (kappa[:-1] + kappa[1:]))
        self.pose[:2, 2:] = np.cumsum(self._along(np.arange(1, len(s)), length), axis=1)
        self.time -= self.time_at(start)

    def time_at(self, station: float) -> float:
        """When an arc length is reached [s]."""
        piece = int(np.searchsorted(self.station, station, "right"))
        distance, v = station - self.station[max(piece - 1, 0)], self.speed[piece]
        # Of the roots of v t + a t^2 / 2, the one that is there without acceleration.
        end = np.sqrt(v**2 + 2.0 * self.acceleration[piece] * distance)
        return float(self.time[max(piece - 1, 0)] + 2.0 * distance / (v + end))

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Positions and heading (3, n) [m, m, rad], curvature [1/m] and speed [m/s] (n,) at times (n,) [s]."""
        piece = np.searchsorted(self.time, t, "right")
        since = t - self.time[np.maximum(piece - 1, 0)]
        speed = self.speed[piece] + self.acceleration[piece] * since
        distance = 0.5 * (self.speed[piece] + speed) * since
        curvature = self.curvature[piece] + self.sharpness[piece] * distance
        pose = self.pose[:, piece]
        pose[:2] += self._along(piece, distance)
        pose[2] += 0.5 * distance * (self.curvature[piece] + curvature)
        return pose, curvature, speed

    def _along(self, piece: NDArray[np.intp], distance: Array) -> Array:
        """How far (2, n) a distance along a piece leads [m]: Gauss's quadrature, to 1e-9 m at 10 m of radius."""
        d = 0.5 * np.multiply.outer(1.0 + NODES, distance)
        psi = self.pose[2, piece] + d * (self.curvature[piece] + 0.5 * d * self.sharpness[piece])
        return np.stack([SHARES @ np.cos(psi), SHARES @ np.sin(psi)]) * (0.5 * distance)


def _checked(stations: ArrayLike, curvature: ArrayLike) -> tuple[Array, Array]:
    """Arc lengths and the curvature there, (n,) both."""
    s = as_numbers(stations, "stations")
    if s.ndim != 1 or len(s) < 2 or not np.isfinite(s).all() or not (np.diff(s) > 0.0).all():
        raise ArgumentError("stations", repr(stations), "at least two arc lengths [m], increasing")
    kappa = as_numbers(curvature, "curvature")
    _check_shape(kappa, s, "curvature")
    if not np.isfinite(kappa).all():
        raise ArgumentError("curvature", repr(curvature), "finite numbers [1/m]")
    return s, kappa


def _check_shape(values: Array, stations: Array, name: str) -> None:
    if values.shape != stations.shape:
        raise ShapeError(name, f"shape {values.shape}", f"shape {stations.shape}, one at each station")


def speeds_within(
    stations: ArrayLike, curvature: ArrayLike, *, lateral: float, braking: float, driving: float, top: float
) -> Array:
    """The highest speeds along a road that need no more than some accelerations.

    Parameters
    ----------
    stations, curvature : array_like, (n,)
        As of a `Road`; close together, a metre or less, since limits hold at stations.
    lateral, braking, driving : float
        Limits: half-axes of ellipses, so that what is needed across the road is not there along it [m/s^2].
    top : float
        Speed where nothing else limits it [m/s].

    Returns
    -------
    ndarray, shape (n,)
        [m/s]

    Raises
    ------
    ArgumentError
        If stations do not increase, there is not one finite curvature at each, or a limit is not positive.
    """
    s, kappa = _checked(stations, curvature)
    for name, value in {"lateral": lateral, "braking": braking, "driving": driving, "top": top}.items():
        positive_number(value, name)
    with np.errstate(divide="ignore"):
        v = np.minimum(top, np.sqrt(lateral / np.abs(kappa)))
    for along, limit in ((slice(None), driving), (slice(None, None, -1), braking)):
        speeds, bends, gaps = v[along], np.abs(kappa[along]), np.abs(np.diff(s[along]))
        for i, gap in enumerate(gaps):  # on from one station, or back from it
            share = np.sqrt(max(0.0, 1.0 - (speeds[i] ** 2 * bends[i] / lateral) ** 2))
            speeds[i + 1] = min(speeds[i + 1], np.sqrt(speeds[i] ** 2 + 2.0 * limit * share * gap))
    return v
