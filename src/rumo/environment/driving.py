"""A closed loop in which somebody else decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rumo.checks import as_mapping, as_numbers, checked, known_names, non_negative_number, positive_number
from rumo.environment.episode import Episode
from rumo.environment.picture import picture
from rumo.environment.place import Place
from rumo.environment.view import View
from rumo.errors import ArgumentError, CallOrderError, PlantError
from rumo.references import PathTracking, Track
from rumo.signals import Array
from rumo.simulation import ClosedLoop, Sample, Scenario

Vector = NDArray[np.float32]
AHEAD = (0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 80.0, 100.0)
"""Distances at which the path is seen [m]."""


class DrivingEnvironment(gymnasium.Env[Vector, Vector]):
    """A scenario of a car on a track, to be learned.

    **Action**: for each input from -1 to 1, where 1 is its upper bound, -1 its lower one, and 0 the problem's safe
    input. It takes the way of a controller's command: delay, actuators and faults are the scenario's.

    **Observation**: what is known at the sample, by the scenario's sensors and estimator; `view.signals` names it.

    **Reward**: progress along the path since the sample before [m], less `deviation_cost` times the sampling time times
    the squared distance from the path.

    An episode is *terminated* when the centre of gravity is off the track, or the plant cannot go on, and *truncated*
    at the scenario's duration. Truth, not the estimate, decides both, and the reward.

    Parameters
    ----------
    scenario : Scenario
        With a `PathTracking` reference, finite bounds on all inputs, and a model that is observed, or the controller's,
        with position and heading.
    track : Track or float
        Along the reference's path; or how far from the path its edges are [m].
    ahead : sequence of float
        Distances along the path at which its curvature and speeds are observed [m].
    deviation_cost : float
        [1/(m s)].
    size : tuple of float
        Length and width of the car [m], for pictures.
    render_mode : str, optional
        "rgb_array" for pictures of the car on the track.

    Attributes
    ----------
    view : View
        What is observed, by names with units.

    Raises
    ------
    ArgumentError
        If the scenario cannot be driven so.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 25}  # noqa: RUF012 -- as gymnasium has it

    def __init__(
        self,
        scenario: Scenario,
        track: Track | float = 5.0,
        *,
        ahead: Sequence[float] = AHEAD,
        deviation_cost: float = 1.0,
        size: tuple[float, float] = (4.5, 1.8),
        render_mode: str | None = None,
    ) -> None:
        reference = checked(scenario, "scenario", Scenario).reference
        if not isinstance(reference, PathTracking):
            raise ArgumentError("scenario.reference", repr(reference), "a rumo.references.PathTracking")
        if not isinstance(track, Track):
            track = Track(reference.path, width := positive_number(track, "track"), width)
        if track.path is not reference.path:
            raise ArgumentError("track", repr(track), "one along the reference's path", "Track(path, left, right) is.")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ArgumentError("render_mode", repr(render_mode), "None or 'rgb_array'")
        self._track, self._reference, self.render_mode = track, reference, render_mode
        self._cost, self._size = non_negative_number(deviation_cost, "deviation_cost"), size
        dt = scenario.problem.sampling_time
        # Its last sample is where the last action has led.
        self._scenario = replace(scenario, duration=scenario.duration + dt)
        self._controller = scenario.make_controller()
        problem = self._controller.problem
        self._lower, self._upper, self._safe = problem.input_lower, problem.input_upper, problem.safe_input
        for name, low, high in zip(problem.model.inputs, self._lower, self._upper, strict=True):
            if not (isfinite(low) and isfinite(high)):
                raise ArgumentError("scenario.problem", f"{name!r} without bounds", "an upper and a lower one")
        loop = ClosedLoop(self._scenario, self._controller)
        self.view = View(loop, track, reference, as_numbers(ahead, "ahead").tolist())
        self._place = Place(reference, 2.0 * dt * float(reference.profile.v.max()))
        self._inputs = problem.model.inputs
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (len(self._inputs),), np.float32)
        self.observation_space = gymnasium.spaces.Box(self.view.low, self.view.high, dtype=np.float32)
        self.metadata = {**type(self).metadata, "render_fps": max(1, round(1.0 / dt))}
        self._episode: Episode | None = None

    @property
    def sample(self) -> Sample | None:
        """The last that is over, with all that logs are made of."""
        return None if self._episode is None else self._episode.sample

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Vector, dict[str, Any]]:
        """Begin an episode.

        Parameters
        ----------
        seed : int, optional
            Of noise and disturbances, for this episode and those that follow.
        options : dict, optional
            `{"x": ...}`: another initial state of the plant.
        """
        super().reset(seed=seed)
        self.close()
        changes = as_mapping(options, "options")
        if changes:
            known_names(changes, "options", ("x",))
        scenario = replace(self._scenario, seed=int(self.np_random.integers(2**31)), **changes)
        loop = ClosedLoop(scenario, self._controller)
        self._episode, self._over = Episode(loop, self._place), False
        self._begin = self._episode.progress
        return self._told(self._episode)

    def step(self, action: ArrayLike) -> tuple[Vector, float, bool, bool, dict[str, Any]]:
        """Apply an action (nu,) for a sample.

        Raises
        ------
        ShapeError, ArgumentError
            If it is no action.
        CallOrderError
            If there is no episode, or it is over.
        """
        episode, before = self._running(), self._running().progress
        values = self._inputs.finite_vector(as_numbers(action, "action"), "action")
        try:
            episode.go_on(self._command(values))
        except PlantError as error:
            self.close()
            observation, info = self._told(episode)
            return observation, 0.0, True, False, {**info, "error": str(error)}
        n, dt = episode.deviation, self._controller.problem.sampling_time
        left, right = self._track.limits(episode.progress)
        off = not -right <= n <= left
        finished = episode.moment.index == self._scenario.samples - 1
        if off or finished:
            self.close()
        reward = episode.progress - before - self._cost * n**2 * dt
        observation, info = self._told(episode)
        return observation, float(reward), bool(off), finished, info

    def baseline(self) -> Vector:
        """What the scenario's own controller would do now, as an action (nu,)."""
        plan = self._running().plan()
        command = self._safe if plan is None else plan.command.values
        side = np.where(command > self._safe, self._upper - self._safe, self._safe - self._lower)
        share = np.divide(command - self._safe, side, out=np.zeros_like(command), where=side > 0.0)
        return np.clip(share, -1.0, 1.0).astype(np.float32)

    def render(self) -> NDArray[np.uint8] | None:
        """The car on the track from above, (400, 600, 3), if the mode is "rgb_array"."""
        episode = self._episode
        if self.render_mode is None or episode is None:
            return None
        pose = (*episode.trail[-1], episode.moment.true["psi"])
        return picture(self._track, episode.progress, episode.trail, pose, self._size)

    def close(self) -> None:
        """End the episode, if there is one."""
        if self._episode is not None:
            self._episode.close()
        self._over = True

    def _running(self) -> Episode:
        if self._episode is None or self._over:
            raise CallOrderError("There is no episode, or it is over: call reset() first.")
        return self._episode

    def _command(self, action: Array) -> Array:
        share = np.clip(action, -1.0, 1.0)
        return self._safe + share * np.where(share > 0.0, self._upper - self._safe, self._safe - self._lower)

    def _told(self, episode: Episode) -> tuple[Vector, dict[str, Any]]:
        info = {
            "time": episode.moment.time,
            "progress": episode.progress - self._begin,
            "lateral_deviation": episode.deviation,
        }
        seen = episode.seen
        s = self._place.of(seen, episode.progress)
        return self.view.of(seen, episode.moment.decided, s, self._place), info
