"""Extended Kalman filter on the controller's own discretised model: smooths without the lag of a low-pass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from rumo.checks import (
    as_mapping,
    checked,
    checked_items,
    finite_number,
    non_negative_number,
    positive_number,
    whole_number,
)
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, UnknownNameError
from rumo.estimation.base import measured_signals
from rumo.estimation.ekf.augmented import AugmentedModel, shared_model
from rumo.estimation.ekf.core import CoreFilter, can_compute
from rumo.estimation.ekf.engine import FilterNumbers
from rumo.estimation.ekf.numpy import NumpyFilter
from rumo.estimation.ekf.running import FilterParts, FirstBelief, RunningExtendedKalman
from rumo.estimation.lateness import lateness
from rumo.problem import Problem
from rumo.signals import Array, Signals

BACKENDS = ("auto", "portable", "reference")


@dataclass(frozen=True)
class ExtraState:
    """An unknown number that drifts: a random walk, estimated along with the states.

    Parameters
    ----------
    drift : float
        Standard deviation of its change within a second, which grows with the root of time; in the unit of what it is.
    deviation : float
        Standard deviation of the first estimate.
    start : float, optional
        First estimate. If not given, the value of a parameter that the filter is told first, and no bias.
    """

    drift: float
    deviation: float
    start: float | None = None

    def __post_init__(self) -> None:
        non_negative_number(self.drift, "ExtraState.drift")
        positive_number(self.deviation, "ExtraState.deviation")
        if self.start is not None:
            finite_number(self.start, "ExtraState.start")


@dataclass(frozen=True)
class OutlierGate:
    """Leaves out single measurements that are implausible, each judged by itself.

    Parameters
    ----------
    width : float
        A measurement is refused if its innovation is farther out than so many standard deviations: the square of it is
        chi-square distributed with one degree of freedom, so that 4 refuses one good measurement of 16000.
    patience : int
        So many refusals of a measurement in a row are believed. The next that is refused shows that the filter is
        wrong: it is used, and the covariance grows until it is no outlier.
    """

    width: float = 4.0
    patience: int = 10

    def __post_init__(self) -> None:
        positive_number(self.width, "OutlierGate.width")
        whole_number(self.patience, "OutlierGate.patience", 0)


@dataclass(frozen=True)
class ExtendedKalman:
    """Extended Kalman filter (Simon, 2006, ch. 13) for measurements of any states, algebraic variables and outputs.

    Parameters
    ----------
    noise : mapping of str to float
        Standard deviation of each measurement, positive.
    process : mapping of str to float
        Standard deviation of what the model misses in one sample, for each state, positive.
    x : mapping of str to float
        First estimates of the states that are not measured, or late, and of any others. The rest start at what is
        measured of them last when each has been measured once; no state is estimated before.
    deviations : mapping of str to float
        Standard deviation of each of these estimates, positive.
    late : mapping of str to float
        Samples, and fractions of one, from a measurement to its arrival. The filter goes back to the time of the oldest
        and comes forward again, a step of the model for each sample and for each time in between.
    age : mapping of str to float
        The same in seconds, for measurements that `late` does not name.
    extra : mapping of str to ExtraState
        Unknowns that are estimated too: parameters of the model, of which the controller is told, and biases of
        measurements, by their names. What is seen of them by the measurements is for the user to know.
    gate : OutlierGate, optional
        None if not given.
    floor : mapping of str to float
        Standard deviations of states below which no prediction is believed, so that a filter stays open to what is
        measured.
    discretization : Discretization, optional
        That of the controller if not given.
    backend : {"auto", "portable", "reference"}
        The C core, or NumPy, which is slower and the same; "auto" is the core where it can compute the model.
    """

    noise: Mapping[str, float]
    process: Mapping[str, float]
    x: Mapping[str, float] = field(default_factory=dict[str, float])
    deviations: Mapping[str, float] = field(default_factory=dict[str, float])
    late: Mapping[str, float] = field(default_factory=dict[str, float])
    age: Mapping[str, float] = field(default_factory=dict[str, float])
    extra: Mapping[str, ExtraState] = field(default_factory=dict[str, ExtraState])
    gate: OutlierGate | None = None
    floor: Mapping[str, float] = field(default_factory=dict[str, float])
    discretization: Discretization | None = None
    backend: Literal["auto", "portable", "reference"] = "auto"

    def start(
        self,
        problem: Problem,
        measured: Sequence[str] | None = None,
        discretization: Discretization | None = None,
    ) -> RunningExtendedKalman:
        """Return a filter for the problem's model, discretised as said here, else as the controller's.

        Innovations of angles are wrapped: of states that are angles to the problem, and of what else is in rad.
        """
        return RunningExtendedKalman(self.parts(problem, measured, discretization))

    def parts(
        self,
        problem: Problem,
        measured: Sequence[str] | None = None,
        discretization: Discretization | None = None,
    ) -> FilterParts:
        """What such a filter is made of, for estimators that are built around it."""
        model, signals = problem.model, measured_signals(problem.model, measured)
        extra = self._extra(problem, signals)
        parameters = tuple(name for name in extra if name in model.parameters)
        biases = tuple(name for name in extra if name not in model.parameters)
        scheme = self.discretization or discretization
        if scheme is not None:
            checked(scheme, "ExtendedKalman.discretization", Discretization, "Write rumo.ImplicitEuler().")
        augmented = shared_model(problem, signals, parameters, biases, scheme)
        numbers = self._numbers(problem, signals, [extra[name] for name in (*parameters, *biases)])
        late = self.lateness(signals, problem.sampling_time)
        first = self._first(problem, signals, late, numbers, parameters, biases)
        engine = CoreFilter if self._backend(augmented) == "portable" else NumpyFilter
        return FilterParts(
            augmented, engine(augmented, numbers), numbers, first, late, model.states.names, parameters, biases
        )

    def lateness(self, measured: Signals, sampling_time: float) -> Array:
        """Samples, and fractions of one, from each measurement to its arrival (m,)."""
        return lateness(self.late, self.age, measured, sampling_time, "ExtendedKalman")

    def _extra(self, problem: Problem, signals: Signals) -> dict[str, ExtraState]:
        model = problem.model
        extra = checked_items(self.extra, "ExtendedKalman.extra", ExtraState, "rumo.estimation.ExtraState(0.1, 1.0)")
        for name in extra:
            if name not in model.parameters and name not in signals:
                raise UnknownNameError("ExtendedKalman.extra", name, (*model.parameters, *signals))
        return extra

    def _numbers(self, problem: Problem, signals: Signals, extra: Sequence[ExtraState]) -> FilterNumbers:
        states, turn = problem.model.states, problem.sensors.turn
        drift = [unknown.drift**2 * problem.sampling_time for unknown in extra]
        floor = states.finite_vector(
            as_mapping(self.floor, "ExtendedKalman.floor"), "ExtendedKalman.floor", _zeros(states)
        )
        for name, value in zip(states, floor.tolist(), strict=True):
            non_negative_number(value, f"ExtendedKalman.floor[{name!r}]")
        gate = None if self.gate is None else checked(self.gate, "ExtendedKalman.gate", OutlierGate)
        angles = [turn[states.index(name)] > 0.0 if name in states else signals.unit(name) == "rad" for name in signals]
        return FilterNumbers(
            noise=_variances(signals, self.noise, "ExtendedKalman.noise"),
            process=np.append(_variances(states, self.process, "ExtendedKalman.process"), drift),
            floor=np.append(floor**2, np.zeros(len(extra))),
            turn=np.where(angles, 2.0 * np.pi, 0.0),
            width=np.inf if gate is None else gate.width,
            patience=0 if gate is None else gate.patience,
        )

    def _first(
        self,
        problem: Problem,
        signals: Signals,
        late: Array,
        numbers: FilterNumbers,
        parameters: tuple[str, ...],
        biases: tuple[str, ...],
    ) -> FirstBelief:
        states, extra = problem.model.states, self.extra
        given = as_mapping(self.x, "ExtendedKalman.x") | as_mapping(self.deviations, "ExtendedKalman.deviations")
        prompt = [name for name in states if name in signals and not late[signals.index(name)] and name not in given]
        first = Signals({name: states.unit(name) for name in states if name not in prompt}, "first estimates")
        n = len(states) + len(extra)
        x, variances = np.full(n, np.nan), np.empty(n)
        places, told = np.full(n, -1), np.full(n, -1)
        columns = [states.index(name) for name in first]
        x[columns] = first.finite_vector(self.x, "ExtendedKalman.x")
        variances[columns] = _variances(first, self.deviations, "ExtendedKalman.deviations")
        for name in prompt:
            i, j = states.index(name), signals.index(name)
            places[i], variances[i] = j, numbers.noise[j] + (extra[name].deviation ** 2 if name in biases else 0.0)
        for i, name in enumerate((*parameters, *biases), len(states)):
            start, variances[i] = extra[name].start, extra[name].deviation ** 2
            if start is not None or name in biases:
                x[i] = start or 0.0
            else:
                told[i] = problem.model.parameters.index(name)
        return FirstBelief(x, variances, places, told)

    def _backend(self, model: AugmentedModel) -> str:
        if self.backend not in BACKENDS:
            raise UnknownNameError("ExtendedKalman.backend", self.backend, BACKENDS)
        reason = can_compute(model)
        if self.backend == "portable" and reason:
            raise ArgumentError("ExtendedKalman.backend", "'portable'", f"'reference': {reason}")
        return "reference" if reason else "portable" if self.backend == "auto" else self.backend


def _zeros(signals: Signals) -> Array:
    return np.zeros(len(signals))


def _variances(signals: Signals, deviations: Mapping[str, float], argument: str) -> Array:
    sigma = signals.finite_vector(as_mapping(deviations, argument), argument)
    for name, value in zip(signals, sigma.tolist(), strict=True):
        if value <= 0.0:
            raise ArgumentError(f"{argument}[{name!r}]", f"{value:g}", "a positive standard deviation")
    return sigma**2
