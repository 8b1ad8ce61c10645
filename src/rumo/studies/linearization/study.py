"""Where to linearise: about the last plan, along the reference, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.checks import as_list, as_mapping, known_names, non_negative_number, positive_number, whole_number
from rumo.controllers import Controller, DirectNlp, RealTimeIteration
from rumo.controllers.engines.base import Candidate
from rumo.controllers.engines.ipopt import Ipopt
from rumo.controllers.engines.trajectory import Trajectory
from rumo.errors import ArgumentError, PlantError
from rumo.estimation import Estimator
from rumo.problem import Problem
from rumo.registry import CONTROLLERS
from rumo.report.contents import Report
from rumo.signals import Array
from rumo.simulation import Constant, Scenario
from rumo.studies.base import Key, Run, Study, shared_controller
from rumo.studies.paper import CLOSE_WEIGHTS, FILTER, NOISE, PaperStudy

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Drive(PaperStudy):
    """The case study with a car that may point away from its path at first.

    Parameters
    ----------
    heading_error : float
        Angle from the path's tangent to the car at the start [rad].
    """

    heading_error: float = 0.0

    def initial_state(self) -> dict[str, float]:
        """Plant state at the start, driving straight ahead without slip."""
        state = super().initial_state()
        return state | {"psi": state["psi"] + self.heading_error}


BASE = Drive(weights=CLOSE_WEIGHTS, estimator=None, noise={}, wind=Constant(0.0), initial_error=0.0)
"""The drive that is made harder: the paper's path and car, but exact measurements, no wind, a start on the path."""


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
            if plan.status.solved:
                states = plan.x.values
                guess = Trajectory(plan.u.values, states, self.transcription.inner_between(states[:-1], states[1:]))
        return super().solve(x, window, guess, applied)


class StartedNlp(DirectNlp):
    """The direct NLP, with such a start."""

    _method = _StartedIpopt


@dataclass(frozen=True)
class Sweep:
    """One thing that grows from drive to drive.

    Attributes
    ----------
    title, unit : str
        What grows, and its unit.
    values : tuple of float
        By default.
    drive : callable
        (base, value) -> the drive.
    check : callable
        (value, argument) -> value; raises for a value that cannot be driven.
    """

    title: str
    unit: str
    values: tuple[float, ...]
    drive: Callable[[Drive, float], Drive]
    check: Callable[[object, str], float] = non_negative_number


def _with_initial_error(base: Drive, error: float) -> Drive:
    return replace(base, initial_error=error)


def _with_heading(base: Drive, error: float) -> Drive:
    return replace(base, heading_error=error)


def _with_speed(base: Drive, speed: float) -> Drive:
    return replace(base, path=replace(base.path, speed=speed))


def _with_curvature(base: Drive, curvature: float) -> Drive:
    # A sine path bends most at its crests, by a (2 pi / w)^2.
    wavelength = 2.0 * np.pi * np.sqrt(base.path.amplitude / curvature)
    return replace(base, path=replace(base.path, wavelength=wavelength))


def _with_noise(base: Drive, scale: float, estimator: Estimator | None) -> Drive:
    noise = {name: scale * deviation for name, deviation in NOISE.items()}
    return replace(base, noise=noise, estimator=estimator, path=replace(base.path, speed=12.0))


SWEEPS: dict[str, Sweep] = {
    "initial_error": Sweep(
        "Initial distance from the path",
        "m",
        (0.0, 1.0, 2.0, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0),
        _with_initial_error,
    ),
    "heading": Sweep(
        "Initial heading error",
        "rad",
        (0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.4),
        _with_heading,
    ),
    "curvature": Sweep(
        "Peak curvature of the path",
        "1/m",
        (0.03, 0.06, 0.09, 0.12, 0.15, 0.18, 0.21, 0.24, 0.27),
        _with_curvature,
        positive_number,
    ),
    "speed": Sweep(
        "Speed",
        "m/s",
        (4.0, 8.0, 12.0, 14.0, 16.0, 17.0, 18.0, 19.0, 20.0, 22.0),
        _with_speed,
        positive_number,
    ),
    "noise": Sweep(
        "Filtered noise over the paper's",
        "1",
        (0.0, 0.5, 1.0, 1.5, 2.0, 3.0),
        partial(_with_noise, estimator=FILTER),
    ),
    "raw_noise": Sweep(
        "Raw noise over the paper's",
        "1",
        (0.0, 0.5, 1.0, 1.5, 2.0, 3.0),
        partial(_with_noise, estimator=None),
    ),
}
"""What can grow, by name. Noise is driven at 12 m/s, all else but speed at the speed of the base, 8 m/s."""


@dataclass(frozen=True)
class LinearizationStudy(Study):
    """Settings of the study. One problem, and one controller of each kind, for all drives.

    Parameters
    ----------
    controllers : tuple of str
        Names in `CONTROLLERS`.
    sweeps : mapping of str to sequence of float
        Values to drive with, by name in `SWEEPS`.
    seed : int
        Of noise, the same for every drive.
    duration : float
        Of a drive [s].
    base : Drive
        The drive that is made harder. Its controllers, seed and duration are not used.

    Raises
    ------
    ArgumentError
        If a name is unknown, or a value cannot be driven.
    """

    controllers: tuple[str, ...] = ("rti", "nlp", "ltv")
    sweeps: Mapping[str, Sequence[float]] = field(
        default_factory=lambda: {name: sweep.values for name, sweep in SWEEPS.items()}
    )
    seed: int = 0
    duration: float = 8.0
    base: Drive = BASE

    def __post_init__(self) -> None:
        sweeps = as_mapping(self.sweeps, "sweeps")
        known_names(self.controllers, "controllers", CONTROLLERS)
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
        return SWEEPS[sweep].drive(self.base, float(value))

    def runs(self) -> dict[Key, Run]:
        """The drives, by sweep, value and controller."""
        problem, plant = self.base.problem(), self.base.plant()

        def drive(sweep: str, value: float, name: str) -> SweptRun:
            settings = replace(self.drive(sweep, value), duration=self.duration, seed=self.seed)
            kind = StartedNlp if name == DirectNlp.name else CONTROLLERS[name]
            return SweptRun(settings.scenario(kind, problem, plant), sweep, value)

        return {
            (sweep, float(value), name): drive(sweep, float(value), name)
            for sweep, values in self.sweeps.items()
            for value in values
            for name in self.controllers
        }

    def report(self, results: Mapping[str, Mapping[float, Mapping[str, xr.Dataset]]]) -> Report:
        """Who is lost where, and what the others cost; `results` are logs by sweep, value and controller."""
        from rumo.studies.linearization.report import report

        return report(self, results)


@dataclass(frozen=True)
class SweptRun:
    """One drive of a sweep."""

    scenario: Scenario
    sweep: str
    value: float

    def run(self, *, progress: Callable[[int, int], None] | None = None) -> xr.Dataset:
        """Drive; the log of a drive that the plant's integrator could not finish ends there."""
        controller = shared_controller(_controller, self.scenario.controller, self.scenario.problem)
        try:
            log = self.scenario.run(controller, progress)
        except PlantError as error:
            log = error.log
        return log.assign_attrs(sweep=self.sweep, value=self.value)


def _controller(kind: Callable[..., Controller[Any]], problem: Problem) -> Controller[Any]:
    """Without the innovation gate: all measurements are right, however wrong a linear prediction is."""
    options = {"max_iterations": 1000} if kind is StartedNlp else {}
    return kind(problem, gate=None, **options)
