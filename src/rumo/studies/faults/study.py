"""Bad samples in a row: what a drive makes of sensors, actuators, solvers and roads that fail for a while."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rumo.checks import as_list, known_names, positive_number, whole_number
from rumo.controllers import InnovationGate
from rumo.controllers.settings import WIDE_GATE
from rumo.errors import ArgumentError
from rumo.interrupts import Interrupted
from rumo.registry import CONTROLLERS
from rumo.report.contents import Report
from rumo.simulation import Scenario
from rumo.studies.base import Key, Resumable, Run
from rumo.studies.faults.outcome import Drive, outcome
from rumo.studies.faults.report import sections
from rumo.studies.faults.summary import WHOLE, Results, by_fault
from rumo.studies.faults.troubles import FAULTS
from rumo.studies.paper import CLOSE_WEIGHTS, PaperStudy
from rumo.studies.sharing import shared_controller

if TYPE_CHECKING:
    import xarray as xr

BASE = PaperStudy(weights=CLOSE_WEIGHTS, estimator=None, initial_error=0.0)
"""The drive that is disturbed: the paper's path, wind and noise, but raw measurements and a start on the path."""


@dataclass(frozen=True)
class FaultStudy(Resumable):
    """Settings of the study: a drive for each controller, fault, speed, number of bad samples, and seed.

    Faults that are there for the whole drive have one number of bad samples, `WHOLE`.

    Parameters
    ----------
    controllers : tuple of str
        Names in `CONTROLLERS`.
    faults : tuple of str
        Names in `FAULTS`.
    speeds : tuple of float
        Along the path [m/s].
    samples : tuple of int
        Numbers of bad samples.
    seeds : tuple of int
        Of wind and noise, the same for every drive.
    duration : float
        Of a drive [s].
    start : float
        When the first bad sample is [s].
    gate : InnovationGate, optional
        Of every controller; None lets all finite measurements pass.
    keep_logs : bool
        Of every drive: half a megabyte each.
    base : PaperStudy
        The drive that is disturbed. Its controllers, seed, duration, speed and estimator are not used.

    Raises
    ------
    ArgumentError
        If a name is unknown, a number cannot be driven, or no good sample is left before and after the bad ones.
    """

    keeps_logs: ClassVar[bool] = True

    controllers: tuple[str, ...] = ("rti", "nlp")
    faults: tuple[str, ...] = tuple(FAULTS)
    speeds: tuple[float, ...] = (8.0,)
    samples: tuple[int, ...] = (5,)
    seeds: tuple[int, ...] = (0,)
    duration: float = 8.0
    start: float = 3.0
    gate: InnovationGate | None = WIDE_GATE
    keep_logs: bool = False
    base: PaperStudy = BASE

    def __post_init__(self) -> None:
        known_names(self.controllers, "controllers", CONTROLLERS)
        known_names(self.faults, "faults", FAULTS)
        for speed in as_list(self.speeds, "speeds", "at least one speed such as 8.0"):
            positive_number(speed, "speeds")
        for count in as_list(self.samples, "samples", "at least one number of samples such as 5"):
            whole_number(count, "samples", 1)
        for seed in as_list(self.seeds, "seeds", "at least one seed such as 0"):
            whole_number(seed, "seeds", 0, most=np.inf)
        sample = self.base.sampling_time
        if not sample <= self.start < np.inf:
            raise ArgumentError("start", f"{self.start:g} s", f"at least one sample of {sample:g} s")
        least = sample * (self.bad(max(self.samples)).stop + 1)
        if not least <= self.duration < np.inf:
            raise ArgumentError("duration", f"{self.duration:g} s", f"at least {least:g} s, to see a good sample again")

    def bad(self, count: int | str) -> range:
        """The bad samples, counted from 0: so many, or `WHOLE`."""
        if isinstance(count, str):
            return range(round(self.duration / self.base.sampling_time))
        first = round(self.start / self.base.sampling_time)
        return range(first, first + count)

    def runs(self) -> dict[Key, Run]:
        """A drive for each controller, fault, speed, number of bad samples and seed."""
        problem, plant = self.base.problem(), self.base.plant()

        def drive(name: str, fault: str, speed: float, count: int | str, seed: int) -> FaultRun:
            path = replace(self.base.path, speed=speed)
            base = replace(self.base, duration=self.duration, seed=seed, estimator=None, path=path)
            trouble, bad = FAULTS[fault], self.bad(count)
            scenario = base.scenario(name, problem, plant)
            scenario = replace(scenario, settings={"gate": self.gate}, faults=trouble.faults(bad, base))
            # What is there for the whole drive is judged as long as what begins later, to compare them.
            judged = range(self.bad(1).start, bad.stop)
            return FaultRun(scenario, trouble.title, judged, self.keep_logs)

        return {
            (name, fault, float(speed), count, seed): drive(name, fault, float(speed), count, seed)
            for name in self.controllers
            for fault in self.faults
            for speed in self.speeds
            for count in ((WHOLE,) if FAULTS[fault].whole else self.samples)
            for seed in self.seeds
        }

    @property
    def same(self) -> dict[str, Any]:
        """What all drives have in common, in words and numbers: of others an interrupted study cannot go on."""
        return {
            "study": "faults",
            "duration_s": self.duration,
            "start_s": self.start,
            "gate": None if self.gate is None else {"width": self.gate.width, "patience": self.gate.patience},
            "base": repr(replace(self.base, controllers=BASE.controllers, seed=0, duration=BASE.duration)),
        }

    def record(self, result: Drive) -> dict[str, Any]:
        """The outcome of a drive."""
        return result.outcome

    def restored(self, record: Mapping[str, Any]) -> Drive:
        """A drive without its log."""
        return Drive(None, record["exception"], dict(record))

    def summary(self, results: Results) -> dict[str, Any]:
        """What became of the drives, by controller and fault."""
        problem = self.base.problem()
        return {
            "study": "faults",
            "seeds": list(self.seeds),
            "speeds_m_s": list(self.speeds),
            "bad_samples": list(self.samples),
            "first_bad_sample": self.bad(1).start,
            "sampling_time_s": problem.sampling_time,
            "horizon": problem.horizon,
            "duration_s": self.duration,
            "gate": self.same["gate"],
            "controllers": {name: by_fault(faults) for name, faults in results.items()},
        }

    def report(self, results: Results) -> Report:
        """The summary, as a table for each controller, and a figure of all."""
        content = self.summary(results)
        base = replace(self.base, estimator=None)
        lead = (
            f"A car follows a sine path at {_listed(self.speeds)} m/s {base.conditions}; "
            f"after {base.sampling_time * self.bad(1).start:g} s come {_listed(self.samples)} bad samples. "
            f"Seeds {_listed(self.seeds)}, {'without' if self.gate is None else 'with'} the innovation gate."
        )
        return Report("Faults", lead, content, sections(content))


