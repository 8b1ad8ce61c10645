"""Where to linearise: about the last plan, along the reference, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.checks import as_list, as_mapping, known_names, whole_number
from rumo.controllers import Controller, DirectNlp, RealTimeIteration
from rumo.controllers.engines.base import Candidate
from rumo.controllers.engines.ipopt import Ipopt
from rumo.controllers.engines.trajectory import Trajectory
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, PlantError
from rumo.problem import Problem
from rumo.registry import CONTROLLERS
from rumo.report.contents import Report
from rumo.signals import Array
from rumo.simulation import Plant, Scenario
from rumo.studies.base import Key, Run, Study
from rumo.studies.linearization.drives import BASE, Drive
from rumo.studies.linearization.report import sections
from rumo.studies.linearization.summary import Logs, sweep_outcomes
from rumo.studies.linearization.sweeps import SWEEPS
from rumo.studies.sharing import shared_controller

if TYPE_CHECKING:
    import xarray as xr


class _StartedIpopt(Ipopt):
    """Started from one real-time iteration where there is no plan to start from.

    From a car at rest, which is its own guess, IPOPT often finds nothing when the reference is far away.
    """

    _iteration: Controller[Any] | None = None

    def solve(self, x: Array, window: Mapping[str, Array], guess: Trajectory, applied: Array) -> Candidate | None:
        """See `Method.solve`."""
        if guess.resting:
            if self._iteration is None:
                self._iteration = RealTimeIteration(self.transcription.problem, gate=None)
            self._iteration.reset(applied=applied)
            plan = self._iteration.step(x, window)
            if plan.status.applicable:
                states = plan.x.values
                guess = Trajectory(plan.u.values, states, self.transcription.inner_between(states[:-1], states[1:]))
        return super().solve(x, window, guess, applied)


class StartedNlp(DirectNlp):
    """The direct NLP, with such a start."""

    _method = _StartedIpopt


class PlainIteration(RealTimeIteration):
    """The plain real-time iteration: full steps, which are not judged."""

    name = "plain"

    def __init__(self, problem: Problem, discretization: Discretization | None = None, **changes: Any) -> None:
        settings: dict[str, Any] = {"trusted_step": np.inf} | changes
        super().__init__(problem, discretization, **settings)


KINDS: dict[str, type[Controller[Any]]] = {**CONTROLLERS, "nlp": StartedNlp, "plain": PlainIteration}
"""What the study drives with, by name."""


@dataclass(frozen=True)
class LinearizationStudy(Study):
    """Settings of the study. All drives of a sweep have one problem, and one controller of each kind.

    Parameters
    ----------
    controllers : tuple of str
        Names in `KINDS`.
    sweeps : mapping of str to sequence of float
        Values to drive with, by name in `SWEEPS`.
    seed : int
        Of noise, the same for every drive.
    duration : float
        Of a drive [s].
    base : Drive
        What is made harder by sweeps that have no drive of their own. Its controllers, seed and duration are not used.

    Raises
    ------
    ArgumentError
        If a name is unknown, or a value cannot be driven.
    """

    controllers: tuple[str, ...] = ("rti", "plain", "nlp", "ltv")
    sweeps: Mapping[str, Sequence[float]] = field(
        default_factory=lambda: {name: sweep.values for name, sweep in SWEEPS.items()}
    )
    seed: int = 0
    duration: float = 8.0
    base: Drive = BASE

    def __post_init__(self) -> None:
        sweeps = as_mapping(self.sweeps, "sweeps")
        known_names(self.controllers, "controllers", KINDS)
        known_names(sweeps, "sweeps", SWEEPS)
        for name, values in sweeps.items():
            argument = f"sweeps[{name!r}]"
            for value in as_list(values, argument, "at least one value"):
                if not np.isfinite(SWEEPS[name].check(value, argument)):
                    raise ArgumentError(argument, repr(value), "a finite number")
        whole_number(self.seed, "seed", 0, most=np.inf)
        sample = self.base.sampling_time
        if not 2.0 * sample <= self.duration < np.inf:
            raise ArgumentError("duration", f"{self.duration:g} s", f"at least two samples of {sample:g} s")

    def drive(self, sweep: str, value: float) -> Drive:
        """Settings of one drive."""
        return SWEEPS[sweep].drive(self._base(sweep), float(value))

    def _base(self, sweep: str) -> Drive:
        return SWEEPS[sweep].base or self.base

    def runs(self) -> dict[Key, Run]:
        """The drives, by sweep, value and controller."""
        of_drives: dict[int, tuple[Problem, Plant]] = {}
        for name in self.sweeps:
            base = self._base(name)
            of_drives.setdefault(id(base), (base.problem(), base.plant()))

        def drive(sweep: str, value: float, name: str) -> SweptRun:
            settings = replace(self.drive(sweep, value), duration=self.duration, seed=self.seed)
            kind = KINDS[name]
            # Without the innovation gate: all measurements are right, however wrong a linear prediction is.
            options = {"gate": None} | ({"max_iterations": 1000} if kind is StartedNlp else {})
            return SweptRun(
                replace(settings.scenario(kind, *of_drives[id(self._base(sweep))]), settings=options), sweep, value
            )

        return {
            (sweep, float(value), name): drive(sweep, float(value), name)
            for sweep, values in self.sweeps.items()
            for value in values
            for name in self.controllers
        }

    def summary(self, results: Logs) -> dict[str, Any]:
        """What became of the drives; a value is left out where a controller has not driven it."""
        problems = {name: self._base(name).problem() for name in results}
        return {
            "study": "linearization",
            "seed": self.seed,
            "sampling_time_s": self.base.sampling_time,
            "horizon": self.base.horizon,
            "duration_s": self.duration,
            "sweeps": sweep_outcomes(self.controllers, problems, self.duration, results),
        }

    def report(self, results: Logs) -> Report:
        """Who is lost where, and what the others cost."""
        content = self.summary(results)
        lead = f"A car on roads that get harder to drive; {self.duration:g} s a drive, seed {self.seed}."
        return Report("Where to linearise", lead, content, sections(content, results))


@dataclass(frozen=True)
class SweptRun:
    """One drive of a sweep."""

    scenario: Scenario
    sweep: str
    value: float

    def run(self, *, progress: Callable[[int, int], None] | None = None) -> xr.Dataset:
        """Drive; the log of a drive that the plant's integrator could not finish ends there."""
        try:
            log = self.scenario.run(shared_controller(self.scenario), progress)
        except PlantError as error:
            log = error.log
        return log.assign_attrs(sweep=self.sweep, value=self.value)
