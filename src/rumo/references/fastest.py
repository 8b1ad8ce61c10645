"""The highest speeds that a car can drive along a path, by sweeps forwards and backwards."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers, checked, non_negative_number, positive_number, whole_number
from rumo.errors import ArgumentError, ShapeError
from rumo.references.clothoids import checked_curvature
from rumo.references.jerk import Abilities, jerk_limited
from rumo.references.paths import Path
from rumo.references.speed_limits import SpeedLimits
from rumo.references.speed_profile import SpeedProfile
from rumo.references.speed_sweeps import around, held, interpolated, left, there_and_back
from rumo.signals import Array

Friction = float | Callable[[Array], ArrayLike]
"""Share of the limits that the road gives: a number, or a function of arc lengths (n,) [m]."""


def speed_profile(
    path: Path,
    limits: SpeedLimits,
    *,
    friction: Friction = 1.0,
    start: float | None = None,
    end: float | None = None,
    stops: Sequence[float] = (),
    laps: int | None = None,
    spacing: float = 0.5,
) -> SpeedProfile:
    """The highest speeds along a path within limits: sweeps forwards and backwards.

    Parameters
    ----------
    path : Path
        Open or closed; on a closed one the profile is that of a flying lap, unless `laps` are given.
    limits : SpeedLimits
        Of the car, or of comfort.
    friction : float or callable
        By which accelerations are multiplied; a function of arc lengths (n,) [m] for friction by place.
    start, end : float, optional
        Speeds at the ends, at most [m/s]; only as limits say if not given.
    stops : sequence of float
        Arc lengths at which the speed is 0 [m]; how long the vehicle stands there is for `TimedPath` to say.
    laps : int, optional
        Of a closed path that are driven from a start to an end.
    spacing : float
        Of the stations at which limits hold, at most [m].

    Returns
    -------
    SpeedProfile
        At even spacing, with the stops besides.

    Raises
    ------
    ArgumentError
        If a value cannot work.

    Notes
    -----
    Accelerations are within the ellipse at the station where they begin: driving in the direction of travel, braking
    against it. With a limit of jerk, what sweeps find is made smooth by quadratic programs, see
    `rumo.references.jerk`: some hundred times the time of the sweeps.
    Source: the quasi-steady-state method, see Heilmeier et al. (2020), doi 10.1080/00423114.2019.1631455.
    """
    checked(path, "path", Path)
    checked(limits, "limits", SpeedLimits)
    length = path.length
    if laps is not None:
        length *= whole_number(laps, "laps", 1)
        if not path.closed:
            raise ArgumentError("laps", repr(laps), "none on an open path")
    flying = path.closed and laps is None
    if flying and (start is not None or end is not None or len(stops)):
        raise ArgumentError("start, end, stops", "some", "none of a flying lap", "Say how many laps=... are driven.")
    s = _stations(length, positive_number(spacing, "spacing"), stops)
    bends, share = np.abs(path.at(s).curvature), _friction(friction, s)
    cap = np.minimum(limits.top**2, held(limits) * limits.lateral * share / np.maximum(bends, 1e-12))
    cap[np.isin(s, stops)] = 0.0
    if flying:
        bends[-1], share[-1], cap[-1] = bends[0], share[0], cap[0]
        w = _smooth(around(cap, bends, np.diff(s), limits, share), cap, bends, np.diff(s), limits, share, closed=True)
        return SpeedProfile(s, np.sqrt(w), closed=True)
    for i, name, value in ((0, "start", start), (-1, "end", end)):
        if value is not None:
            cap[i] = min(cap[i], non_negative_number(value, name) ** 2)
    w = there_and_back(cap, bends, np.diff(s), limits, share)
    return SpeedProfile(s, np.sqrt(_smooth(w, cap, bends, np.diff(s), limits, share, closed=False)))


def speeds_within(
    stations: ArrayLike, curvature: ArrayLike, *, lateral: float, braking: float, driving: float, top: float
) -> Array:
    """The highest speeds along a road that need no more than some accelerations: `speed_profile` at given stations.

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
    s, kappa = checked_curvature(stations, curvature)
    limits = SpeedLimits(lateral, braking, driving, top)
    bends = np.abs(kappa)
    with np.errstate(divide="ignore"):
        cap = np.minimum(limits.top**2, limits.lateral / bends)
    return np.sqrt(there_and_back(cap, bends, np.diff(s), limits, np.ones_like(s)))


def _friction(friction: object, s: Array) -> Array:
    if callable(friction):
        values = as_numbers(friction(s), "friction(s)")
        if values.shape not in ((), s.shape):
            raise ShapeError("friction(s)", f"shape {values.shape}", f"shape {s.shape}, one at each arc length")
    else:
        values = as_numbers(friction, "friction")
        if values.ndim:
            cure = "Write lambda s: np.interp(s, places, values)."
            raise ShapeError("friction", f"shape {values.shape}", "a number or a function of arc lengths", cure)
    if not ((values > 0.0) & (values < np.inf)).all():
        raise ArgumentError("friction", repr(values.min().item()), "positive finite numbers")
    return np.broadcast_to(values, s.shape).copy()


def _stations(length: float, spacing: float, stops: Sequence[float]) -> Array:
    """Even stations, with stops in place of those next to them."""
    s = np.linspace(0.0, length, max(int(np.ceil(length / spacing)), 8) + 1)
    places = as_numbers(stops, "stops")
    if places.ndim != 1 or not ((places >= 0.0) & (places <= length)).all():
        raise ArgumentError("stops", repr(stops), f"arc lengths from 0 to {length:.6g} m")
    step = s[1]
    if len(places) > 1 and np.diff(np.sort(places)).min() < 3.0 * step:
        raise ArgumentError("stops", repr(stops), f"arc lengths at least {3.0 * step:.3g} m apart, or a finer spacing")
    for place in places:
        s = s[(np.abs(s - place) > 0.5 * step) | (s == 0.0) | (s == length)]
    return np.unique(np.r_[s, places])


def _smooth(
    w: Array, cap: Array, bends: Array, gaps: Array, limits: SpeedLimits, share: Array, *, closed: bool
) -> Array:
    """Squared speeds (n,) within the limit of jerk, from the highest ones of any jerk."""
    if limits.jerk == inf:
        return w
    lateral = bends / (limits.lateral * share)

    def ability(most: float, shares: tuple[float, ...] | None) -> Callable[[Array], Array]:
        of = np.vectorize(left(shares), otypes=[float])
        return lambda at: most * share * of(at * lateral)

    turning = np.vectorize(interpolated(limits.resistance or (0.0, 0.0)), otypes=[float])
    abilities = Abilities(
        ability(limits.driving, limits.driving_left),
        ability(limits.braking, limits.braking_left),
        lambda at: share**2 * turning(at * lateral),
        limits.power,
        limits.drag,
    )
    return jerk_limited(w, cap, gaps, limits.jerk, abilities, closed)
