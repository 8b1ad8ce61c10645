"""A racing car at a scale of 1:10, whose sensors and actuators are late."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from rumo.actuation import Actuation, Actuator
from rumo.estimation import ExtendedKalman
from rumo.problem import Problem
from rumo.references import SpeedLimits, SpeedProfile, Track, speed_profile
from rumo.references.generators import Bend, bends, closing
from rumo.simulation import Sensors
from rumo.studies.drive import DrivenCar, DrivenRoad, DriveRun, DriveSetting, driven_car, noise_of
from rumo.studies.drive.run import FINISHED
from rumo.studies.drive.start import first_motion
from rumo.studies.kpis import Driven, kpis
from rumo.studies.roads.case import Case, Conditions, Progress, Variant, worst_by
from rumo.studies.roads.cases.tracks import FIGURES
from rumo.studies.roads.outcome import RoadDrive, driven_until, recorded
from rumo.studies.roads.rows import Goal, Outcomes, Row, largest, share
from rumo.studies.sharing import shared_controller
from rumo.vehicles import RACER_1_10 as CAR
from rumo.vehicles import car_filter, path_problem, rolling_bicycle

SAMPLING_TIME = 0.02
GRIP = 0.9
LATE = 3
"""Samples from a measurement to its arrival."""
ACTUATION = Actuation(
    dict.fromkeys(("torque", "steering_rate"), Actuator(dead_time=0.02)),
)
"""From a command to what it does."""
WIDTH = 5.0
"""Of the track [m]."""
PATIENCE = 1.3


@dataclass(frozen=True)
class Racer(Case):
    """A lap with each seed."""

    title = "1:10 racer"
    told = (
        f"A lap of a track of {WIDTH:g} m of width by the car of F1TENTH with four wheels and load transfer, at "
        f"{GRIP:g} of its grip, and {1.0 / SAMPLING_TIME:g} Hz; actuators have a dead time of 20 ms, measurements are "
        f"{LATE} samples old when they arrive, and both are known; wind, noise, a Kalman filter."
    )

    def variants(self, conditions: Conditions) -> tuple[Variant, ...]:
        """The seeds."""
        return conditions.seeds

    def drive(
        self, controller: str, variant: Variant, conditions: Conditions, progress: Progress | None = None
    ) -> RoadDrive:
        """One lap."""
        road, profile, noise = road_of(), profile_of(), noise_of(CAR)
        setting = DriveSetting(
            road.path,
            profile,
            car_of(),
            PATIENCE * profile.duration,
            track=road.track,
            problem=problem_of(),
            observed=rolling_bicycle(CAR),
            controller=controller,
            estimator=late_filter(profile),
            noise=noise,
            seed=int(variant),
        )
        sensors = Sensors(noise, late=dict.fromkeys(noise, LATE))
        scenario = replace(setting.scenario(), sensors=sensors, actuation=ACTUATION)
        distance = road.path.length
        if controller == "nlp" and conditions.nlp_distance is not None:
            distance = min(distance, conditions.nlp_distance)
        run = DriveRun(scenario, road.track, road.path, profile, 0.0, distance)
        log = driven_until(run, shared_controller(scenario), progress)
        seen = self._driven(log)
        whole = {"distance_m": distance, "whole": distance == road.path.length}
        return recorded(log, {**whole, **kpis(seen, FIGURES)}, seen)

    def rows(self, controller: str, outcomes: Outcomes, conditions: Conditions) -> list[Row]:
        """Whether it laps, on the track, and how close."""
        arrived, note = share(outcomes, FINISHED)
        off, _ = largest(outcomes, "time_off_track_s")
        lateral, seed = largest(outcomes, "lateral_deviation_rms_m")
        whole = all(each["whole"] for each in outcomes.values())
        what = "Laps finished" if whole else f"First {conditions.nlp_distance:g} m finished"
        return [
            Row(what, arrived, "%", Goal(100.0, at_least=True), note),
            Row("Time off track, longest", off, "s", Goal(0.0)),
            Row("Lateral deviation, RMS, largest", lateral, "m", None, f"seed {seed}"),
        ]

    def worst(self, outcomes: Outcomes) -> Variant:
        """A car that is lost, else the one that deviated most."""
        lost = [variant for variant, each in outcomes.items() if each["outcome"] != FINISHED]
        return lost[0] if lost else worst_by(outcomes, "lateral_deviation_rms_m")

    def scene(self, variant: Variant, conditions: Conditions) -> tuple[DrivenRoad, Callable[[Any], Driven]]:
        """The track."""
        return road_of(), self._driven

    def _driven(self, log: Any) -> Driven:
        return Driven(log, road_of().track, road_of().path, profile_of(), CAR)


@lru_cache
def road_of() -> DrivenRoad:
    """A hundred and some metres of straights and bends, with a hairpin and a chicane."""
    turn = np.deg2rad
    segments = [
        20.0,
        Bend(6.0, turn(90.0), 4.0),
        8.0,
        Bend(5.0, turn(-45.0), 2.5),
        3.0,
        Bend(8.0, turn(90.0), 5.0),
        15.0,
        Bend(3.2, turn(160.0), 3.0),
        8.0,
        Bend(4.5, turn(-115.0), 3.0),
        20.0,
        Bend(4.0, turn(30.0), 1.5),
        Bend(4.0, turn(-60.0), 1.5),
        Bend(4.0, turn(30.0), 1.5),
        12.0,
        Bend(4.0, turn(90.0), 3.0),
        10.0,
        Bend(8.0, turn(90.0), 5.0),
        25.0,
    ]
    path = bends(closing(segments, 14, 16), closed=True)
    return DrivenRoad(Track(path, 0.5 * WIDTH, 0.5 * WIDTH, "small club"), path)


@lru_cache
def profile_of() -> SpeedProfile:
    """At its share of grip."""
    return speed_profile(road_of().path, SpeedLimits.of_car(CAR, GRIP), spacing=0.05)


@lru_cache
def problem_of() -> Problem:
    """With the actuators' delay."""
    return path_problem(CAR, sampling_time=SAMPLING_TIME, actuation=ACTUATION)


def late_filter(profile: SpeedProfile) -> ExtendedKalman:
    """A filter that knows how late its measurements are, and where the car is put down."""
    noise, late = noise_of(CAR), dict.fromkeys(noise_of(CAR), LATE)
    motion, _ = first_motion(road_of().path, profile, CAR, car_of().drive)
    usual = car_filter(CAR, noise, sampling_time=SAMPLING_TIME)
    return replace(usual, late=late, x={name: motion[name] for name in noise}, deviations=noise)


@lru_cache
def car_of() -> DrivenCar:
    """The car."""
    return driven_car("four-wheel", CAR, SAMPLING_TIME)
