"""The line around a track on which a lap takes least time, by IPOPT."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from rumo.checks import checked, non_negative_number, positive_number, whole_number
from rumo.errors import ArgumentError
from rumo.interrupts import interruptible
from rumo.references import Path, SpeedLimits, Track, speed_profile
from rumo.references.race_line import room_aside
from rumo.references.speed_sweeps import held
from rumo.signals import Array, read_only

FOUND, TIRED = "found", "not found"
ANGLE = 1.0
"""Largest angle between line and track [rad]."""
SLOWEST = 1.0
"""Least speed on a lap [m/s]."""
CHORDS, CLOSE = 6, 0.02
"""Chords of a table at most, and how close they are to come to it."""
BEGIN = 0.9
"""Share of the centre line's speeds at which the search begins."""


@dataclass(frozen=True, eq=False)
class MinimumTime:
    """A lap of least time.

    Attributes
    ----------
    path : Path
        The line.
    s : ndarray, (N,)
        Arc lengths of the centre line at which it was found [m].
    aside : ndarray, (N,)
        How far the line is to the left of the centre line there [m].
    speed : ndarray, (N,)
        There [m/s].
    duration : float
        Of the lap, as the nonlinear program has it [s].
    outcome : str
        `FOUND`, or `TIRED` where IPOPT came to no end; the line is the last it tried.
    iterations : int
        Of IPOPT.
    """

    path: Path
    s: Array
    aside: Array
    speed: Array
    duration: float
    outcome: str
    iterations: int


def minimum_time(
    track: Track,
    limits: SpeedLimits,
    margin: float = 0.0,
    *,
    turning: float = 0.15,
    spacing: float = 1.0,
    max_iterations: int = 500,
) -> MinimumTime:
    """Find the line and the speeds around a closed track that take least time.

    Parameters
    ----------
    track : Track
        Closed.
    limits : SpeedLimits
        Of the car; a limit of jerk is not known here.
    margin : float
        See `minimum_curvature` [m].
    turning : float
        Largest rate at which the line's curvature changes in time, which is about the steering rate over the wheelbase
        [1/(m s)].
    spacing : float
        Of the nodes along the centre line, at most [m].
    max_iterations : int
        Of IPOPT.

    Raises
    ------
    ArgumentError
        If the track is open, or margins leave nothing of it.

    Notes
    -----
    A point mass by its place beside the centre line, in the arc length s of that (Verschueren et al., 2014): distance
    n, angle chi to it, squared speed w, and curvature c of the line, with driving, braking and dc/dsigma as inputs,
    constant between nodes. With kappa of the centre line and sigma along the line, dsigma/ds =
    (1 - n kappa) / cos(chi), dn/ds = (1 - n kappa) tan(chi), dchi/ds = c dsigma/ds - kappa, dw/dsigma =
    2 (driving - braking - drag w - resistance). The trapezoidal rule, and time as of constant accelerations, as a
    `SpeedProfile` has them, whose limits hold at nodes.
    """
    path = checked(track, "track", Track).path
    if not path.closed:
        raise ArgumentError("track", "an open one", "a closed one, for a lap that ends as it began")
    checked(limits, "limits", SpeedLimits)
    rate = positive_number(turning, "turning")
    most = whole_number(max_iterations, "max_iterations", 1)
    N = max(int(np.ceil(path.length / positive_number(spacing, "spacing"))), 16)
    s = np.linspace(0.0, path.length, N + 1)[:-1]
    lower, upper = room_aside(track, s, non_negative_number(margin, "margin"))
    kappa, h = path.at(s).curvature, path.length / N
    speed = BEGIN * speed_profile(path, limits).speed_at(s)

    opti = ca.Opti()
    reach, fastest, bend = float(np.abs(np.r_[lower, upper]).max()), limits.top**2, float(np.abs(kappa).max()) + 0.02
    push = max(limits.driving, limits.braking)
    # Variables of order 1.
    n, chi = reach * opti.variable(N), opti.variable(N)
    w, c = fastest * opti.variable(N), bend * opti.variable(N)
    driving, braking = push * opti.variable(N), push * opti.variable(N)
    twist = 0.01 * opti.variable(N)
    along = (1.0 - n * kappa) / ca.cos(chi)

    def following(values: Any) -> Any:
        """Values at the next node."""
        return ca.vertcat(values[1:], values[0])

    def mean(values: Any) -> Any:
        return 0.5 * (values + following(values))

    length = h * mean(along)
    opti.subject_to(following(n) - n == h * mean((1.0 - n * kappa) * ca.tan(chi)))
    opti.subject_to(following(chi) - chi == h * (mean(c * along) - 0.5 * (kappa + np.roll(kappa, -1))))
    opti.subject_to(following(c) - c == twist * length)
    across = c * w / limits.lateral
    taken = opti.variable(N) if limits.resistance else np.zeros(N)
    for chord in _resistances(across, limits, limits.resistance) if limits.resistance else ():
        opti.subject_to(taken >= chord)
    opposed = limits.drag * mean(w) + mean(taken)
    opti.subject_to((following(w) - w) / push == 2.0 * length * (driving - braking - opposed) / push)
    opti.subject_to(_used(driving / limits.driving, across, limits.driving_left) <= 1.0)
    # As in profiles, what turning takes, if nothing drives against it, is part of the braking that there may be.
    slowed = braking if limits.resistance is None else braking + following(taken) - driving
    opti.subject_to(_used(slowed / limits.braking, following(across), limits.braking_left) <= 1.0)
    most_across = held(limits)
    opti.subject_to(opti.bounded(-most_across, across, most_across))
    if limits.power < np.inf:
        opti.subject_to(driving**2 * w / limits.power**2 <= 1.0)
    opti.subject_to(twist**2 * w / rate**2 <= 1.0)
    opti.subject_to(opti.bounded(0.0, driving / push, 1.0))
    opti.subject_to(opti.bounded(0.0, braking / push, 1.0))
    opti.subject_to(opti.bounded(lower / reach, n / reach, upper / reach))
    opti.subject_to(opti.bounded(-ANGLE, chi, ANGLE))
    opti.subject_to(opti.bounded(SLOWEST**2 / fastest, w / fastest, 1.0))
    v = ca.sqrt(w)
    time = ca.sum1(2.0 * length / (v + following(v)))
    opti.minimize(time)
    for variable, guess in ((n, np.clip(0.0, lower, upper)), (w, speed**2), (c, kappa)):
        opti.set_initial(variable, guess)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "sb": "yes", "max_iter": most, "tol": 1e-6})
    outcome = FOUND
    with interruptible():
        try:
            value = opti.solve().value
        except RuntimeError:  # which Opti raises where IPOPT has found no solution
            outcome, value = TIRED, opti.debug.value
    aside, squared = np.asarray(value(n), dtype=float), np.asarray(value(w), dtype=float)
    iterations = int(opti.stats()["iter_count"])
    line = Path(path.offset(s, aside), closed=True)
    return MinimumTime(
        line,
        read_only(s),
        read_only(aside),
        read_only(np.sqrt(squared)),
        float(value(time)),
        outcome,
        iterations,
    )