def _listed(numbers: tuple[float, ...]) -> str:
    *others, last = (f"{number:g}" for number in numbers)
    return f"{', '.join(others)} or {last}" if others else last


@dataclass(frozen=True)
class FaultRun:
    """A drive through a fault.

    Attributes
    ----------
    scenario : Scenario
        The drive.
    title : str
        What goes wrong, in words.
    bad : range
        The bad samples; of a whole drive those from when other drives have their first.
    keep_log : bool
        Whether the log is part of what comes of it.
    """

    scenario: Scenario
    title: str
    bad: range
    keep_log: bool = False

    def run(self, *, progress: Callable[[int, int], None] | None = None) -> Drive:
        """Drive; whatever the controller raises is a result."""
        exception = None
        try:
            log = self.scenario.run(shared_controller(self.scenario), progress)
        except Interrupted as interrupt:
            interrupt.log = self._named(interrupt.log)
            raise
        except Exception as error:
            log, exception = getattr(error, "log", None), f"{type(error).__name__}: {error}"
        log = None if log is None else self._named(log)
        return Drive(log if self.keep_log else None, exception, outcome(log, exception))

    def _named(self, log: xr.Dataset) -> xr.Dataset:
        return log.assign_attrs(fault=self.title, first_bad_sample=self.bad.start, bad_samples=len(self.bad))
