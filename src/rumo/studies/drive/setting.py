"""From a car and a path to a scenario."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from rumo.controllers import Controller
from rumo.discretization import Discretization
from rumo.errors import ArgumentError
from rumo.estimation import Estimator
from rumo.model import Model
from rumo.problem import Problem
from rumo.references import Path, PathTracking, ReferenceLike, SpeedProfile, Track
from rumo.signals import Array
from rumo.simulation import Constant, Disturbance, RandomWalk, Scenario, Sensors
from rumo.simulation.foreign import as_plant
from rumo.studies.drive.plants import DrivenCar
from rumo.studies.drive.start import first_motion
from rumo.vehicles import Acceleration, RearTorque, VehicleParameters, path_problem, rolling_bicycle
from rumo.vehicles.rolling_bicycle import ROOM

WIND = RandomWalk(mean=2.0, std=1.5)
"""Speed of the wind, which blows to +y [m/s]."""


@dataclass(frozen=True, eq=False)
class DriveSetting:
    """A car, a path, speeds, and who drives: all that a `Scenario` is made of, most of it by default.

    Parameters
    ----------
    path : Path
        To be followed.
    profile : SpeedProfile
        How fast.
    driven : DrivenCar
        What is driven, and as what it is predicted.
    duration : float
        At most [s].
    track : Track, optional
        Whose edges the controller knows, if the problem has `track_limits`.
    problem : Problem, optional
        `path_problem(car)` if not given.
    reference : Reference, optional
        `PathTracking` of the path if not given.
    observed : Model, optional
        Whose states are measured and estimated; `rolling_bicycle(car)` with the default problem, if not given.
    controller : str or type
        See `Scenario`.
    settings : mapping of str to object
        Of the controller.
    discretization : Discretization, optional
        Of the controller; the problem's if not given.
    backend : str, optional
        Of the real-time iteration.
    estimator : Estimator, optional
        None for the state itself, or what is measured of it.
    noise : mapping of str to float
        Standard deviations of measurements; exact without.
    wind : Disturbance
        Speed of the wind, where the plant knows of any [m/s].
    mu : float, optional
        Friction of the road, which the controller is told; the plant's own if not given.
    begin : float
        Arc length at which the car begins, see `first_motion` [m].
    seed : int
        Of wind and noise.
    """

    path: Path
    profile: SpeedProfile
    driven: DrivenCar
    duration: float
    track: Track | None = None
    problem: Problem | None = None
    reference: ReferenceLike | None = None
    observed: Model | None = None
    controller: str | type[Controller] = "rti"
    settings: Mapping[str, Any] | None = None
    discretization: Discretization | None = None
    backend: str | None = None
    estimator: Estimator | None = None
    noise: Mapping[str, float] = field(default_factory=dict[str, float])
    wind: Disturbance = WIND
    mu: float | None = None
    begin: float = 0.0
    seed: int = 0

    def scenario(self) -> Scenario:
        """The run.

        Raises
        ------
        ArgumentError
            If a part does not fit the others, or the plant has no friction to be changed.
        """
        car, drive = self.driven.car, self.driven.drive
        problem, observed = self.problem, self.observed
        if problem is None:
            problem, usual = _path_problem(car, drive)
            observed = observed or usual
        knows = as_plant(self.driven.plant, problem.sampling_time).parameters
        disturbances: dict[str, Disturbance] = {}
        if "wind_speed" in knows:
            disturbances = {"wind_speed": self.wind, "wind_direction": Constant(0.5 * np.pi)}
        if self.mu is not None:
            if "mu" not in knows:
                raise ArgumentError("mu", f"{self.mu:g}", "none: this plant has no friction that could be changed")
            disturbances["mu"] = Constant(self.mu)
            problem = problem.changed(parameters={"mu": self.mu})
        motion, inputs = first_motion(self.path, self.profile, car, drive, begin=self.begin, mu=self.mu)
        held = {name: inputs.get(name, 0.0) for name in problem.model.inputs}
        return Scenario(
            problem,
            self.driven.plant,
            self.driven.start(motion),
            self.reference or self._path_tracking(problem),
            self.duration,
            controller=self.controller,
            settings=self.settings,
            discretization=self.discretization,
            backend=self.backend,
            applied=held,
            sensors=Sensors(self.noise),
            estimator=self.estimator,
            observed=observed,
            disturbances=disturbances,
            seed=self.seed,
        )

    def _path_tracking(self, problem: Problem) -> PathTracking:
        track, car = self.track, self.driven.car
        room: dict[str, Callable[[Array], Array]] = {}
        if track is not None and {*ROOM} <= {*problem.model.parameters}:
            about = track if track.path is self.path else track.about(self.path, min(1.0, 0.25 * car.length))
            room = about.room(car)
        return PathTracking(self.path, self.profile, vehicle=car, begin=self.begin, parameters=room)


@lru_cache(maxsize=16)
def _path_problem(car: VehicleParameters, drive: RearTorque | Acceleration) -> tuple[Problem, Model]:
    """The problem of a car, and whose states are observed: the same for all its drives, so that these share builds."""
    return path_problem(car, drive=drive), rolling_bicycle(car, drive=drive)
