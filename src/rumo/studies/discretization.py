"""Which discretisation scheme predicts how well, at what cost, on systems that are stiff."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.controllers import RealTimeIteration
from rumo.controllers.compiled import CompiledRti
from rumo.discretization import Radau2
from rumo.discretization.stability import modes, stable_substeps
from rumo.errors import ArgumentError, UnknownNameError
from rumo.registry import DISCRETIZATIONS
from rumo.signals import Array
from rumo.simulation import Plant, simulate
from rumo.simulation.replay import Recording, recorded
from rumo.studies.cases import CASES, Case
from rumo.studies.prediction import PredictionError, Truth

if TYPE_CHECKING:
    import xarray as xr

ROUNDS, SAMPLES = 5, 200
"""Replays of a drive to measure with, in turns, and samples in each."""
MANY_SUBSTEPS, FEW_SAMPLES = 50, 10
"""With more substeps a step takes milliseconds, and this many samples, once, are enough."""
BACKENDS = ("auto", "tailored", "portable")

Progress = Callable[[str, int, int], None]
"""Called with (case, schemes and step sizes done, all of them)."""


@dataclass(frozen=True)
class Outcome:
    """What became of one scheme with one interval length.

    Attributes
    ----------
    scheme : str
        Name in `DISCRETIZATIONS`.
    step : float
        Length of an interval [s].
    intervals, substeps : int
        Of the horizon, and of each interval: as few as are stable.
    error : PredictionError
        Of the prediction from an exact state.
    rms : float
        Root mean square distance of the outputs from the reference in closed loop, in the case's unit.
    statuses : mapping of str to int
        Of the steps of the closed loop.
    times_us : tuple of float
        Medians [us] of the linearisation of the horizon, of the preparation that it belongs to, and of feedback.
    """

    scheme: str
    step: float
    intervals: int
    substeps: int
    error: PredictionError
    rms: float
    statuses: Mapping[str, int]
    times_us: tuple[float, ...] = ()


@dataclass(frozen=True)
class CaseResult:
    """What became of a case.

    Attributes
    ----------
    case : Case
        What was asked for.
    span : float
        Range of the outputs along the horizon, in the case's unit.
    rate : float
        Of its fastest decaying mode, along the exact prediction and all plans of the closed loop [1/s].
    stable_steps : mapping of str to float
        Largest step [s] with which no mode grows, of each scheme that is not stable with any.
    errors_beyond : mapping of str to float
        Error of the outputs with a tenth fewer substeps in the longest intervals than the exact prediction needs.
    outcomes : tuple of Outcome
        By scheme, then by step.
    """

    case: Case
    span: float
    rate: float
    stable_steps: Mapping[str, float]
    errors_beyond: Mapping[str, float]
    outcomes: tuple[Outcome, ...]


@dataclass(frozen=True)
class DiscretizationStudy:
    """Settings of the study.

    Parameters
    ----------
    cases : tuple of str
        Names in `CASES`.
    schemes : tuple of str
        Names in `DISCRETIZATIONS`.
    backend : str
        Of the controllers: "auto", "tailored" or "portable", which is slower but needs no compiler.

    Raises
    ------
    ArgumentError
        If a name is unknown, or none is given.
    """

    cases: tuple[str, ...] = tuple(CASES)
    schemes: tuple[str, ...] = tuple(DISCRETIZATIONS)
    backend: str = "auto"

    def __post_init__(self) -> None:
        for argument, names, known in (
            ("cases", self.cases, CASES),
            ("schemes", self.schemes, DISCRETIZATIONS),
            ("backend", (self.backend,), BACKENDS),
        ):
            if not names:
                raise ArgumentError(argument, "none", f"some of {', '.join(known)}")
            for name in names:
                if name not in known:
                    raise UnknownNameError(argument, name, list(known))

    def run(self, progress: Progress | None = None) -> dict[str, CaseResult]:
        """Predict and drive with every scheme and step size; the results by case."""
        return {name: self._run(name, progress) for name in self.cases}

    def _run(self, name: str, progress: Progress | None) -> CaseResult:
        case = CASES[name]()
        truth = Truth(case)
        rates: Any = np.concatenate([truth.rates.ravel(), _planned_rates(case)])
        least = {
            scheme: stable_substeps(DISCRETIZATIONS[scheme](), (rates * case.length).tolist())
            for scheme in self.schemes
        }
        outcomes: list[Outcome] = []
        replays: list[tuple[CompiledRti, Recording]] = []
        for scheme in self.schemes:
            for step in case.steps:
                substeps = int(np.ceil(least[scheme] / case.intervals(step)))
                outcome, replay = self._drive(case, truth, scheme, step, substeps)
                outcomes.append(outcome)
                replays.append(replay)
                if progress is not None:
                    progress(name, len(outcomes), len(self.schemes) * len(case.steps))
        limited = [scheme for scheme in self.schemes if not DISCRETIZATIONS[scheme].a_stable]
        longest = max(case.steps)
        predicted = (truth.rates.ravel() * longest).tolist()
        too_few = {scheme: int(0.9 * stable_substeps(DISCRETIZATIONS[scheme](), predicted)) for scheme in limited}
        return CaseResult(
            case,
            truth.span,
            float(-rates.real.min()),
            {scheme: case.length / least[scheme] for scheme in limited},
            {
                scheme: truth.error(DISCRETIZATIONS[scheme](n), longest).outputs
                for scheme, n in too_few.items()
                if n > 0
            },
            tuple(replace(outcome, times_us=us) for outcome, us in zip(outcomes, _times(replays), strict=True)),
        )

    def _drive(
        self, case: Case, truth: Truth, name: str, step: float, substeps: int
    ) -> tuple[Outcome, tuple[CompiledRti, Recording]]:
        """Predict, drive, and what to measure times with."""
        scheme, problem = DISCRETIZATIONS[name](substeps), case.problem(step)
        controller = RealTimeIteration(problem, scheme, backend=self.backend)
        assert isinstance(controller, CompiledRti)
        log = simulate(controller, _plant(case, step), case.start, case.reference, case.duration)
        statuses = dict(Counter(str(status) for status in log["status"].to_numpy()))
        error = truth.error(scheme, step)
        outcome = Outcome(name, step, problem.horizon, substeps, error, _rms(case, log), statuses)
        return outcome, (controller, recorded(problem, log, case.reference))


def _plant(case: Case, step: float) -> Plant:
    return Plant(case.model, step, scales=case.scales)


def _planned_rates(case: Case) -> np.ndarray:
    """Of all modes at all states of all plans [1/s], driven with a scheme that is always stable."""
    found: list[np.ndarray] = []
    for step in case.steps:
        controller = RealTimeIteration(case.problem(step), Radau2(), backend="portable")
        log = simulate(controller, _plant(case, step), case.start, case.reference, case.duration)
        states, inputs = (log[f"predicted_{kind}"].to_numpy() for kind in ("states", "inputs"))
        x, u = np.concatenate(states[:, 1:]), np.concatenate(inputs)
        found.append(modes(case.model, x, u, case.model.default_parameters).ravel())
    return np.concatenate(found)


def _rms(case: Case, log: xr.Dataset) -> float:
    outputs = list(case.outputs)
    distance = log["plant"].sel(plant_state=outputs).to_numpy() - log["reference"].sel(output=outputs).to_numpy()
    return float(np.sqrt((distance**2).sum(axis=1).mean()))


def _times(replays: Sequence[tuple[CompiledRti, Recording]]) -> list[tuple[float, ...]]:
    """Medians of each controller's times [us]; those that take long are asked once."""
    medians: list[list[Array]] = [[] for _ in replays]
    for turn in range(ROUNDS):
        for (controller, told), found in zip(replays, medians, strict=True):
            slow = controller.transcription.discretization.substeps > MANY_SUBSTEPS
            if turn == 0 or not slow:
                n = FEW_SAMPLES if slow else SAMPLES
                times = controller.replay(told.x[:n], told.reference[:n], told.applied[:n])
                found.append(1e6 * np.median(times, axis=0))
    return [tuple(np.median(found, axis=0).tolist()) for found in medians]