def _used(along: Any, across: Any, left: tuple[float, ...] | None) -> Any:
    """At most 1 where a share along the line is left beside one across it: an ellipse, or the chords of a table."""
    if left is None:
        return along**2 + across**2
    places, values = _corners(left)
    slopes = np.diff(values) / np.diff(places)
    rows = [
        along - slope * (sign * across - place) + (1.0 - value)
        for place, value, slope in zip(places[:-1].tolist(), values[:-1].tolist(), slopes.tolist(), strict=True)
        for sign in (1.0, -1.0)
    ]
    return ca.vertcat(*rows)


def _resistances(across: Any, limits: SpeedLimits, table: tuple[float, ...]) -> Any:
    """What turning takes by the share of the lateral limit: chords of a convex table, which are not below it."""
    # Closer together where it is steep.
    places = held(limits) * (1.0 - np.linspace(1.0, 0.0, CHORDS + 1) ** 2)
    values = np.interp(places, np.linspace(0.0, 1.0, len(table)), table)
    slopes = np.diff(values) / np.diff(places)
    chords = zip(places[:-1].tolist(), values[:-1].tolist(), slopes.tolist(), strict=True)
    return [value + slope * (sign * across - place) for place, value, slope in chords for sign in (1.0, -1.0)]


def _corners(left: tuple[float, ...]) -> tuple[Array, Array]:
    """Places and values of as few chords of a table as come close to it, and are not above it where it is concave."""
    every = np.linspace(0.0, 1.0, len(left))
    places, values = every[[0, -1]], np.array(left)[[0, -1]]
    for count in range(1, CHORDS + 1):
        places = np.linspace(0.0, 1.0, count + 1)
        values = np.interp(places, every, left)
        slopes = np.diff(values) / np.diff(places)
        least = np.min(values[:-1, None] + slopes[:, None] * (every[None] - places[:-1, None]), axis=0)
        if np.abs(least - left).max() <= CLOSE:
            break
    return places, values
