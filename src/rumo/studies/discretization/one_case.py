"""One case: what each scheme and step makes of it, and at what cost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.controllers import RealTimeIteration
from rumo.controllers.rti import requested
from rumo.discretization import Radau2
from rumo.discretization.stability import eigenvalues, stable_step
from rumo.errors import ArgumentError
from rumo.registry import DISCRETIZATIONS
from rumo.signals import Array
from rumo.simulation import Plant, simulate
from rumo.simulation.replay import Recording, recorded
from rumo.studies.discretization.cases import CASES, Case
from rumo.studies.discretization.prediction import Accuracy, ReferenceSolution

if TYPE_CHECKING:
    import xarray as xr

ROUNDS, LAPS, SAMPLES = 5, 5, 200
"""Rounds of replays to measure with, laps of quick controllers in each round, and samples in each lap."""
MANY_SUBSTEPS, FEW_SAMPLES = 50, 4
"""With more substeps a step takes milliseconds, and one lap of this many samples is enough."""
UNSETTLED = 0.25
"""Share of the closed loop that is not judged, since it is the way from the initial state."""


@dataclass(frozen=True)
class Times:
    """Medians [us] of the linearisation of a horizon, of the preparation that it belongs to, and of feedback."""

    linearize: float
    prepare: float
    feedback: float


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
    accuracy : Accuracy
        Of the prediction from an exact state.
    rms : float
        Root mean square distance of the outputs from the reference in closed loop, once settled, in the case's unit.
    statuses : mapping of str to int
        Of the steps of the closed loop.
    times : Times
        Of a step of the closed loop.
    """

    scheme: str
    step: float
    intervals: int
    substeps: int
    accuracy: Accuracy
    rms: float
    statuses: Mapping[str, int]
    times: Times


@dataclass(frozen=True)
class CaseResult:
    """What became of a case.

    Attributes
    ----------
    case : Case
        What was asked for.
    backend : str
        That the controllers had: "tailored" or "portable".
    span : float
        Range of the outputs along the horizon, in the case's unit.
    floor : float
        Errors below it are those of the reference solution, in the case's unit.
    rate : float
        Of its fastest decaying mode, along the exact prediction and all plans of a closed loop with Radau2 [1/s].
    stable_steps : mapping of str to float
        Largest step [s] with which no mode grows, of each scheme that is not stable with any.
    errors_beyond : mapping of str to float
        Error of the outputs with a tenth fewer substeps in the longest intervals than the exact prediction needs, of
        each scheme that needs many.
    outcomes : tuple of Outcome
        By scheme, then by step.
    """

    case: Case
    backend: str
    span: float
    floor: float
    rate: float
    stable_steps: Mapping[str, float]
    errors_beyond: Mapping[str, float]
    outcomes: tuple[Outcome, ...]


def check_clock(backend: str) -> None:
    """Raise for a backend without a clock of its own, which "auto" can be by `RUMO_BACKEND`."""
    if requested(backend) == "reference":
        raise ArgumentError("backend", "'reference'", "tailored or portable", "Unset RUMO_BACKEND, or choose one.")


