"""Estimators in closed loop: the same car, road and noise for each, question by question."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from rumo.checks import as_list, checked, known_names, positive_number, whole_number
from rumo.errors import ArgumentError
from rumo.estimation import Estimator
from rumo.report.contents import Report
from rumo.simulation.observation import Observation
from rumo.studies.base import Key, Resumable, Run
from rumo.studies.drive import Drive, DriveRun, noise_of
from rumo.studies.drive.run import to_its_end
from rumo.studies.drive.start import first_motion
from rumo.studies.drive.study import SAMPLING_TIME
from rumo.studies.estimation.contenders import CONTENDERS
from rumo.studies.estimation.outcome import SETTLED, outcome, update_time
from rumo.studies.estimation.questions import QUESTIONS, Question
from rumo.studies.estimation.report import sections
from rumo.studies.estimation.summary import Results, by_question
from rumo.studies.kpis import Driven
from rumo.vehicles import VehicleParameters, car_filter

ROAD = Drive(grip=0.8, mu=1.0)
"""The drive that is made harder: the passenger car as a four-wheel plant on the club track, in wind."""


@dataclass(frozen=True)
class EstimationStudy(Resumable):
    """Settings of the study: a drive for each question, estimator and seed.

    Parameters
    ----------
    questions : tuple of str
        Names in `QUESTIONS`.
    estimators : tuple of str
        Names in `CONTENDERS`.
    seeds : tuple of int
        Of wind, noise and gross errors, the same for every estimator.
    duration : float
        Of a drive [s].
    window : int
        Samples that a moving horizon looks back on.
    base : Drive
        Track, vehicle, plant, controller and grip; its estimator, laps, distance and seed are not used.

    Raises
    ------
    ArgumentError
        If a name is unknown, a number cannot be driven, or a window is shorter than a measurement is late.
    """

    questions: tuple[str, ...] = tuple(QUESTIONS)
    estimators: tuple[str, ...] = tuple(CONTENDERS)
    seeds: tuple[int, ...] = (0, 1, 2, 3, 4)
    duration: float = 30.0
    window: int = 10
    base: Drive = ROAD

    def __post_init__(self) -> None:
        known_names(self.questions, "questions", QUESTIONS)
        known_names(self.estimators, "estimators", CONTENDERS)
        for seed in as_list(self.seeds, "seeds", "at least one seed such as 0"):
            whole_number(seed, "seeds", 0, most=np.inf)
        if positive_number(self.duration, "duration") < 2.0 * SETTLED:
            raise ArgumentError("duration", f"{self.duration:g} s", f"at least {2.0 * SETTLED:g} s")
        checked(self.base, "base", Drive)
        latest = max(max(QUESTIONS[name].late.values(), default=0.0) for name in self.questions)
        whole_number(self.window, "window", 1 + int(latest))

    def runs(self) -> dict[Key, Run]:
        """A drive for each question, estimator and seed."""
        return {
            (question, name, seed): self._run(QUESTIONS[question], name, seed)
            for question in self.questions
            for name in self.estimators
            for seed in self.seeds
        }

    def _run(self, question: Question, name: str, seed: int) -> EstimationRun:
        base = self.base
        car, road = base.car, base.road
        noise = noise_of(car)
        setting = replace(base.setting, duration=self.duration, noise=noise, seed=seed, estimator=None)
        plain = setting.scenario()
        start = base.driven_car.start(first_motion(road.path, base.profile, car, base.driven_car.drive, mu=base.mu)[0])
        kalman = question.kalman(car_filter(car, noise, sampling_time=SAMPLING_TIME), start)
        estimator = CONTENDERS[name].estimator(kalman, self.window, question.bounds)
        scenario = replace(question.scenario(plain), estimator=estimator)
        drive = DriveRun(scenario, road.track, road.path, base.profile, 0.0, self.base.length)
        truth = dict.fromkeys(question.extra, base.car.mu if base.mu is None else base.mu)
        after = 0.0 if question.off else SETTLED
        return EstimationRun(drive, estimator, car, after, question.bounds, truth)

    @property
    def same(self) -> dict[str, Any]:
        """What all drives have in common: of others an interrupted study cannot go on."""
        return {"study": "estimation", "duration_s": self.duration, "window": self.window, "base": repr(self.base)}

    def record(self, result: Judged) -> dict[str, Any]:
        """The outcome of a drive."""
        return result.outcome

    def restored(self, record: Mapping[str, Any]) -> Judged:
        """A drive as far as it was kept."""
        return Judged(dict(record))

    def summary(self, results: Results) -> dict[str, Any]:
        """How the estimators answered, by question and estimator: medians over the seeds."""
        return {
            "study": "estimation",
            "track": self.base.road.name,
            "vehicle": self.base.car_name,
            "plant": self.base.plant,
            "controller": self.base.controller,
            "grip": self.base.grip,
            "seeds": list(self.seeds),
            "duration_s": self.duration,
            "sampling_time_s": SAMPLING_TIME,
            "window": self.window,
            "noise": noise_of(self.base.car),
            "questions": by_question(results),
        }

    def report(self, results: Results) -> Report:
        """The summary, in sentences, a table and a figure for each question."""
        content = self.summary(results)
        lead = (
            f"{self.base.car_name} as {self.base.plant} on {self.base.road.name} at a grip of {self.base.grip:g}, "
            f"driven by {self.base.controller} in wind for {self.duration:g} s, with noisy sensors; seeds "
            f"{', '.join(map(str, self.seeds))}, and medians of them. Windows are {self.window} samples long. Every "
            "estimator has the same noise settings, and gets the same wind and noise."
        )
        return Report("Estimators", lead, content, sections(content, results))


@dataclass(frozen=True)
class Judged:
    """A drive with an estimator.

    Attributes
    ----------
    outcome : dict
        See `rumo.studies.estimation.outcome.outcome`; with `update_time_us`.
    """

    outcome: dict[str, Any] = field(default_factory=dict[str, Any])


@dataclass(frozen=True, eq=False)
class EstimationRun:
    """A drive, after which its estimator is judged.

    Attributes
    ----------
    drive : DriveRun
        The drive.
    estimator : Estimator
        That is judged.
    car : VehicleParameters
        That is driven.
    after : float
        From when on errors count [s].
    bounds : mapping of str to (float, float)
        What physics says of unknowns.
    truth : mapping of str to float
        What these unknowns are.
    """

    drive: DriveRun
    estimator: Estimator
    car: VehicleParameters
    after: float
    bounds: Mapping[str, tuple[float, float]]
    truth: Mapping[str, float]

    def run(self, *, progress: Callable[[int, int], None] | None = None) -> Judged:
        """Drive, and judge."""
        run, scenario = self.drive, self.drive.scenario
        log = to_its_end(lambda: run.run(progress=progress))
        driven = Driven(log, run.track, run.path, run.profile, self.car)
        found = outcome(driven, after=self.after, bounds=self.bounds, truth=self.truth)
        seen = Observation(scenario.problem, scenario.observed).problem
        return Judged({**found, "update_time_us": update_time(self.estimator, seen, log)})
