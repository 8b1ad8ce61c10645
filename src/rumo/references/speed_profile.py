"""Speeds by place, with constant accelerations between stations."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers
from rumo.errors import ArgumentError, ShapeError
from rumo.kernel import Curve
from rumo.references.jerk import jerk
from rumo.signals import Array, read_only

STANDSTILL = "Where a vehicle stands for a while is a matter of time, not of place: see TimedPath(pauses=...)."


class SpeedProfile:
    """How fast to drive where, and thereby when to be where.

    Between two stations the acceleration is constant. Beyond the ends the speed is held; a closed profile begins again.

    Parameters
    ----------
    stations : array_like, (n,)
        Arc lengths, increasing [m].
    speed : array_like, (n,)
        There, at least 0, and not 0 at two of them in a row [m/s].
    closed : bool
        Whether it is that of a lap: the last station is the first again, at the same speed.

    Attributes
    ----------
    s, v : ndarray, (n,)
        Stations and the speed there [m], [m/s].
    t : ndarray, (n,)
        When each is reached; 0 at the first [s].
    a : ndarray, (n - 1,)
        Acceleration between them [m/s^2].
    duration : float
        From the first station to the last, which is the lap time of a closed one [s].

    Raises
    ------
    ArgumentError
        If stations do not increase, a speed is negative or not finite, or the vehicle would stand still for ever.
    ShapeError
        If there is not one speed at each station.
    """

    def __init__(self, stations: ArrayLike, speed: ArrayLike, closed: bool = False) -> None:
        s, v = as_numbers(stations, "stations"), as_numbers(speed, "speed")
        if s.ndim != 1 or len(s) < 2 or not np.isfinite(s).all() or not (np.diff(s) > 0.0).all():
            raise ArgumentError("stations", repr(stations), "at least two arc lengths [m], increasing")
        if v.shape != s.shape:
            raise ShapeError("speed", f"shape {v.shape}", f"shape {s.shape}, one at each station")
        if not ((v >= 0.0) & (v < np.inf)).all():
            raise ArgumentError("speed", repr(speed), "finite numbers of at least 0 [m/s]")
        if ((v[:-1] == 0.0) & (v[1:] == 0.0)).any():
            raise ArgumentError("speed", "0 at two stations in a row", "a vehicle that moves", STANDSTILL)
        if closed and v[0] != v[-1]:
            raise ArgumentError("speed", f"{v[0]:g} at first and {v[-1]:g} at last", "the same, on a closed path")
        gaps = np.diff(s)
        self.closed = bool(closed)
        self.s, self.v = read_only(s), read_only(v)
        self.a = read_only(0.5 * np.diff(v**2) / gaps)
        self.t = read_only(np.r_[0.0, np.cumsum(2.0 * gaps / (v[:-1] + v[1:]))])
        self.duration = float(self.t[-1])
        self._length = float(s[-1] - s[0])
        self._by_time = _by_time(self.s, self.v, self.a, self.t, self.closed)

    def speed_at(self, s: ArrayLike) -> Array:
        """Speed at arc lengths [m/s]."""
        return np.sqrt(np.interp(self._within(s)[0], self.s, self.v**2))

    def acceleration_at(self, s: ArrayLike) -> Array:
        """Acceleration along the path at arc lengths [m/s^2]; 0 beyond the ends."""
        within, _ = self._within(s)
        padded = np.r_[0.0, self.a, 0.0]
        return padded[np.searchsorted(self.s, within, side="right")]

    def time_at(self, s: ArrayLike) -> Array:
        """When arc lengths are reached [s]. Where the speed beyond an end is 0, that end is as far as it gets."""
        return self._by_time.when(s)

    def at_time(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Arc length, speed and acceleration at times [m], [m/s], [m/s^2], each of their shape."""
        s, speed, acceleration = self._by_time(t)
        return s, speed, acceleration

    @property
    def largest_jerk(self) -> float:
        """Largest rate at which the acceleration changes, from the middle of an interval to that of the next [m/s^3].

        At a stop, and at the ends of an open path, it is that from the middle of an interval to 0.
        """
        return float(np.abs(jerk(self.v**2, np.diff(self.s), self.closed)).max())

    def _within(self, s: ArrayLike) -> tuple[Array, Array]:
        """Arc lengths within the first lap of a closed profile, and the laps before."""
        s = np.asarray(s, dtype=float)
        if not self.closed:
            return s, np.zeros_like(s)
        lap = np.floor((s - self.s[0]) / self._length)
        return s - lap * self._length, lap

    def __repr__(self) -> str:
        kind = "closed, " if self.closed else ""
        low, high = self.v.min(), self.v.max()
        return f"SpeedProfile({kind}{self._length:.6g} m, {self.duration:.4g} s, {low:.3g} to {high:.3g} m/s)"


def _by_time(s: Array, v: Array, a: Array, t: Array, closed: bool) -> Curve:
    """Arc length, speed and acceleration by time, lap after lap, or with speeds held before and after."""
    lap = np.array([s[-1] - s[0], 0.0, 0.0]) if closed else None
    if closed:
        s, v = s[:-1], v[:-1]
    else:
        s, v, a = np.r_[s[0] - v[0], s], np.r_[v[0], v], np.r_[0.0, a, 0.0]
        t = np.r_[t[0] - 1.0, t, t[-1] + 1.0]
    none = np.zeros_like(a)
    c = np.stack([np.stack([0.5 * a, none, none], 1), np.stack([v, a, none], 1), np.stack([s, v, a], 1)])
    return Curve(t, c, lap)
