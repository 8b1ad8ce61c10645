"""A path followed by place: what lies ahead of where the vehicle is on it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite, pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, as_names, checked, finite_number, positive_number
from rumo.errors import ArgumentError, ShapeError
from rumo.references.base import Preview
from rumo.references.motion import Rolling, check_vehicle, checked_outputs, known_signals, motion, wanted_signals
from rumo.references.paths import TURN, Path
from rumo.references.speed_profile import SpeedProfile
from rumo.references.timed_path import check_on
from rumo.signals import Array, NamedArray, Signals

if TYPE_CHECKING:
    from rumo.problem import Problem

FASTEST = 10.0
"""Acceleration that tyres on a dry road hold [m/s^2]."""
SLOWER = 1.0
"""How much slower than the profile a vehicle is that has to catch up [m/s]."""
MOMENTS = np.linspace(0.0, 1.0, 101)
WINDOW = 5.0
"""How far a vehicle may be from where it was expected to get to [m]."""
OF_PATH = ("curvature", "heading")
"""Parameters of models that are the path's own."""
OTHER_WAY = 1.25 * pi
"""Error of the heading from which it is taken to be on the other side [rad]: more than half a turn, so that noise does
not change sides back and forth."""


@dataclass(frozen=True, eq=False)
class PathTracking:
    """A path at speeds that belong to places: the part ahead of the vehicle's progress, at the profile's speeds.

    The nearest point is looked for all over the path at the first preview, where a crossing goes by the state psi; then
    near where the vehicle has to be by
    now, so that a path may cross itself, and laps are counted. From there the profile says how progress goes on.

    Each run asks `start` for a state of its own; `preview` of the settings themselves is the first preview of a run.

    Parameters
    ----------
    path : Path
        To be followed.
    profile : SpeedProfile
        How fast where; on a closed path a flying lap, or one with a beginning and an end. Where its speed is 0 but at
        the beginning, the vehicle is asked to stay; for stops that end, see `TimedPath`.
    vehicle : VehicleParameters, optional
        The car that is to drive it, or anything else that is `Rolling`: its further states become signals.
    outputs : tuple of str, optional
        Which signals to give: p_x, p_y, psi (the tangent), course (the same), speed, v_x (the same), omega, and further
        ones of the vehicle. All that the problem knows if not given.
    parameters : mapping of str to callable
        Parameters of the controller's model by place: functions of arc lengths (n,) [m], evaluated in the middle of
        each interval. `curvature` is the path's without being named, if the model has a parameter of this name.
    position : tuple of str
        States of the controller's model that say where the vehicle is.
    window : float
        How far it may be from where it should have got to since the last preview, forwards and backwards [m]. Less than
        half of the smallest loop.
    begin : float, optional
        Arc length near which it is at first [m], if the nearest point of all may be the wrong one.
    acceleration : float
        With which a vehicle whose state v_x is slower than the profile is to catch up, at most [m/s^2]: a place that
        it cannot reach would lead it across the inside of bends.
    """

    path: Path
    profile: SpeedProfile
    vehicle: Rolling | None = None
    outputs: tuple[str, ...] | None = None
    parameters: Mapping[str, Callable[[Array], ArrayLike]] = field(
        default_factory=dict[str, Callable[[Array], ArrayLike]]
    )
    position: tuple[str, str] = ("p_x", "p_y")
    window: float = WINDOW
    begin: float | None = None
    acceleration: float = FASTEST

    def __post_init__(self) -> None:
        check_on(checked(self.path, "path", Path), checked(self.profile, "profile", SpeedProfile))
        check_vehicle(self.vehicle)
        if self.outputs is not None:
            object.__setattr__(
                self, "outputs", checked_outputs(self.outputs, known_signals(self.vehicle), self.vehicle)
            )
        for name, function in as_mapping(self.parameters, "parameters").items():
            if not callable(function):
                raise ArgumentError(f"parameters[{name!r}]", repr(function), "a function of arc lengths (n,) [m]")
        if len(as_names(self.position, "position")) != 2:
            raise ArgumentError("position", repr(self.position), 'two names such as ("p_x", "p_y")')
        positive_number(self.window, "window")
        positive_number(self.acceleration, "acceleration")
        if self.begin is not None:
            finite_number(self.begin, "begin")

    def start(self, problem: Problem | None = None) -> RunningPathTracking:
        """What remembers, for one run, how far the vehicle is.

        Parameters
        ----------
        problem : Problem, optional
            Of the controller: decides which signals and parameters are known. Without it, those of the state.
        """
        return RunningPathTracking(self, problem)

    def preview(self, times: Array, x: NamedArray[float]) -> Preview:
        """What lies ahead of a vehicle of which nothing is known but where it is, see `Reference`."""
        return self.start().preview(times, x)


