"""Speeds whose acceleration changes no faster than a limit, as near to the fastest ones as that allows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from rumo.signals import Array

CONVERGED = 1e-5
"""Share of the time by which an iteration has to be faster, for another to follow."""
ITERATIONS = 60
FACTORS = (2.25, 1.5, 1.15, 1.05)
"""By how much a squared speed may change in an iteration: up to three times, a tangent of the time says something. The
less, the closer are chords to the ellipse between them."""
EXACT = 1e-9
"""Share by which a limit may be exceeded, for rounding."""


@dataclass(frozen=True)
class Abilities:
    """What is left along the path at squared speeds.

    Attributes
    ----------
    driving, braking : callable
        From squared speeds at all stations (n,) to accelerations (n,): less, the faster.
    resistance : callable
        The same of what turning takes: more, the faster. Braking gets no credit for it.
    power, drag : float
        See `SpeedLimits`.
    """

    driving: Callable[[Array], Array]
    braking: Callable[[Array], Array]
    resistance: Callable[[Array], Array]
    power: float
    drag: float


def jerk(w: Array, gaps: Array, closed: bool) -> Array:
    """Rates at which the acceleration changes, of squared speeds (n,) at stations with gaps (n - 1,) [m/s^3].

    Accelerations are constant between stations. From one to the next they change in the time from the middle of an
    interval to that of the next; from rest, or from a speed that was held before an open path begins, until the middle
    of the first interval, and likewise at stops and at the end.
    """
    changes, times = _neighbours(w, len(gaps), closed)
    v = np.sqrt(w)
    return (changes @ (np.diff(w) / (2.0 * gaps))) / (times @ (2.0 * gaps / (v[:-1] + v[1:])))


def jerk_limited(w: Array, cap: Array, gaps: Array, limit: float, abilities: Abilities, closed: bool) -> Array:
    """Squared speeds (n,) of least time, up to `cap`, within abilities and a jerk.

    Parameters
    ----------
    w : ndarray, (n,)
        Squared speeds within the abilities, of any jerk; 0 where the vehicle stands.
    cap : ndarray, (n,)
        Largest squared speeds.
    gaps : ndarray, (n - 1,)
        Between the stations [m].
    limit : float
        Of the jerk [m/s^3].
    abilities : Abilities
        What is left along the path.
    closed : bool
        Whether the last station is the first again.

    Notes
    -----
    Not convex: a change of acceleration takes J times the time of an interval, which is shorter the higher the speeds.
    But that time is a convex function of squared speeds, so its tangent is never above it: with tangents in its place
    the problem is convex, its solutions keep the limit, and the tangents' own point is among them. So each iteration
    is a quadratic program that makes a profile faster which keeps all limits before and after (Marks, Wright, 1978,
    doi 10.1287/opre.26.4.681). The first is the one that was given, slowed down.
    """
    w = slowed(w, gaps, limit, abilities, closed)
    free = len(gaps) if closed else len(w)
    factors = list(FACTORS)
    for _ in range(ITERATIONS):
        step = _step(w, cap, gaps, limit, abilities, closed, factors[0]) * w[:free]
        before, after = _time(w, gaps), w
        for share in (1.0, 0.5, 0.25, 0.125):
            after = w[:free] + share * step
            after = np.append(after, after[0]) if closed else after
            if _time(after, gaps) < before:
                w = after
                break
        if _time(w, gaps) > (1.0 - CONVERGED) * before:
            factors.pop(0)
            if not factors:
                break
    return slowed(w, gaps, limit, abilities, closed)  # by what the programs' tolerance takes


def slowed(w: Array, gaps: Array, limit: float, abilities: Abilities, closed: bool) -> Array:
    """Squared speeds times the largest share of them, up to 1, that keeps all limits.

    Accelerations go with that share, their change with its power of 3/2, and what is left along the path only grows.
    """
    most = float(np.abs(jerk(w, gaps, closed)).max())
    share = min(1.0, (limit / most) ** (2.0 / 3.0)) if most > 0.0 else 1.0
    low, high = 0.0, share
    if _within(high * w, gaps, abilities):
        return high * w
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _within(middle * w, gaps, abilities) else (low, middle)
    return low * w


def _within(w: Array, gaps: Array, abilities: Abilities) -> bool:
    a = np.diff(w) / (2.0 * gaps)
    engine = abilities.driving(w)[:-1]
    if abilities.power < np.inf:
        v = np.sqrt(w[:-1])
        engine = np.minimum(engine, abilities.power / np.where(v > 0.0, v, 1e-12))
    brakes = abilities.braking(w)[1:] + abilities.drag * w[1:]
    spare = EXACT * (1.0 + np.abs(a))
    return bool(
        (a <= engine - abilities.resistance(w)[:-1] - abilities.drag * w[:-1] + spare).all()
        and (-a <= brakes + spare).all()
    )


def _time(w: Array, gaps: Array) -> float:
    v = np.sqrt(np.maximum(w, 0.0))
    return float((2.0 * gaps / (v[:-1] + v[1:])).sum())


def _neighbours(w: Array, intervals: int, closed: bool) -> tuple[Any, Any]:
    """Which accelerations follow on each other, and the time that a change takes: both (changes, intervals)."""
    i = np.arange(intervals)
    if closed:
        following, ones = (i + 1) % intervals, np.ones(intervals)
        eye = sparse.identity(intervals, format="csr")
        after = sparse.csr_matrix((ones, (i, following)), shape=(intervals, intervals))
        return after - eye, 0.5 * (after + eye)
    inner = np.flatnonzero(w[1:-1] > 0.0)  # the interval before a station where the vehicle goes on
    stops = np.flatnonzero(w[1:-1] == 0.0)
    alone = np.unique(np.concatenate([[0, intervals - 1], stops, stops + 1]))
    rows = np.arange(len(inner))
    pairs = (len(inner), intervals)
    before = sparse.csr_matrix((np.ones(len(inner)), (rows, inner)), shape=pairs)
    after = sparse.csr_matrix((np.ones(len(inner)), (rows, inner + 1)), shape=pairs)
    single = sparse.csr_matrix((np.ones(len(alone)), (np.arange(len(alone)), alone)), shape=(len(alone), intervals))
    return sparse.vstack([after - before, single], "csr"), 0.5 * sparse.vstack([after + before, single], "csr")


def _step(w: Array, cap: Array, gaps: Array, limit: float, abilities: Abilities, closed: bool, factor: float) -> Array:
    """Change of each squared speed, as a share of it, by one quadratic program."""
    import piqp  # not needed by those who race

    n = len(gaps) if closed else len(w)
    here, there = np.arange(len(gaps)), (np.arange(len(gaps)) + 1) % n
    v = np.sqrt(w)
    g = 1.0 / (v[:-1] + v[1:])
    before, after = v[:-1], v[1:]

    def by_ends(first: Array, second: Array) -> Any:
        """Rows of the intervals: entries at their beginnings and ends."""
        rows = np.tile(here, 2)
        return sparse.csr_matrix((np.r_[first, second], (rows, np.r_[here, there])), shape=(len(gaps), n))

    a, accelerations = np.diff(w) / (2.0 * gaps), by_ends(-w[:-1] / (2.0 * gaps), w[1:] / (2.0 * gaps))
    slope = -gaps * g**2
    times, duration = by_ends(slope * before, slope * after), 2.0 * gaps * g
    changes, spans = _neighbours(w, len(gaps), closed)
    rows, most = list[Any](), list[Array]()
    for sign in (1.0, -1.0):
        rows.append(sign * (changes @ accelerations) - limit * (spans @ times))
        most.append(limit * (spans @ duration) - sign * (changes @ a))
    lower, upper = w / factor, np.minimum(cap, factor * w)
    nothing = np.zeros(len(gaps))

    def chord(of: Callable[[Array], Array], other: Array) -> Array:
        """Slopes (n,) of chords, by the share of a change: below a concave function up to where they end."""
        gap = np.where(other == w, 1.0, other - w)
        return np.where(other == w, 0.0, of(other) - of(w)) / gap * w

    def pushed(at: Array) -> Array:
        return abilities.driving(at) - abilities.resistance(at)

    for ability, sign, ends in ((pushed, 1.0, slice(None, -1)), (abilities.braking, -1.0, slice(1, None))):
        left, wind = ability(w)[ends], sign * abilities.drag * w[ends]
        for other in (lower, upper):
            against = wind - chord(ability, other)[ends]
            at_ends = (against, nothing) if sign > 0.0 else (nothing, against)
            rows.append(sign * accelerations + by_ends(*at_ends))
            most.append(left - wind - sign * a)
    if abilities.power < np.inf:
        moving = before > 0.0
        engine = np.where(moving, abilities.power / np.where(moving, before, 1.0), 1e6)
        less = np.where(moving, 0.5 * engine, 0.0) + abilities.drag * w[:-1]
        for other in (lower, upper):
            rows.append(accelerations + by_ends(less + chord(abilities.resistance, other)[:-1], nothing))
            most.append(engine - (abilities.resistance(w) + abilities.drag * w)[:-1] - a)
    curved = gaps * g**2
    first = curved * before * (0.5 + g * before)
    second = curved * after * (0.5 + g * after)
    cross = curved * g * before * after
    hessian = sparse.csc_matrix(
        (
            np.r_[first, second, cross, cross],
            (np.r_[here, there, here, there], np.r_[here, there, there, here]),
        ),
        shape=(n, n),
    )
    gradient = np.asarray(times.sum(axis=0)).ravel()
    weight = 1.0 / max(float(np.abs(gradient).max()), 1e-300)
    moving = w[:n] > 0.0
    scale = np.where(moving, w[:n], 1.0)
    solver: Any = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-7
    none: Any = sparse.csc_matrix((0, n))
    solver.setup(
        weight * (hessian + 1e-12 * sparse.identity(n)),
        weight * gradient,
        none,
        np.zeros(0),
        sparse.csc_matrix(sparse.vstack(rows)),
        np.full(sum(map(len, most)), -np.inf),
        np.concatenate(most),
        np.where(moving, lower[:n] / scale - 1.0, -1.0),
        np.where(moving, upper[:n] / scale - 1.0, 1.0),
    )
    solver.solve()
    return np.where(moving, solver.result.x, 0.0)
