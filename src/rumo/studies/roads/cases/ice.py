"""A patch of ice in a bend that nobody was told of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.references import Path, SpeedProfile, Track
from rumo.signals import Array
from rumo.simulation import ByPlace
from rumo.studies.drive import DrivenRoad, DriveRun, DriveSetting, driven_car, estimator_of, noise_of
from rumo.studies.drive.run import FINISHED
from rumo.studies.kpis import Driven
from rumo.studies.roads.case import Case, Conditions, Progress, Variant, worst_by
from rumo.studies.roads.cases.tracks import problem_of
from rumo.studies.roads.outcome import RoadDrive, driven_until, recorded
from rumo.studies.roads.rows import Goal, Outcomes, Row, largest, share
from rumo.studies.sharing import shared_controller
from rumo.vehicles import PASSENGER_CAR as CAR
from rumo.vehicles.parameters import GRAVITY

if TYPE_CHECKING:
    import xarray as xr

DRY, ICE = 0.9, 0.3
"""Friction."""
LENGTH = 20.0
"""Of the ice [m]."""
USED = 0.6
"""Share of the dry friction that the bend takes."""
SAMPLING_TIME = 0.04
APPROACH = 30.0
"""Straight before the bend [m]."""
ENTRY, BEFORE = 1.0, 0.5
"""Time in the clothoid, and in the bend before the ice [s]."""
AFTER = 3.0
"""From where the ice begins until the car is to be back [s]."""
WATCHED = 3.0
"""How long it is watched from then on [s]."""
SPIN = 45.0
"""A sideslip from which a car spins [degrees]."""


@dataclass(frozen=True)
class Ice(Case):
    """Bends of some radii [m], at the same share of the dry friction."""

    radii: tuple[float, ...] = (25.0, 50.0, 100.0, 200.0)

    title = "Ice"
    marks = "Where the ice begins and ends"
    told = (
        f"Bends that take {100.0 * USED:g} % of the dry friction of {DRY:g}; {LENGTH:g} m of them have one of {ICE:g}, "
        "below the whole car as soon as its centre of gravity is there. Controller, filter and profile are told of dry "
        "roads only; the passenger car with four wheels, wind, noise, a Kalman filter, a sample of delay."
    )

    def variants(self, conditions: Conditions) -> tuple[Variant, ...]:
        """The radii."""
        return self.radii

    def drive(
        self, controller: str, variant: Variant, conditions: Conditions, progress: Progress | None = None
    ) -> RoadDrive:
        """One bend."""
        bend = Bend(float(variant))
        road, profile = bend.road, bend.profile
        car = driven_car("four-wheel", CAR, SAMPLING_TIME)
        setting = DriveSetting(
            road.path,
            profile,
            car,
            1.5 * profile.duration,
            controller=controller,
            estimator=estimator_of("ekf", CAR),
            noise=noise_of(CAR),
            mu=DRY,
            seed=conditions.seeds[0],
            **problem_of(car),
        )
        dry = setting.scenario()
        begin, end = bend.ice
        friction = ByPlace(road.path, {0.0: DRY, begin: ICE, end: DRY})
        scenario = replace(dry, disturbances={**dry.disturbances, "mu": friction})
        run = DriveRun(scenario, road.track, road.path, profile, 0.0, road.path.length)
        log = driven_until(run, shared_controller(scenario), progress)
        return recorded(log, _figures(bend.driven(log), bend), bend.driven(log))

    def rows(self, controller: str, outcomes: Outcomes, conditions: Conditions) -> list[Row]:
        """Whether it spins, and how soon it is back."""
        held, note = share(outcomes, FINISHED)
        slip, sideways = largest(outcomes, "sideslip_max_deg")
        most, _ = largest(outcomes, "lateral_deviation_max_m")
        back, late = largest(outcomes, "lateral_deviation_max_after_3s_m")
        return [
            Row("Held", held, "%", Goal(100.0, at_least=True), note),
            Row("Sideslip, largest", slip, "degrees", Goal(SPIN), f"radius {sideways} m"),
            Row("Lateral deviation, largest", most, "m"),
            Row("The same from 3 s after the ice began", back, "m", Goal(1.0), f"radius {late} m"),
        ]

    def worst(self, outcomes: Outcomes) -> Variant:
        """The one that was farthest off its path."""
        return worst_by(outcomes, "lateral_deviation_max_m")

    def variant_words(self, variant: Variant) -> str:
        """For readers."""
        return f"radius {float(variant):g} m"

    def scene(self, variant: Variant, conditions: Conditions) -> tuple[DrivenRoad, Callable[[Any], Driven]]:
        """The bend, and where the ice begins and ends."""
        bend = Bend(float(variant))
        return bend.road, bend.driven


@dataclass(frozen=True)
class Bend:
    """A bend of a radius [m], entered by a clothoid, and the ice in it."""

    radius: float

    @property
    def speed(self) -> float:
        """At which it takes its share of friction [m/s]."""
        return float(np.sqrt(USED * DRY * GRAVITY * self.radius))

    @property
    def ice(self) -> tuple[float, float]:
        """Arc lengths between which it is [m]."""
        begin = APPROACH + (ENTRY + BEFORE) * self.speed
        return begin, begin + LENGTH

    @property
    def road(self) -> DrivenRoad:
        """The bend, and as much ground as it takes."""
        return _road(self.radius)

    @property
    def profile(self) -> SpeedProfile:
        """The same speed all the way."""
        return SpeedProfile((0.0, self.road.path.length), (self.speed, self.speed))

    def driven(self, log: xr.Dataset) -> Driven:
        """A drive along it."""
        return Driven(log, None, self.road.path, self.profile, CAR)


@lru_cache
def _road(radius: float) -> DrivenRoad:
    bend = Bend(radius)
    entry, end = APPROACH + ENTRY * bend.speed, bend.ice[0] + (AFTER + WATCHED) * bend.speed
    path = Path.from_curvature((0.0, APPROACH, entry, end), (0.0, 0.0, 1.0 / radius, 1.0 / radius))
    return DrivenRoad(Track(path, 4.0, 4.0, f"bend of {radius:g} m"), path, _marks(path, bend.ice))


def _marks(path: Path, ice: tuple[float, float]) -> Array:
    """Marks on both sides of where ice begins and ends (4, 2)."""
    s = np.array(ice)
    return np.concatenate([path.offset(s, np.full(2, side)) for side in (3.0, -3.0)])


def _figures(seen: Driven, bend: Bend) -> dict[str, Any]:
    motion = seen.motion("v_x", "v_y")
    beside, s = np.abs(seen.deviations["lateral_deviation"]), seen.deviations["progress"]
    v_x, v_y = motion or (np.zeros_like(s), np.zeros_like(s))
    there = s >= bend.ice[0]
    if not there.any():
        return dict.fromkeys(("sideslip_max_deg", "lateral_deviation_max_m", "lateral_deviation_max_after_3s_m"))
    begun = seen.time[int(np.argmax(there))]
    after = beside[seen.time >= begun + AFTER]
    return {
        "speed_m_s": bend.speed,
        "sideslip_max_deg": float(np.rad2deg(np.abs(np.arctan2(v_y, v_x))).max()),
        "lateral_deviation_max_m": float(beside.max()),
        "lateral_deviation_max_after_3s_m": float(after.max()) if after.size else None,
    }
