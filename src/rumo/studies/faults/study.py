"""Bad samples in a row: what a drive makes of sensors and solvers that fail for a moment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rumo.checks import known_names, whole_number
from rumo.controllers import InnovationGate
from rumo.controllers.settings import WIDE_GATE
from rumo.errors import ArgumentError
from rumo.interrupts import Interrupted
from rumo.registry import CONTROLLERS
from rumo.report.contents import Report
from rumo.simulation import Scenario
from rumo.studies.base import Key, Run, Study, shared_controller
from rumo.studies.faults.report import outcome, sections
from rumo.studies.faults.troubles import FAULTS, Drive, Trouble
from rumo.studies.paper import CLOSE_WEIGHTS, PaperStudy

if TYPE_CHECKING:
    import xarray as xr

BASE = PaperStudy(weights=CLOSE_WEIGHTS, estimator=None, initial_error=0.0)
"""The drive that is disturbed: the paper's path, wind and noise, but raw measurements and a start on the path."""


@dataclass(frozen=True)
class FaultStudy(Study):
    """Settings of the study.

    Parameters
    ----------
    controllers : tuple of str
        Names in `CONTROLLERS`.
    faults : tuple of str
        Names in `FAULTS`.
    seed : int
        Of wind and noise, the same for every drive.
    duration : float
        Of a drive [s].
    start : float
        When the first bad sample is [s].
    count : int
        Number of bad samples.
    gate : InnovationGate, optional
        Of every controller; None lets all finite measurements pass.
    base : PaperStudy
        The drive that is disturbed. Its controllers, seed, duration and estimator are not used.

    Raises
    ------
    ArgumentError
        If a name is unknown, or no good sample is left before and after the bad ones.
    """

    keeps_logs: ClassVar[bool] = True

    controllers: tuple[str, ...] = ("rti", "nlp")
    faults: tuple[str, ...] = tuple(FAULTS)
    seed: int = 0
    duration: float = 8.0
    start: float = 3.0
    count: int = 5
    gate: InnovationGate | None = WIDE_GATE
    base: PaperStudy = BASE

    def __post_init__(self) -> None:
        known_names(self.controllers, "controllers", CONTROLLERS)
        known_names(self.faults, "faults", FAULTS)
        whole_number(self.count, "count", 1)
        sample = self.base.sampling_time
        if not sample <= self.start < np.inf:
            raise ArgumentError("start", f"{self.start:g} s", f"at least one sample of {sample:g} s")
        least = sample * (self.bad.stop + 1)
        if not least <= self.duration < np.inf:
            raise ArgumentError("duration", f"{self.duration:g} s", f"at least {least:g} s, to see a good sample again")

    @property
    def bad(self) -> range:
        """The bad samples, counted from 0."""
        first = round(self.start / self.base.sampling_time)
        return range(first, first + self.count)

    def runs(self) -> dict[Key, Run]:
        """A drive for each controller and fault, by their names."""
        base, bad = replace(self.base, duration=self.duration, seed=self.seed, estimator=None), self.bad
        problem, plant = base.problem(), base.plant()

        def drive(name: str, trouble: Trouble) -> FaultRun:
            faults = () if trouble.fault is None else (replace(trouble.fault, when=bad),)
            scenario = replace(base.scenario(name, problem, plant), settings={"gate": self.gate}, faults=faults)
            return FaultRun(scenario, trouble.title, bad)

        return {(name, fault): drive(name, FAULTS[fault]) for name in self.controllers for fault in self.faults}

    def summary(self, results: Mapping[str, Mapping[str, Drive]]) -> dict[str, Any]:
        """What became of the drives, by controller and fault."""
        problem = self.base.problem()
        return {
            "study": "faults",
            "seed": self.seed,
            "sampling_time_s": problem.sampling_time,
            "horizon": problem.horizon,
            "duration_s": self.duration,
            "first_bad_sample": self.bad.start,
            "bad_samples": self.count,
            "gate": None if self.gate is None else {"width": self.gate.width, "patience": self.gate.patience},
            "controllers": {
                name: {fault: {"title": FAULTS[fault].title, **outcome(drive)} for fault, drive in by_fault.items()}
                for name, by_fault in results.items()
            },
        }

    def report(self, results: Mapping[str, Mapping[str, Drive]]) -> Report:
        """The summary, as a table for each controller, and the drives around the bad samples."""
        content = self.summary(results)
        base = replace(self.base, estimator=None)
        lead = (
            f"A car follows a sine path at {base.path.speed:g} m/s {base.conditions}; "
            f"after {base.sampling_time * self.bad.start:g} s come {self.count} bad samples. Seed {self.seed}, "
            f"{'without' if self.gate is None else 'with'} the innovation gate."
        )
        return Report("Faults", lead, content, sections(content, results))


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
        The bad samples.
    """

    scenario: Scenario
    title: str
    bad: range

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
        return Drive(None if log is None else self._named(log), exception)

    def _named(self, log: xr.Dataset) -> xr.Dataset:
        return log.assign_attrs(fault=self.title, first_bad_sample=self.bad.start, bad_samples=len(self.bad))
