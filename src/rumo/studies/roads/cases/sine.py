"""The paper's sine path, shorter, by the passenger car: a point to be kept up with, up to beyond the grip."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rumo.problem import Problem
from rumo.references import Path, SpeedProfile, TimedPath, Track
from rumo.references.generators import sine
from rumo.studies.drive import DrivenRoad, DriveRun, DriveSetting, driven_car, estimator_of, noise_of
from rumo.studies.drive.run import FINISHED
from rumo.studies.kpis import SETTLED, Driven
from rumo.studies.kpis.base import largest as largest_of
from rumo.studies.kpis.base import rms
from rumo.studies.roads.case import Case, Conditions, Progress, Variant, worst_by
from rumo.studies.roads.outcome import RoadDrive, driven_until, recorded
from rumo.studies.roads.rows import Goal, Outcomes, Row, largest, median, share
from rumo.studies.sharing import shared_controller
from rumo.vehicles import PASSENGER_CAR as CAR
from rumo.vehicles import rolling_bicycle, trajectory_problem
from rumo.vehicles.parameters import GRAVITY

AMPLITUDE, WAVELENGTH = 3.0, 50.0
RUN = 24.0
"""Length of a drive, as in the paper [s]."""
SAMPLING_TIME = 0.04
LARGEST_SLIP = 3.0
"""See `slip_limits`: beyond the grip, plans have to use the tyres up to their peak and a little further."""


@dataclass(frozen=True)
class Sine(Case):
    """A sine path at a speed, with goals for the RMS distance from its point after 2 s.

    Parameters
    ----------
    speed : float
        Along the path [m/s].
    middle, most : float, optional
        Goals for the median and the largest of all seeds [m].
    """

    speed: float
    middle: float | None
    most: float | None

    @property
    def title(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """For readers."""
        return f"Sine, {self.speed:g} m/s"

    @property
    def told(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """What is driven."""
        need = self.speed**2 * AMPLITUDE * (2.0 * np.pi / WAVELENGTH) ** 2 / (CAR.mu * GRAVITY)
        return (
            f"A sine path of {AMPLITUDE:g} m and {WAVELENGTH:g} m by the clock, at {self.speed:g} m/s, which takes "
            f"{100.0 * need:.0f} % of the grip; wind, noise, a Kalman filter, a sample of delay."
        )

    def variants(self, conditions: Conditions) -> tuple[Variant, ...]:
        """The seeds."""
        return conditions.seeds

    def drive(
        self, controller: str, variant: Variant, conditions: Conditions, progress: Progress | None = None
    ) -> RoadDrive:
        """One drive."""
        road, profile, distance = path_of(self.speed), self._profile, self.speed * RUN
        setting = DriveSetting(
            road.path,
            profile,
            driven_car("four-wheel", CAR, SAMPLING_TIME),
            RUN + 2.0,
            problem=clock_problem(),
            reference=TimedPath(road.path, profile, vehicle=CAR),
            observed=rolling_bicycle(CAR),
            controller=controller,
            estimator=estimator_of("ekf", CAR),
            noise=noise_of(CAR),
            seed=int(variant),
        )
        scenario = setting.scenario()
        run = DriveRun(scenario, road.track, road.path, profile, 0.0, distance)
        log = driven_until(run, shared_controller(scenario), progress)
        seen = self._driven(log)
        error = self._error(seen)
        settled = None if log.attrs["outcome"] != FINISHED else error[seen.time >= SETTLED]
        return recorded(log, {"position_rms_m": rms(settled), "position_max_m": largest_of(settled)}, seen)

    def rows(self, controller: str, outcomes: Outcomes, conditions: Conditions) -> list[Row]:
        """Held or not, and how close."""
        held, note = share(outcomes, FINISHED)
        most, seed = largest(outcomes, "position_rms_m")
        return [
            Row("Held", held, "%", Goal(100.0, at_least=True), note),
            Row(
                "Position error after 2 s, RMS, median",
                median(outcomes, "position_rms_m"),
                "m",
                None if self.middle is None else Goal(self.middle),
            ),
            Row(
                "Position error after 2 s, RMS, largest",
                most,
                "m",
                None if self.most is None else Goal(self.most),
                f"seed {seed}",
            ),
        ]

    def worst(self, outcomes: Outcomes) -> Variant:
        """The farthest from its point."""
        return worst_by(outcomes, "position_rms_m")

    def scene(self, variant: Variant, conditions: Conditions) -> tuple[DrivenRoad, Callable[[Any], Driven]]:
        """The path."""
        return path_of(self.speed), self._driven

    @property
    def _profile(self) -> SpeedProfile:
        return SpeedProfile((0.0, path_of(self.speed).path.length), (self.speed, self.speed))

    def _driven(self, log: Any) -> Driven:
        road = path_of(self.speed)
        return Driven(log, path=road.path, profile=self._profile, car=CAR)

    def _error(self, seen: Driven) -> Any:
        """Distance from the point that moves on at the speed (K,) [m]."""
        point = path_of(self.speed).path.at(self.speed * seen.time)
        x, y = seen.motion("p_x", "p_y") or (np.empty(0), np.empty(0))
        return np.hypot(x - point.x, y - point.y)


@lru_cache
def path_of(speed: float) -> DrivenRoad:
    """The path, long enough for a drive and what lies ahead at its end."""
    path: Path = sine(AMPLITUDE, WAVELENGTH, int(np.ceil((RUN + 4.0) * speed / WAVELENGTH)))
    return DrivenRoad(Track(path, 3.0, 3.0, "sine"), path)


@lru_cache
def clock_problem() -> Problem:
    """Keep up with a point: time that was lost can be made up for only by a car that knows where it is to be now."""
    problem = trajectory_problem(CAR, largest_slip=LARGEST_SLIP)
    # Inputs as free as those of `path_problem`; what a car has to do with heading and steering at its grip is its own.
    return problem.changed(weights={"torque": 1.0, "steering_rate": 0.3, "psi": 0.0, "delta": 0.0})
