"""Standing, reversing, parking and crawling: where a controller has little to do, and should do little."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from rumo.references import Legs, SpeedLimits, SpeedProfile, TimedPath, Track, speed_profile
from rumo.references.generators import straight
from rumo.references.manoeuvres import reverse_parking
from rumo.report.charts import Chart, Line, Panels
from rumo.signals import Array
from rumo.simulation import Constant, Scenario, Sensors
from rumo.studies.drive import DrivenCar, DrivenRoad, driven_car, estimator_of, noise_of
from rumo.studies.drive.run import FINISHED, LOST, to_its_end
from rumo.studies.drive.setting import WIND
from rumo.studies.kpis import Driven, kpis
from rumo.studies.looks import label, look
from rumo.studies.roads.case import Case, Conditions, Progress, Variant
from rumo.studies.roads.outcome import RoadDrive, recorded
from rumo.studies.roads.rows import Goal, Outcomes, Row, largest, share
from rumo.studies.sharing import shared_controller
from rumo.vehicles import PASSENGER_CAR as CAR
from rumo.vehicles import trajectory_problem

SAMPLING_TIME = 0.04
PAUSE = 5.0
"""Standing before each leg, and at the end [s]."""
SLOW = SpeedLimits(lateral=1.0, braking=1.0, driving=0.8, top=3.0)
FAR = 1.0
"""From where it is to be, a car is lost [m]."""


@dataclass(frozen=True)
class Rest(Case):
    """Manoeuvres by the clock; `activity` is the goal for the mean move of an input a step at rest [% of its range]."""

    activity: float = 0.5

    title = "At rest and at walking speed"
    told = (
        "From rest to 30 m/s and back to rest, in reverse along a straight, back into a parking space, and a crawl at "
        "0.1 m/s, by the clock; the passenger car with four wheels, wind, noise, a Kalman filter, a sample of delay. "
        "At rest is below 0.1 m/s; the crawl counts from its beginning to its end."
    )

    def variants(self, conditions: Conditions) -> tuple[Variant, ...]:
        """The manoeuvres."""
        return tuple(MANOEUVRES)

    def drive(
        self, controller: str, variant: Variant, conditions: Conditions, progress: Progress | None = None
    ) -> RoadDrive:
        """One of them."""
        name, seed = str(variant), conditions.seeds[0]
        reference, problem, car = reference_of(name), problem_of(), car_of()
        noise = noise_of(CAR)
        first = {signal: float(values[0]) for signal, values in reference.start(problem)(np.zeros(1)).items()}
        scenario = Scenario(
            problem,
            car.plant,
            car.start(first),
            reference,
            reference.duration,
            controller=controller,
            sensors=Sensors(noise),
            estimator=estimator_of("ekf", CAR),
            disturbances={"wind_speed": WIND, "wind_direction": Constant(0.5 * np.pi)},
            seed=seed,
        )
        log = to_its_end(lambda: scenario.run(shared_controller(scenario), progress=progress))
        seen = Driven(log, car=CAR, plant=car.plant)
        away = _away(name, seen)
        lost = bool(away.max() > FAR) or log.attrs.get("outcome") == LOST
        ended = f"Up to {away.max():.2f} m from where it was to be."
        log = log.assign_attrs(outcome=LOST if lost else FINISHED, ended=ended)
        figures = {
            "activity_at_rest_percent": _activity(name, seen),
            "position_max_m": float(away.max()),
            "position_end_m": float(away[-1]),
        }
        return recorded(log, figures, seen)

    def rows(self, controller: str, outcomes: Outcomes, conditions: Conditions) -> list[Row]:
        """How quiet the inputs are, and how far the car is from its place."""
        held, note = share(outcomes, FINISHED)
        activity, busiest = largest(outcomes, "activity_at_rest_percent")
        away, farthest = largest(outcomes, "position_max_m")
        end, last = largest(outcomes, "position_end_m")
        return [
            Row("Held", held, "%", Goal(100.0, at_least=True), note),
            Row("Move of an input a step at rest, mean, largest", activity, "%", Goal(self.activity), busiest),
            Row("Distance from its place, largest", away, "m", None, farthest),
            Row("Distance from its place at the end, largest", end, "m", None, last),
        ]

    def worst(self, outcomes: Outcomes) -> Variant:
        """Parking, which has the most to show."""
        return "parking" if "parking" in outcomes else next(iter(outcomes))

    def scene(self, variant: Variant, conditions: Conditions) -> tuple[DrivenRoad, Callable[[Any], Driven]]:
        """The path of the first leg."""
        reference = reference_of(str(variant))
        path = (reference.legs[0] if isinstance(reference, Legs) else reference).path
        return DrivenRoad(Track(path, 3.0, 3.0, str(variant)), path), lambda log: Driven(log, car=CAR)

    def charts(self, name: str, drives: Any) -> list[Chart | Panels]:
        """Where the cars were, and how far from where they were to be, by time."""
        panels: list[tuple[str, tuple[Line, ...]]] = []
        for variant in MANOEUVRES:
            lines: list[Line] = []
            for controller, found in drives.items():
                motion = found[variant].motion if variant in found else None
                if motion is not None:
                    seen, thin = Driven(motion), replace(look(controller), width=1.0)
                    lines.append(Line(label(controller), seen.time, 100.0 * _away(variant, seen), thin))
            if lines:
                panels.append((f"{variant} [cm]", tuple(lines)))
        title = f"{self.title}: distance from where the car is to be"
        return [Panels(f"{name}-distance", title, "Time [s]", "", tuple(panels), shared="", height=1.6, across=1)]


def _straight(length: float, limits: SpeedLimits, reverse: bool = False) -> TimedPath:
    path = straight(length)
    profile = speed_profile(path, limits, start=0.0, end=0.0)
    return TimedPath(path, profile, CAR, pauses={0.0: PAUSE, length: PAUSE}, reverse=reverse, rear_axle=reverse)


MANOEUVRES: dict[str, Callable[[], TimedPath | Legs]] = {
    "0-30-0": lambda: _straight(800.0, SpeedLimits.comfort(top=30.0)),
    "reverse": lambda: _straight(40.0, SLOW, reverse=True),
    "parking": lambda: reverse_parking(pause=PAUSE, vehicle=CAR),
    "crawl": lambda: TimedPath(straight(3.0), SpeedProfile((0.0, 3.0), (0.1, 0.1)), CAR),
}
"""By name."""


@lru_cache
def reference_of(name: str) -> TimedPath | Legs:
    """Where the car is to be."""
    return MANOEUVRES[name]()


@lru_cache
def problem_of() -> Any:
    """Of all of them."""
    return trajectory_problem(CAR)


@lru_cache
def car_of() -> DrivenCar:
    """The car."""
    return driven_car("four-wheel", CAR, SAMPLING_TIME)


def _away(name: str, seen: Driven) -> Array:
    """Distance from where the car is to be (K,) [m]."""
    wanted = reference_of(name).start(problem_of())(seen.time)
    x, y = seen.motion("p_x", "p_y") or (np.empty(0), np.empty(0))
    return np.hypot(x - wanted["p_x"], y - wanted["p_y"])


def _activity(name: str, seen: Driven) -> float | None:
    """Mean move of the busiest input from sample to sample, over its range [%]."""
    if name == "crawl":
        (found,) = kpis(seen, ("input_activity",)).values()
        return 100.0 * SAMPLING_TIME * max(found.values())
    (found,) = kpis(seen, ("input_activity_at_rest",)).values()
    return None if found is None else max(found.values())
