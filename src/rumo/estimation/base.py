"""What every estimator offers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from rumo.checks import as_mapping, as_names, as_numbers, check_signature, checked
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, ShapeError
from rumo.estimation.innovation import Innovation
from rumo.model import Model
from rumo.problem import Problem
from rumo.signals import Array, Signals, read_only


@dataclass(frozen=True, eq=False)
class Estimate:
    """What an estimator believes.

    Attributes
    ----------
    x : ndarray, shape (nx,)
        State of the controller's model.
    covariance : ndarray, shape (nx, nx), optional
        Of its error, where the estimator knows.
    parameters : mapping of str to float
        Parameters of the controller's model that are estimated too; the controller is told.
    biases : mapping of str to float
        Biases of measurements, by their names.
    deviations : mapping of str to float
        Standard deviations of parameters and biases.
    innovation : Innovation, optional
        Of the latest sample that is complete, where the estimator knows.
    """

    x: Array
    covariance: Array | None = None
    parameters: Mapping[str, float] = field(default_factory=dict[str, float])
    biases: Mapping[str, float] = field(default_factory=dict[str, float])
    deviations: Mapping[str, float] = field(default_factory=dict[str, float])
    innovation: Innovation | None = None


@runtime_checkable
class RunningEstimator(Protocol):
    """An estimator with memory, beside the controller; asked once each sample.

    One that predicts with inputs that begin to act within samples has an attribute `input_age`, which a loop sets to
    the share of a sample that they need; others are told the mean input of each sample.
    """

    def update(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        """Estimate of the state.

        Parameters
        ----------
        measured : ndarray, shape (m,)
            The signals that the estimator was started for; NaN where a measurement is missing. With NaN or infinity
            in it the memory must stay sound.
        applied : ndarray, shape (nu,)
            Input held since the sample before, or from `input_age` after it on.
        parameters : ndarray, shape (np_,)
            Of the controller's model, since the sample before.
        """
        ...


@runtime_checkable
class Estimator(Protocol):
    """Settings of an estimator.

    One that takes late measurements for what they are has a mapping `late` from their names to samples, or `age` to
    seconds, like `ExtendedKalman`; a loop refuses late sensors without.
    """

    def start(
        self,
        problem: Problem,
        measured: Sequence[str] | None = None,
        discretization: Discretization | None = None,
    ) -> RunningEstimator:
        """Return an estimator without memory.

        Parameters
        ----------
        problem : Problem
            Its model has the states that are estimated.
        measured : sequence of str, optional
            Signals that are measured, in the order in which they will come: states, algebraic variables and outputs
            of the model. All states if not given.
        discretization : Discretization, optional
            The controller's scheme, for estimators that predict.
        """
        ...


@dataclass(frozen=True)
class Unfiltered:
    """No estimator: measured states pass as they are."""

    def start(
        self,
        problem: Problem,
        measured: Sequence[str] | None = None,
        discretization: Discretization | None = None,
    ) -> RunningUnfiltered:
        """Return what passes the states of the problem's model on."""
        return RunningUnfiltered(state_columns(problem.model, measured))


class RunningUnfiltered:
    """Passes states on."""

    def __init__(self, columns: list[int]) -> None:
        self._columns = columns

    def update(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        """The measured states, see `RunningEstimator`."""
        return Estimate(np.asarray(measured, dtype=float)[self._columns])


def check_estimator(estimator: object) -> None:
    """Raise unless it is an estimator's settings."""
    if isinstance(estimator, type) or not isinstance(estimator, Estimator):
        shown = estimator.__name__ if isinstance(estimator, type) else repr(estimator)
        raise ArgumentError("estimator", shown, "settings such as Butterworth(cutoff=3.5)")


def started(
    estimator: Estimator, problem: Problem, measured: Sequence[str], discretization: Discretization | None = None
) -> RunningEstimator:
    """What an estimator's settings, which may be of the user's making, start."""
    expected = "one of (problem, measured, discretization)"
    check_signature(estimator.start, "estimator.start", 3, expected, "The last is the controller's scheme.")
    running: object = estimator.start(problem, measured, discretization)
    if not isinstance(running, RunningEstimator):
        expected = "an object with update(measured, applied, parameters)"
        raise ArgumentError("estimator.start()", repr(running), expected)
    return running


def as_estimate(estimate: object, model: Model) -> Estimate:
    """What an estimator, which may be of the user's making, has answered: an `Estimate` of this model.

    Parameters that are no finite numbers are left out: the controller keeps its own.
    """
    argument = "estimator.update()"
    if not isinstance(estimate, Estimate):
        cure = "Write return rumo.estimation.Estimate(x)."
        raise ArgumentError(argument, repr(estimate), "an Estimate", cure)
    x, covariance = model.states.vector(estimate.x, f"{argument}.x"), estimate.covariance
    if covariance is not None:
        covariance, shape = as_numbers(covariance, f"{argument}.covariance"), 2 * x.shape
        if covariance.shape != shape:
            raise ShapeError(f"{argument}.covariance", f"shape {covariance.shape}", f"shape {shape}")
    told: dict[str, float] = {}
    if estimate.parameters:
        given = as_mapping(estimate.parameters, f"{argument}.parameters")
        vector = model.parameters.vector(given, f"{argument}.parameters", model.default_parameters)
        told = {name: float(vector[model.parameters.index(name)]) for name in given}
    if estimate.innovation is not None:
        checked(estimate.innovation, f"{argument}.innovation", Innovation)
    known = {name: value for name, value in told.items() if np.isfinite(value)}
    kept = None if covariance is None else read_only(covariance)
    return Estimate(read_only(x), kept, known, estimate.biases, estimate.deviations, estimate.innovation)


def measured_signals(model: Model, measured: Sequence[str] | None) -> Signals:
    """Names and units of signals of a model that are measured, its states for None."""
    names = model.states.names if measured is None else as_names(measured, "measured")
    for name in names:
        model.expression(name, "measured")
    return Signals({name: model.unit(name) for name in names}, "measured")


def state_columns(model: Model, measured: Sequence[str] | None) -> list[int]:
    """Where each state of a model stands among what is measured, for estimators that need all of them."""
    names = list(model.states if measured is None else as_names(measured, "measured"))
    missing = [name for name in model.states if name not in names]
    if missing:
        raise ArgumentError(
            "measured",
            f"no {', '.join(missing)}",
            "all states of the controller's model",
            "ExtendedKalman(noise, process, x={...}) estimates states that are not measured.",
        )
    return [names.index(name) for name in model.states]
