"""One lap of each track, at a share of the grip."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from rumo.errors import ArgumentError
from rumo.extras import required
from rumo.studies.drive import Drive, DrivenCar, DrivenRoad
from rumo.studies.drive.run import FINISHED, DriveRun
from rumo.studies.kpis import Driven, kpis
from rumo.studies.roads.case import Case, Conditions, Progress, Variant, worst_by
from rumo.studies.roads.outcome import RoadDrive, driven_until, recorded
from rumo.studies.roads.rows import Goal, Outcomes, Row, largest, share
from rumo.studies.sharing import shared_controller
from rumo.vehicles import VehicleParameters, path_problem, rolling_bicycle

FIGURES = ("time_off_track", "least_room", "lateral_deviation_rms", "lateral_deviation_max", "lap_time_over_profile")
NLP = "nlp"


@dataclass(frozen=True)
class Tracks(Case):
    """A lap of each track.

    Parameters
    ----------
    title, told : str
        For readers.
    plant : str
        See `Drive`.
    grip : float
        Share of friction that the speed profile uses.
    estimator : str
        See `Drive`.
    lateral, over : float, optional
        Goals for the lateral RMS deviation [m], and for how much longer than the profile a lap takes [%].
    goals : bool
        Whether there are any at all.
    """

    title: str
    told: str
    plant: str = "four-wheel"
    grip: float = 0.9
    estimator: str = "ekf"
    lateral: float | None = 0.05
    over: float | None = 0.5
    goals: bool = True

    @property
    def lacking(self) -> str:
        """That CommonRoad's models are not installed, where they are driven."""
        if not self.plant.startswith("commonroad"):
            return ""
        try:
            required("vehiclemodels.vehicle_parameters", "commonroad", "commonroad-vehicle-models")
        except ArgumentError as error:
            return f"Not driven: {error}"
        return ""

    def variants(self, conditions: Conditions) -> tuple[Variant, ...]:
        """The tracks' names."""
        return tuple(conditions.files)

    def check(self, conditions: Conditions) -> None:
        """Raise for a track that is none."""
        for track in conditions.tracks:
            self._lap(track, conditions.seeds[0])

    def drive(
        self, controller: str, variant: Variant, conditions: Conditions, progress: Progress | None = None
    ) -> RoadDrive:
        """One lap, or a part of it by the NLP."""
        lap = self._lap(conditions.files[str(variant)], conditions.seeds[0])
        distance = lap.length
        if controller == NLP and conditions.nlp_distance is not None:
            distance = min(distance, conditions.nlp_distance)
        scenario = replace(lap.setting, controller=controller, **problem_of(lap.driven_car)).scenario()
        run = DriveRun(scenario, lap.road.track, lap.road.path, lap.profile, 0.0, distance)
        log = driven_until(run, shared_controller(scenario), progress)
        seen = lap.driven(log)
        return recorded(log, {"distance_m": distance, "whole": distance == lap.length, **kpis(seen, FIGURES)}, seen)

    def rows(self, controller: str, outcomes: Outcomes, conditions: Conditions) -> list[Row]:
        """Whether every lap was finished, on the track, close to the path, and in time."""
        arrived, note = share(outcomes, FINISHED)
        off, where = largest(outcomes, "time_off_track_s")
        lateral, widest = largest(outcomes, "lateral_deviation_rms_m")
        parts = {variant: each for variant, each in outcomes.items() if not each["whole"]}
        what = "Laps finished" if not parts else f"First {conditions.nlp_distance:g} m finished"
        rows = [
            Row(what, arrived, "%", self._goal(Goal(100.0, at_least=True)), note),
            Row("Time off track, longest", off, "s", self._goal(Goal(0.0)), where if off else ""),
            Row(
                "Lateral deviation, RMS, largest",
                lateral,
                "m",
                self._goal(None if self.lateral is None else Goal(self.lateral)),
                widest,
            ),
        ]
        whole = {variant: each for variant, each in outcomes.items() if each["whole"]}
        if whole:
            over, slowest = largest(whole, "lap_time_over_profile_percent")
            goal = self._goal(None if self.over is None else Goal(self.over))
            rows.append(Row("Lap time over the profile's, longest", over, "%", goal, slowest))
        return rows

    def worst(self, outcomes: Outcomes) -> Variant:
        """A car that is lost, else the one that deviated most."""
        lost = [variant for variant, each in outcomes.items() if each["outcome"] != FINISHED]
        return lost[0] if lost else worst_by(outcomes, "lateral_deviation_rms_m")

    def scene(self, variant: Variant, conditions: Conditions) -> tuple[DrivenRoad, Callable[[Any], Driven]]:
        """The track."""
        lap = self._lap(conditions.files[str(variant)], conditions.seeds[0])
        return lap.road, lap.driven

    def _goal(self, goal: Goal | None) -> Goal | None:
        return goal if self.goals else None

    def _lap(self, track: str, seed: int) -> Drive:
        return lap_of(track, self.plant, self.grip, self.estimator, seed)


@lru_cache(maxsize=64)
def lap_of(track: str, plant: str, grip: float, estimator: str, seed: int) -> Drive:
    """A lap, whose track is read and whose profile is found once."""
    return Drive(track, plant=plant, grip=grip, estimator=estimator, seed=seed)


def problem_of(driven: DrivenCar) -> dict[str, Any]:
    """Problem and observed model of a car, the same for all its drives, so that a controller is."""
    return _problem_of(driven.car, driven.drive)


@lru_cache(maxsize=8)
def _problem_of(car: VehicleParameters, drive: Any) -> dict[str, Any]:
    return {"problem": path_problem(car, drive=drive), "observed": rolling_bicycle(car, drive=drive)}
