"""ISO 3888-2, the moose test: how fast a car can enter and touch no cone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.references import SpeedProfile
from rumo.references.manoeuvres import iso_3888_2
from rumo.studies.drive import (
    DrivenCar,
    DrivenRoad,
    DriveRun,
    DriveSetting,
    driven_car,
    estimator_of,
    noise_of,
)
from rumo.studies.drive.run import FINISHED
from rumo.studies.kpis import Driven
from rumo.studies.roads.case import Case, Conditions, Progress, Variant
from rumo.studies.roads.cases.tracks import problem_of
from rumo.studies.roads.outcome import RoadDrive, driven_until, recorded
from rumo.studies.roads.rows import Goal, Outcomes, Row, values
from rumo.studies.sharing import shared_controller
from rumo.vehicles import PASSENGER_CAR as CAR

if TYPE_CHECKING:
    import xarray as xr

KMH = 1.0 / 3.6
SAMPLING_TIME = 0.04
PATIENCE = 1.5
"""A drive may take so many times what its speed takes."""
BETWEEN = 8
"""Parts of a sample at whose ends the car's corners are compared with the cones: a tenth of a metre."""
CHANGE = iso_3888_2(CAR.width)
MARGIN = 0.19
"""Between the sides of the car and the cones that its path leads past: almost all that the first lane has [m]."""


@dataclass(frozen=True)
class Moose(Case):
    """The highest speed up to which entries are clean: steps of 5 km/h up to the first that is not, then of 1 km/h.

    Parameters
    ----------
    goal : float
        For the lowest of all seeds [km/h].
    slowest, fastest : int
        The first entry, and the last one that is tried [km/h].
    steps : tuple of int
        From one entry to the next, up to the first that is not clean; then from the last clean one on [km/h].
    """

    goal: float
    slowest: int = 50
    fastest: int = 85
    steps: tuple[int, ...] = (5, 1)

    title = "ISO 3888-2"
    told = (
        "Obstacle avoidance by the passenger car with four wheels and load transfer, between cones that its problem "
        "knows as limits of the track. The speed of the entry is the reference all the way, and the controller may "
        "brake. Entries get faster by 5 km/h, then by 1 km/h, until a corner of the car is beyond an edge of a lane; "
        "wind, noise, a Kalman filter, a sample of delay."
    )
    controllers = ("rti", "nlp", "ltv")

    def variants(self, conditions: Conditions) -> tuple[Variant, ...]:
        """The seeds."""
        return conditions.seeds

    def drive(
        self, controller: str, variant: Variant, conditions: Conditions, progress: Progress | None = None
    ) -> RoadDrive:
        """Entries at ever higher speeds, up to the first that is not clean; what is kept is the last clean one."""
        best = first = self.enter(controller, self.slowest, int(variant))
        if not is_clean(first):
            return RoadDrive({**first.outcome, "entry_km_h": None, "touched_at_km_h": self.slowest}, first.log)
        clean, touched = self.slowest, self.fastest + 1
        for i, step in enumerate(self.steps):
            while clean + step < touched:
                if progress is not None:
                    progress(i, len(self.steps))
                tried = self.enter(controller, clean + step, int(variant))
                if is_clean(tried):
                    best, clean = tried, clean + step
                else:
                    touched = clean + step
        return RoadDrive({**best.outcome, "touched_at_km_h": touched if touched <= self.fastest else None}, best.log)

    def enter(self, controller: str, speed: float, seed: int) -> RoadDrive:
        """One drive through the cones, at a speed [km/h]."""
        road = road_of()
        profile = SpeedProfile((0.0, road.path.length), (speed * KMH, speed * KMH))
        driven = car_of()
        setting = DriveSetting(
            road.path,
            profile,
            driven,
            PATIENCE * profile.duration,
            track=road.track,
            controller=controller,
            estimator=estimator_of("ekf", CAR),
            noise=noise_of(CAR),
            seed=seed,
            **problem_of(driven),
        )
        scenario = setting.scenario()
        run = DriveRun(scenario, road.track, road.path, profile, 0.0, road.path.length)
        log = driven_until(run, shared_controller(scenario))
        seen = _driven(log)
        left = speed_at(seen, CHANGE.length)
        figures = {
            "entry_km_h": speed,
            "least_room_m": least_room(seen),
            "left_at_km_h": None if left is None else left / KMH,
        }
        return recorded(log, figures, seen)

    def rows(self, controller: str, outcomes: Outcomes, conditions: Conditions) -> list[Row]:
        """The highest clean entry, lowest and median of the seeds."""
        found = values(outcomes, "entry_km_h")
        speeds = [found.get(variant, np.nan) for variant in outcomes]
        known = bool(speeds) and not np.isnan(speeds).any()
        note = "" if known else f"none at {self.slowest} km/h or more"
        lowest, middle = (float(np.min(speeds)), float(np.median(speeds))) if known else (None, None)
        goal = Goal(self.goal, at_least=True)
        return [
            Row("Highest clean entry, median", middle, "km/h", None, note),
            Row("Highest clean entry, lowest", lowest, "km/h", goal, note),
        ]

    def worst(self, outcomes: Outcomes) -> Variant:
        """The lowest."""
        return min(outcomes, key=lambda variant: outcomes[variant]["entry_km_h"] or 0.0)

    def variant_words(self, variant: Variant) -> str:
        """For readers."""
        return f"the last clean entry of seed {variant}"

    def scene(self, variant: Variant, conditions: Conditions) -> tuple[DrivenRoad, Callable[[Any], Driven]]:
        """The lanes."""
        return road_of(), _driven


@lru_cache
def road_of() -> DrivenRoad:
    """The lanes and the line through them."""
    return DrivenRoad(CHANGE.track(), CHANGE.path(MARGIN), CHANGE.cones())


@lru_cache
def car_of() -> DrivenCar:
    """The car."""
    return driven_car("four-wheel", CAR, SAMPLING_TIME)


def _driven(log: xr.Dataset) -> Driven:
    road = road_of()
    return Driven(log, road.track, road.path, None, CAR)


def is_clean(drive: RoadDrive) -> bool:
    """Whether a car has got through and touched no cone."""
    return drive.outcome["outcome"] == FINISHED and (drive.outcome["least_room_m"] or 0.0) >= 0.0


def least_room(seen: Driven) -> float | None:
    """Least distance from the car's corners to the lanes' edges [m], also between samples; negative beyond them."""
    motion = seen.motion("p_x", "p_y", "psi")
    if motion is None or not len(seen.time):
        return None
    time = np.linspace(seen.time[0], seen.time[-1], 1 + (len(seen.time) - 1) * BETWEEN)
    x, y, psi = (np.interp(time, seen.time, values) for values in motion)
    room = np.inf
    for ahead in CAR.ends:
        for left in (0.5 * CAR.width, -0.5 * CAR.width):
            at_x, at_y = x + ahead * np.cos(psi) - left * np.sin(psi), y + ahead * np.sin(psi) + left * np.cos(psi)
            right_edge, left_edge = CHANGE.limits(at_x)
            room = min(room, float(np.minimum(left_edge - at_y, at_y - right_edge).min()))
    return room


def speed_at(seen: Driven, x: float) -> float | None:
    """Speed where the car has got to a place along the road [m/s]; None if it has not."""
    motion = seen.motion("p_x", "v_x", "v_y")
    if motion is None or motion[0][-1] < x:
        return None
    return float(np.hypot(motion[1], motion[2])[int(np.argmax(motion[0] >= x))])
