"""Speeds by place, with constant accelerations between stations."""

from __future__ import annotations

from bisect import bisect_right
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PPoly

from rumo.checks import as_numbers
from rumo.errors import ArgumentError, ShapeError
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
        self._stations, self._speeds = self.s.tolist(), self.v.tolist()
        self._accelerations, self._times = self.a.tolist(), self.t.tolist()
        self._by_time = _by_time(self.s, self.v, self.a, self.t)

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
        within, lap = self._within(s)
        i = np.clip(np.searchsorted(self.s, within, side="right") - 1, 0, len(self.a) - 1)
        inside = np.clip(within, self.s[0], self.s[-1])
        mean = 0.5 * (self.v[i] + np.sqrt(np.interp(inside, self.s, self.v**2)))
        since = np.divide(inside - self.s[i], mean, out=np.zeros_like(inside), where=mean > 0.0)
        end = np.where(within < self.s[0], self.v[0], self.v[-1])
        beyond = np.divide(within - inside, end, out=np.zeros_like(inside), where=end > 0.0)
        return self.t[i] + since + beyond + lap * self.duration

    def moment(self, s: float) -> float:
        """The same for one arc length, unchecked and fast [s]."""
        lap = 0.0
        if self.closed:
            lap = (s - self._stations[0]) // self._length
            s -= lap * self._length
        i = min(max(bisect_right(self._stations, s) - 1, 0), len(self._stations) - 2)
        inside = min(max(s, self._stations[0]), self._stations[-1])
        v, distance, beyond = self._speeds[i], inside - self._stations[i], s - inside
        end = self._speeds[0] if beyond < 0.0 else self._speeds[-1]
        mean = 0.5 * (v + sqrt(max(v * v + 2.0 * self._accelerations[i] * distance, 0.0)))
        since = distance / mean if mean > 0.0 else 0.0
        return self._times[i] + since + (beyond / end if end > 0.0 else 0.0) + lap * self.duration

    def at_time(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Arc length, speed and acceleration at times [m], [m/s], [m/s^2], each of their shape."""
        t = np.asarray(t, dtype=float)
        if not self.closed:
            values: Any = self._by_time(t)
            return values[..., 0], values[..., 1], values[..., 2]
        lap = np.floor(t / self.duration)
        values = self._by_time(t - lap * self.duration)
        return values[..., 0] + lap * self._length, values[..., 1], values[..., 2]

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


def _by_time(s: Array, v: Array, a: Array, t: Array) -> PPoly:
    """Arc length, speed and acceleration by time, with speeds held for a second before and after, and so on."""
    first, last = s[0] - v[0], s[-1]
    s, v, a = np.r_[first, s[:-1], last], np.r_[v[0], v[:-1], v[-1]], np.r_[0.0, a, 0.0]
    none = np.zeros_like(a)
    c = np.stack([np.stack([0.5 * a, none, none], 1), np.stack([v, a, none], 1), np.stack([s, v, a], 1)])
    return PPoly(c, np.r_[t[0] - 1.0, t, t[-1] + 1.0])