class RunningPathTracking:
    """`PathTracking` in a run.

    Attributes
    ----------
    progress : float
        Arc length of the vehicle's nearest point, counted on from lap to lap [m]; NaN before the first preview.
    """

    def __init__(self, settings: PathTracking, problem: Problem | None = None) -> None:
        self.progress = np.nan
        self._settings, self._path, self._profile = settings, settings.path, settings.profile
        self._parameters = dict(settings.parameters)
        named = () if problem is None else problem.model.parameters
        self._of_path = tuple(name for name in OF_PATH if name in named and name not in self._parameters)
        self._names = settings.outputs
        if self._names is None and problem is not None:
            self._names = wanted_signals(problem, known_signals(settings.vehicle))
        self._signals: Signals | None = None
        self._known = known_signals(settings.vehicle)
        self._now = self._speed = 0.0
        self._psi, self._turns = np.nan, 0
        self._previewed = np.nan, np.nan
        self._at: list[int] = []
        self._v_x: int | None = None

    @property
    def lap(self) -> int:
        """Laps completed, of a closed path."""
        return int(self.progress // self._path.length) if self._path.closed and isfinite(self.progress) else 0

    def preview(self, times: Array, x: NamedArray[float]) -> Preview:
        """Signals and parameters ahead, see `Reference`."""
        x_now, y_now, psi = self._pose(x)
        self._move(float(times[0]), x_now, y_now, psi)
        self._previewed = x_now, y_now
        s, speed = self._ahead(times - times[0], x.values[self._v_x] if self._v_x is not None else np.nan)
        points, middle = self._path.at(s), 0.5 * (s[:-1] + s[1:])
        self._speed = float(speed[0])
        turns = self._alongside(psi, float(points.heading[0]))
        if turns:
            points = points._replace(heading=points.heading + turns * TURN)
        signals = motion(s, points, speed, self._settings.vehicle, self._names or ())
        ahead = {name: _by_place(function, middle, name) for name, function in self._parameters.items()}
        if self._of_path:
            between = self._path.at(middle)
            ahead |= {name: getattr(between, name) for name in self._of_path}
        return Preview.of_own(signals, ahead)

    def locate(self, x: NamedArray[float]) -> dict[str, float]:
        """Place of a vehicle beside the path, for models that know it by that: s [m], n [m], heading_error [rad].

        The path's nearest point is looked for near the progress of the latest preview.

        Parameters
        ----------
        x : NamedArray
            State of a vehicle with a position and psi.
        """
        x_now, y_now, psi = self._pose(x)
        if not (isfinite(self.progress) and isfinite(x_now) and isfinite(y_now)):
            return dict.fromkeys(("s", "n", "heading_error"), np.nan)
        s, window = self.progress, self._settings.window
        if (x_now, y_now) != self._previewed:
            s = self._path.nearest(x_now, y_now, s - window, s + window)
        here = self._path.at(s)
        return {"s": s, "n": float(here.left(x_now, y_now)), "heading_error": float(here.turned(psi))}

    def _pose(self, x: NamedArray[float]) -> tuple[float, float, float]:
        """Position [m] and heading [rad] of a state, NaN where it has no heading."""
        if x.signals is not self._signals:
            self._look_up(x.signals)
        state = x.values.tolist()
        x_now, y_now, *heading = (state[i] for i in self._at)
        return x_now, y_now, heading[0] if heading else np.nan

    def _look_up(self, states: Signals) -> None:
        """Where in the state to look, once."""
        self._at = [states.index(name, "position") for name in self._settings.position]
        if "psi" in states:
            self._at.append(states.index("psi"))
        self._v_x = states.index("v_x") if "v_x" in states else None
        if self._names is None:
            self._names = tuple(name for name in self._known if name in states)
        self._signals = states

    def _move(self, now: float, x: float, y: float, psi: float) -> None:
        """Progress of a vehicle that is at x, y now; unchanged if that is not finite."""
        elapsed, self._now = now - self._now, now
        if not (isfinite(x) and isfinite(y)):
            return
        settings, path = self._settings, self._path
        if isfinite(self.progress) and elapsed >= 0.0:
            # It may have stood still since, or have been twice as fast as it should be.
            low, high = self.progress - settings.window, self.progress + settings.window
            self.progress = path.nearest(x, y, low, high + 2.0 * self._speed * elapsed)
        elif settings.begin is not None:
            self.progress = path.nearest(x, y, settings.begin - settings.window, settings.begin + settings.window)
        else:
            s = path.project((x, y), heading=psi if isfinite(psi) else None)
            behind = path.closed and not self._profile.closed and s > 0.5 * path.length
            self.progress = s - path.length if behind else s  # behind the line of a standing start

    def _ahead(self, since: Array, v_x: float) -> tuple[Array, Array]:
        """Arc lengths and speeds (n,) at times (n,) from now on."""
        if not isfinite(self.progress):
            return np.full_like(since, np.nan), np.full_like(since, np.nan)
        profile = self._profile
        s, speed, _ = profile.at_time(profile.time_at(self.progress) + since)
        if not v_x < speed[0] - SLOWER:
            return s, speed
        # It accelerates until it is as fast as the profile where it is then.
        v, a = max(v_x, 0.0), self._settings.acceleration
        moments = since[-1] * MOMENTS
        driven = self.progress + (v + 0.5 * a * moments) * moments
        caught = np.flatnonzero(v + a * moments >= profile.speed_at(driven))
        slow = self.progress + (v + 0.5 * a * since) * since, v + a * since
        if not len(caught):
            return slow
        then = moments[caught[0]]
        s, speed, _ = profile.at_time(profile.time_at(driven[caught[0]]) + since - then)
        return np.where(since < then, slow[0], s), np.where(since < then, slow[1], speed)

    def _alongside(self, psi: float, heading: float) -> int:
        """Full turns that bring the path's heading next to the vehicle's, which may be wrapped."""
        if not (isfinite(psi) and isfinite(heading)):
            return self._turns
        if isfinite(self._psi):
            psi = self._psi + (psi - self._psi + pi) % TURN - pi
            if abs(psi - heading - self._turns * TURN) > OTHER_WAY:
                self._turns = round((psi - heading) / TURN)
        else:
            self._turns = round((psi - heading) / TURN)
        self._psi = psi
        return self._turns


def _by_place(function: Callable[[Array], ArrayLike], s: Array, name: str) -> Array:
    values = np.array(function(s), dtype=float)  # a copy: it may be an array of the function's own
    if values.shape not in ((), s.shape):
        raise ShapeError(
            f"parameters[{name!r}](s)", f"shape {values.shape}", f"shape {s.shape}, one at each arc length"
        )
    return values