@dataclass(frozen=True)
class CaseRun:
    """A case of `CASES` with some schemes, all of which are timed in turns."""

    name: str
    schemes: tuple[str, ...]
    backend: str

    def run(self, *, progress: Callable[[int, int], None] | None = None) -> CaseResult:
        """Predict and drive with every scheme and step.

        Raises
        ------
        ArgumentError
            If "auto" is a backend without a clock of its own, by `RUMO_BACKEND`.
        """
        check_clock(self.backend)
        case = CASES[self.name]()
        solution = ReferenceSolution(case)
        rates: Any = np.concatenate([solution.rates.ravel(), _planned_rates(case)])
        steps = {scheme: stable_step(DISCRETIZATIONS[scheme](), rates.tolist()) for scheme in self.schemes}
        controllers: list[RealTimeIteration] = []
        recordings: list[Recording] = []
        logs: list[xr.Dataset] = []
        accuracies: list[Accuracy] = []
        tried = [(scheme, step) for scheme in self.schemes for step in case.steps]
        for scheme, step in tried:
            discretization = DISCRETIZATIONS[scheme](max(1, int(np.ceil(step / steps[scheme]))))
            problem = case.problem(step)
            controller = RealTimeIteration(problem, discretization, backend=self.backend)
            logs.append(_closed_loop(case, controller))
            controllers.append(controller)
            recordings.append(recorded(problem, logs[-1], case.reference))
            accuracies.append(solution.accuracy(discretization, step))
            if progress is not None:
                progress(len(logs), len(tried))
        outcomes = [
            Outcome(
                scheme,
                step,
                case.intervals(step),
                controller.transcription.discretization.substeps,
                accuracy,
                _rms(case, log),
                Counter(str(status) for status in log["status"].to_numpy()),
                times,
            )
            for (scheme, step), controller, accuracy, log, times in zip(
                tried, controllers, accuracies, logs, _times(controllers, recordings), strict=True
            )
        ]
        return CaseResult(
            case,
            controllers[0].backend,
            solution.span,
            solution.floor,
            float(-rates.real.min()),
            {scheme: step for scheme, step in steps.items() if np.isfinite(step)},
            self._errors_beyond(solution),
            tuple(outcomes),
        )

    def _errors_beyond(self, solution: ReferenceSolution) -> dict[str, float]:
        longest, errors = max(solution.case.steps), {}
        for name in self.schemes:
            needed = longest / stable_step(DISCRETIZATIONS[name](), solution.rates.ravel().tolist())
            if needed >= MANY_SUBSTEPS:
                errors[name] = solution.accuracy(DISCRETIZATIONS[name](int(0.9 * needed)), longest).outputs
        return errors


def _closed_loop(case: Case, controller: RealTimeIteration) -> xr.Dataset:
    plant = Plant(case.model, controller.problem.sampling_time, scales=case.scales)
    return simulate(controller, plant, case.start, case.reference, case.duration)


def _planned_rates(case: Case) -> np.ndarray:
    """Eigenvalues [1/s] at all states of all plans, driven with a scheme that is always stable and accurate."""
    found: list[np.ndarray] = []
    for step in case.steps:
        log = _closed_loop(case, RealTimeIteration(case.problem(step), Radau2(), backend="portable"))
        states, inputs = (log[f"predicted_{kind}"].to_numpy() for kind in ("states", "inputs"))
        inputs = np.concatenate([inputs, inputs[:, -1:]], axis=1)  # the last state is one more
        x, u = np.concatenate(states), np.concatenate(inputs)
        found.append(eigenvalues(case.model, x, u, case.model.default_parameters).ravel())
    return np.concatenate(found)


def _rms(case: Case, log: xr.Dataset) -> float:
    outputs = list(case.outputs)
    distance = log["plant"].sel(plant_state=outputs).to_numpy() - log["reference"].sel(output=outputs).to_numpy()
    settled = distance[round(UNSETTLED * len(distance)) :]
    return float(np.sqrt((settled**2).sum(axis=1).mean()))


def _times(controllers: Sequence[RealTimeIteration], recordings: Sequence[Recording]) -> list[Times]:
    """The controllers take turns, so that the machine's moods meet all of them."""
    medians: list[list[Array]] = [[] for _ in controllers]
    for _ in range(ROUNDS):
        for lap in range(LAPS):
            for controller, told, found in zip(controllers, recordings, medians, strict=True):
                slow = controller.transcription.discretization.substeps > MANY_SUBSTEPS
                if slow and lap > 0:
                    continue
                n = FEW_SAMPLES if slow else SAMPLES
                times = controller.replay(told.x[:n], told.reference[:n], told.applied[:n])
                found.append(1e6 * np.nanmedian(times, axis=0))
    return [Times(*np.median(found, axis=0).tolist()) for found in medians]
