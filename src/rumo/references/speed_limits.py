"""The highest speeds that a car can drive along a path, by sweeps forwards and backwards."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from math import inf, isfinite, sqrt

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers, checked, non_negative_number, positive_number, whole_number
from rumo.errors import ArgumentError, ShapeError
from rumo.references.car_limits import accelerations
from rumo.references.clothoids import checked_curvature
from rumo.references.jerk import Abilities, jerk_limited
from rumo.references.paths import Path
from rumo.references.speed_profile import SpeedProfile
from rumo.signals import Array
from rumo.vehicles.parameters import GRAVITY, VehicleParameters

LAPS = 50
"""Sweeps around a closed path; one is enough, but for a top speed that drag does not let the car reach."""

Friction = float | Callable[[Array], ArrayLike]
"""Share of the limits that the road gives: a number, or a function of arc lengths (n,) [m]."""


@dataclass(frozen=True)
class SpeedLimits:
    """What a car can do, or what its passengers are to feel.

    Accelerations are half-axes of an ellipse: what is needed across the path is not there along it.

    Parameters
    ----------
    lateral, braking, driving : float
        Largest accelerations on a road with a friction of 1 [m/s^2].
    top : float
        Largest speed [m/s].
    power : float
        Of the engine by mass, which limits driving at speed [W/kg].
    drag : float
        Of the air by mass: it takes `drag v^2` [1/m].
    braking_left, driving_left : sequence of float, optional
        Shares of braking and driving that are left while evenly spaced shares of the lateral limit, from 0 to 1, are
        used: in place of the ellipse.
    jerk : float
        Largest rate at which the acceleration along the path changes [m/s^3]; infinite for none.
    """

    lateral: float
    braking: float
    driving: float
    top: float = 70.0
    power: float = inf
    drag: float = 0.0
    braking_left: tuple[float, ...] | None = None
    driving_left: tuple[float, ...] | None = None
    jerk: float = inf

    def __post_init__(self) -> None:
        for name in ("lateral", "braking", "driving", "top"):
            positive_number(getattr(self, name), name)
        if not non_negative_number(self.power, "power"):
            raise ArgumentError("power", repr(self.power), "a positive number [W/kg], infinite without a limit")
        if not non_negative_number(self.jerk, "jerk"):
            raise ArgumentError("jerk", repr(self.jerk), "a positive number [m/s^3], infinite without a limit")
        if not isfinite(non_negative_number(self.drag, "drag")):
            raise ArgumentError("drag", repr(self.drag), "a finite number [1/m]")
        for part in fields(self):
            value = getattr(self, part.name)
            if part.name not in ("braking_left", "driving_left"):
                object.__setattr__(self, part.name, float(value))
            elif value is not None:
                object.__setattr__(self, part.name, _shares(value, part.name))

    @classmethod
    def race(
        cls, grip: float = 0.9, *, mu: float = 1.0, top: float = 70.0, power: float = inf, drag: float = 0.0
    ) -> SpeedLimits:
        """A friction circle of a share `grip` of `mu g`, as tyres have it."""
        limit = positive_number(grip, "grip") * positive_number(mu, "mu") * GRAVITY
        return cls(limit, limit, limit, top, power, drag)

    @classmethod
    def of_car(cls, car: VehicleParameters, grip: float = 0.9, *, mu: float | None = None) -> SpeedLimits:
        """What the tyres of a car hold at a share `grip` of friction, its motor and its actuators.

        Axle by axle, with loads that follow the accelerations: the inner wheels of a bend carry less, so the car
        accelerates and brakes less there than a point of its mass would. See `friction_ellipses`.

        Parameters
        ----------
        car : VehicleParameters
            With its `limits`.
        grip : float
            Share of friction that is used.
        mu : float, optional
            Friction of the road; the car's own if not given.
        """
        found = accelerations(car, grip, car.mu if mu is None else mu)
        most = car.limits
        along = (np.minimum(found.braking, most.braking), np.minimum(found.driving, most.acceleration))
        braking, driving = (float(limit.max()) for limit in along)
        left = [tuple((limit / limit.max()).tolist()) for limit in along]
        top = min(most.speed, 100.0)
        return cls(
            float(found.lateral[-1]), braking, driving, top, most.power / car.m, car.b_lon / car.m, left[0], left[1]
        )

    @classmethod
    def comfort(cls, *, top: float = 36.0, jerk: float = 1.0) -> SpeedLimits:
        """What seated passengers do not mind: 2 m/s^2 across and in braking, 1.2 m/s^2 in driving, 1 m/s^3 of jerk.

        That is a third of the jerk beyond which surveys call a ride unacceptable: Hoberock (1977),
        doi 10.1115/1.3427093.
        """
        return cls(lateral=2.0, braking=2.0, driving=1.2, top=top, jerk=jerk)


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
    cap = np.minimum(limits.top**2, limits.lateral * share / np.maximum(bends, 1e-12))
    cap[np.isin(s, stops)] = 0.0
    if flying:
        bends[-1], share[-1], cap[-1] = bends[0], share[0], cap[0]
        w = _smooth(_around(cap, bends, np.diff(s), limits, share), cap, bends, np.diff(s), limits, share, closed=True)
        return SpeedProfile(s, np.sqrt(w), closed=True)
    for i, name, value in ((0, "start", start), (-1, "end", end)):
        if value is not None:
            cap[i] = min(cap[i], non_negative_number(value, name) ** 2)
    w = _there_and_back(cap, bends, np.diff(s), limits, share)
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
    return np.sqrt(_there_and_back(cap, bends, np.diff(s), limits, np.ones_like(s)))


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


def _around(cap: Array, bends: Array, gaps: Array, limits: SpeedLimits, share: Array) -> Array:
    """Squared speeds of a flying lap: laps until one ends as fast as it began."""
    cap = cap.copy()
    for _ in range(LAPS):
        w = _there_and_back(cap, bends, gaps, limits, share)
        settled = abs(w[0] - w[-1]) <= 1e-12 * limits.top**2
        cap[0] = cap[-1] = min(w[0], w[-1])
        if settled:
            break
    w = _there_and_back(cap, bends, gaps, limits, share)
    w[0] = w[-1] = min(w[0], w[-1])
    return w


def _smooth(
    w: Array, cap: Array, bends: Array, gaps: Array, limits: SpeedLimits, share: Array, *, closed: bool
) -> Array:
    """Squared speeds (n,) within the limit of jerk, from the highest ones of any jerk."""
    if limits.jerk == inf:
        return w
    lateral = bends / (limits.lateral * share)

    def ability(most: float, shares: tuple[float, ...] | None) -> Callable[[Array], Array]:
        left = np.vectorize(_left(shares), otypes=[float])
        return lambda at: most * share * left(at * lateral)

    driving = ability(limits.driving, limits.driving_left)
    braking = ability(limits.braking, limits.braking_left)
    return jerk_limited(w, cap, gaps, limits.jerk, Abilities(driving, braking, limits.power, limits.drag), closed)


def _there_and_back(cap: Array, bends: Array, gaps: Array, limits: SpeedLimits, share: Array) -> Array:
    """Squared speeds (n,) up to `cap` that driving reaches from station to station, and braking back from each."""
    lateral = bends / (limits.lateral * share)
    driving, braking = _left(limits.driving_left), _left(limits.braking_left)
    along = (limits.driving * share).tolist()
    w = _sweep(cap.tolist(), lateral.tolist(), gaps.tolist(), along, driving, limits.power, -limits.drag)
    back = [part[::-1].tolist() for part in (np.array(w), lateral, gaps, limits.braking * share)]
    return np.array(_sweep(back[0], back[1], back[2], back[3], braking, inf, limits.drag)[::-1])


def _ellipse(used: float) -> float:
    return sqrt(max(0.0, 1.0 - used * used))


def _left(shares: tuple[float, ...] | None) -> Callable[[float], float]:
    """Share that is left along the path while a share across it is used."""
    if shares is None:
        return _ellipse
    steps = len(shares) - 1

    def interpolated(used: float) -> float:
        place = min(used, 1.0) * steps
        i = min(int(place), steps - 1)
        return shares[i] + (place - i) * (shares[i + 1] - shares[i])

    return interpolated


def _shares(values: object, argument: str) -> tuple[float, ...]:
    shares = as_numbers(values, argument)
    if shares.ndim != 1 or len(shares) < 2 or not ((shares >= 0.0) & (shares <= 1.0)).all():
        raise ArgumentError(argument, repr(values), "at least two shares from 0 to 1")
    return tuple(shares.tolist())


def _sweep(
    w: list[float],
    lateral: list[float],
    gaps: Sequence[float],
    along: list[float],
    left: Callable[[float], float],
    power: float,
    drag: float,
) -> list[float]:
    """Squared speeds no higher than an acceleration leads to from the station before."""
    for i, gap in enumerate(gaps):
        acceleration = along[i] * left(w[i] * lateral[i])
        if power < inf:
            acceleration = min(acceleration, power / sqrt(w[i])) if w[i] > 0.0 else acceleration
        reached = w[i] + 2.0 * (acceleration + drag * w[i]) * gap
        if reached < w[i + 1]:
            w[i + 1] = max(reached, 0.0)
    return w
