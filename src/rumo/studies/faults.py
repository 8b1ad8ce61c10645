"""Bad samples in a row: what a drive makes of sensors and solvers that fail for a moment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from rumo.checks import known_names, whole_number
from rumo.controllers import (
    Controller,
    DirectNlp,
    InnovationGate,
    LinearTimeVarying,
    NlpOptions,
    QpOptions,
    RealTimeIteration,
)
from rumo.controllers.gate import WIDE_GATE
from rumo.errors import ArgumentError, PlantError
from rumo.estimation import Estimate, RunningEstimator
from rumo.problem import Problem
from rumo.registry import CONTROLLERS
from rumo.signals import Array, Signals
from rumo.simulation import Plant
from rumo.studies.paper import CLOSE_WEIGHTS, SAMPLING_TIME, PaperStudy

if TYPE_CHECKING:
    import xarray as xr

BASE = PaperStudy(weights=CLOSE_WEIGHTS, estimator=None, initial_error=0.0)
"""The drive that is disturbed: the paper's path, wind and noise, but raw measurements and a start on the path."""

ABSURD_STEERING = 100.0
"""A steering rate [rad/s] that no later input can make up for within the hard bounds of the steering angle."""


Spoil = Callable[[Array, Array, Signals], Array]
"""(measurement, last good measurement, states) -> what the controller gets."""

Meddle = Callable[[Controller], None]
"""Something done to a controller between two steps."""


@dataclass(frozen=True)
class Fault:
    """What goes wrong during the bad samples.

    Attributes
    ----------
    title : str
        In words.
    spoil : callable
        Replaces the measurement of each bad sample.
    before, after : callable, optional
        Done to the controller before each bad sample, and after the last.
    """

    title: str
    spoil: Spoil = lambda measured, last, states: measured
    before: Meddle | None = None
    after: Meddle | None = None


def _set(measured: Array, last: Array, states: Signals, name: str, value: float) -> Array:
    spoiled = measured.copy()
    spoiled[states.index(name)] = value
    return spoiled


def _shift(measured: Array, last: Array, states: Signals, name: str, by: float) -> Array:
    return _set(measured, last, states, name, measured[states.index(name)] + by)


def _leave_no_solution(controller: Controller) -> None:
    """Tell the controller that an absurd input is being applied, after which its hard bounds cannot be kept."""
    controller.applied = {"torque": 0.0, "steering_rate": ABSURD_STEERING}


def _set_budget(controller: Controller, iterations: int | None) -> None:
    """Limit the solver's iterations; None is the usual limit."""
    if isinstance(controller, DirectNlp):
        controller.options = NlpOptions() if iterations is None else NlpOptions(max_iterations=iterations)
    elif isinstance(controller, RealTimeIteration | LinearTimeVarying):
        controller.qp = QpOptions() if iterations is None else QpOptions(max_iterations=iterations)


FAULTS: dict[str, Fault] = {
    "none": Fault("No fault"),
    "nan": Fault("NaN in a state", partial(_set, name="psi", value=np.nan)),
    "infinite": Fault("Infinite speed", partial(_set, name="v_x", value=np.inf)),
    "jump": Fault("Position off by 100 m", partial(_shift, name="p_y", by=100.0)),
    "spin": Fault("Yaw rate 50 rad/s", partial(_set, name="omega", value=50.0)),
    "frozen": Fault("Frozen measurements", lambda measured, last, states: last),
    "missing": Fault("No measurement", lambda measured, last, states: np.full_like(measured, np.nan)),
    "failure": Fault("Solver fails", before=_leave_no_solution),
    "budget": Fault(
        "Budget of 0 iterations",
        before=partial(_set_budget, iterations=0),
        after=partial(_set_budget, iterations=None),
    ),
}
"""What can go wrong, by name; the first is the undisturbed drive."""


@dataclass(frozen=True)
class _Spoiled:
    """An estimator that passes measurements on as they are, but for those of the bad samples."""

    spoil: Spoil
    bad: range

    def start(self, problem: Problem, measured: Sequence[str] | None = None) -> RunningEstimator:
        return _Spoiling(self.spoil, self.bad, problem.model.states)


class _Spoiling:
    """At work."""

    def __init__(self, spoil: Spoil, bad: range, states: Signals) -> None:
        self._spoil, self._bad, self._states = spoil, bad, states
        self._sample, self._last = -1, np.full(len(states), np.nan)

    def update(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        self._sample += 1
        if self._sample in self._bad:
            return Estimate(self._spoil(measured, self._last, self._states))
        self._last = measured
        return Estimate(measured)


@dataclass(frozen=True)
class Drive:
    """A drive through a fault.

    Attributes
    ----------
    log : Dataset or None
        None if the controller raised. Its attributes `first_bad_sample` and `bad_samples` say when the fault was.
    exception : str or None
        What was raised, if anything was.
    """

    log: xr.Dataset | None
    exception: str | None = None


Progress = Callable[[str, int, int], None]
"""Called with (controller, drives done, all drives)."""


@dataclass(frozen=True)
class FaultStudy:
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
        if not SAMPLING_TIME <= self.start < np.inf:
            raise ArgumentError("start", f"{self.start:g} s", f"at least one sample of {SAMPLING_TIME:g} s")
        least = SAMPLING_TIME * (self.bad.stop + 1)
        if not least <= self.duration < np.inf:
            raise ArgumentError("duration", f"{self.duration:g} s", f"at least {least:g} s, to see a good sample again")

    @property
    def bad(self) -> range:
        """The bad samples, counted from 0."""
        first = round(self.start / SAMPLING_TIME)
        return range(first, first + self.count)

    def run(self, progress: Progress | None = None) -> dict[str, dict[str, Drive]]:
        """Drive through each fault with each controller; the drives by controller and fault."""
        problem = self.base.problem()
        plant = self.base.plant()
        drives: dict[str, dict[str, Drive]] = {}
        for name in self.controllers:
            controller = CONTROLLERS[name](problem, gate=self.gate)
            drives[name] = {}
            for fault in self.faults:
                drives[name][fault] = self._drive(controller, plant, FAULTS[fault])
                if progress is not None:
                    progress(name, len(drives[name]), len(self.faults))
        return drives

    def _drive(self, controller: Controller, plant: Plant, fault: Fault) -> Drive:
        base, bad = replace(self.base, duration=self.duration, seed=self.seed), self.bad

        def between_steps(done: int, steps: int) -> None:
            if done in bad and fault.before is not None:
                fault.before(controller)
            if done == bad.stop and fault.after is not None:
                fault.after(controller)

        exception = None
        try:
            log = base.drive(controller, plant, between_steps, _Spoiled(fault.spoil, bad))
        except PlantError as error:
            log, exception = error.log, f"PlantError: {error}"
        except Exception as error:  # whatever a controller raises is a result here
            log, exception = None, f"{type(error).__name__}: {error}"
        if log is not None:
            log = log.assign_attrs(fault=fault.title, first_bad_sample=bad.start, bad_samples=len(bad))
        return Drive(log, exception)
