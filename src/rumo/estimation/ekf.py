"""Extended Kalman filter on the controller's own discretised model: smooths without the lag of a low-pass."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from rumo.checks import as_mapping, whole_number
from rumo.errors import ArgumentError
from rumo.estimation.base import Estimate, measured_signals
from rumo.interrupts import interruptible
from rumo.model import Model
from rumo.problem import Problem
from rumo.signals import Array, Signals
from rumo.transcription import Transcription


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
    late : mapping of str to int
        Samples from a measurement to its arrival. The filter goes back to the time of the latest and comes forward
        again, a step of the model for each sample.
    """

    noise: Mapping[str, float]
    process: Mapping[str, float]
    x: Mapping[str, float] = field(default_factory=dict[str, float])
    deviations: Mapping[str, float] = field(default_factory=dict[str, float])
    late: Mapping[str, int] = field(default_factory=dict[str, int])

    def start(self, problem: Problem, measured: Sequence[str] | None = None) -> RunningExtendedKalman:
        """Return a filter for the problem's model, discretised by implicit Euler.

        Innovations of angles are wrapped: of states that are angles to the problem, and of what else is in rad.
        """
        states, signals = problem.model.states, measured_signals(problem.model, measured)
        noise, process = (
            _variances(signals, self.noise, "ExtendedKalman.noise"),
            _variances(states, self.process, "ExtendedKalman.process"),
        )
        for name, samples in as_mapping(self.late, "ExtendedKalman.late").items():
            signals.index(name, "ExtendedKalman.late")
            whole_number(samples, f"ExtendedKalman.late[{name!r}]", 0)
        late = np.array([self.late.get(name, 0) for name in signals], dtype=int)
        given = as_mapping(self.x, "ExtendedKalman.x") | as_mapping(self.deviations, "ExtendedKalman.deviations")
        prompt = [name for name in states if name in signals and not self.late.get(name, 0) and name not in given]
        first = Signals({name: states.unit(name) for name in states if name not in prompt}, "first estimates")
        x, spread = np.full(len(states), np.nan), np.empty(len(states))
        columns = [states.index(name) for name in first]
        x[columns] = first.finite_vector(self.x, "ExtendedKalman.x")
        spread[columns] = _variances(first, self.deviations, "ExtendedKalman.deviations")
        for name in prompt:
            spread[states.index(name)] = noise[signals.index(name)]
        return RunningExtendedKalman(Transcription(problem), signals, noise, process, late, x, spread)


def _variances(signals: Signals, deviations: Mapping[str, float], argument: str) -> Array:
    sigma = signals.finite_vector(as_mapping(deviations, argument), argument)
    for name, value in zip(signals, sigma, strict=True):
        if value <= 0.0:
            raise ArgumentError(f"{argument}[{name!r}]", f"{value:g}", "a positive standard deviation")
    return sigma**2


def _angles(problem: Problem, signals: Signals) -> NDArray[np.bool_]:
    """For which of the measured signals a full turn is no difference (m,)."""
    states, turn = problem.model.states, problem.sensors.turn
    return np.array(
        [turn[states.index(name)] > 0.0 if name in states else signals.unit(name) == "rad" for name in signals]
    )


def measurement_function(model: Model, names: Sequence[str]) -> ca.Function:
    """`(xz, u, p) -> y, H`: measurements (m,) and their derivatives by x (m, nx), algebraic variables eliminated."""
    arguments = [model.xz, model.u, model.p]
    y = ca.vertcat(*(model.expression(name, "measured") for name in names))
    by_x = ca.jacobian(y, model.x)
    if len(model.algebraic):
        g = model.g(*arguments)
        by_x -= ca.jacobian(y, model.z) @ ca.solve(ca.jacobian(g, model.z), ca.jacobian(g, model.x))
    return ca.Function("measurement", arguments, [y, ca.densify(by_x)])


@dataclass
class _Sample:
    """What is known of a sample: the input held until then, parameters, measurements as they come in."""

    applied: Array
    parameters: Array
    measured: Array


class RunningExtendedKalman:
    """A filter with memory; it starts when each state without a first estimate has been measured once."""

    def __init__(
        self,
        transcription: Transcription,
        signals: Signals,
        noise: Array,
        process: Array,
        late: np.ndarray,
        x: Array,
        spread: Array,
    ) -> None:
        problem = transcription.problem
        states = problem.model.states
        self._transcription = transcription
        self._measurement = measurement_function(problem.model, signals.names)
        self._angles = _angles(problem, signals)
        self._noise, self._process, self._late = noise, process, late
        self._first, self._spread = x, np.diag(spread)
        self._grid = np.array([]) if problem.uniform else problem.steps[:1]  # what `given` adds to the parameters
        # States that start at a measurement, and where that stands.
        self._prompt = [(i, signals.index(name)) for i, name in enumerate(states) if np.isnan(x[i])]
        self._seen = x  # the last that was measured of each
        self._x: Array | None = None
        self._covariance = self._spread
        self._recent: deque[_Sample] = deque()

    def update(self, measured: Array, applied: Array, parameters: Array) -> Estimate:
        """Estimate from measurements (m,), see `RunningEstimator`; those that are not finite are left to prediction."""
        measured = np.asarray(measured, dtype=float)
        if self._x is None:
            return self._start(measured)
        self._recent.append(_Sample(applied, parameters, np.full(len(measured), np.nan)))
        for j, late in enumerate(self._late):
            if late < len(self._recent):
                self._recent[-1 - late].measured[j] = measured[j]
        try:
            with interruptible():
                # All measurements of the oldest sample have come: it is done with.
                if len(self._recent) > self._late.max(initial=0):
                    self._x, self._covariance = self._advance(self._x, self._covariance, self._recent.popleft())
                x, covariance = self._x, self._covariance
                for sample in self._recent:
                    x, covariance = self._advance(x, covariance, sample)
        except np.linalg.LinAlgError:
            # The model has no value here: start anew at the next good sample.
            self._x, self._covariance = None, self._spread
            self._recent.clear()
            self._seen = self._first
            return Estimate(self._of_states(measured))
        return Estimate(x, covariance)

    def _start(self, measured: Array) -> Estimate:
        now = self._of_states(measured)
        self._seen = np.where(np.isfinite(now), now, self._seen)
        if not np.isfinite(self._seen).all():
            return Estimate(self._seen.copy())
        self._x = self._seen
        return Estimate(self._x, self._covariance)

    def _of_states(self, measured: Array) -> Array:
        """Measured states, first estimates of the others."""
        x = self._first.copy()
        for i, j in self._prompt:
            x[i] = measured[j]
        return x

    def _advance(self, x: Array, covariance: Array, sample: _Sample) -> tuple[Array, Array]:
        """Predict one sample, then correct by what was measured at its end."""
        xz, covariance = self._predict(x, covariance, sample)
        x = xz[: len(x)]
        known = np.isfinite(sample.measured)
        if known.any():
            x, covariance = self._correct(xz, covariance, sample, known)
        if not (np.isfinite(x).all() and np.isfinite(covariance).all()):
            raise np.linalg.LinAlgError("the filter left the finite numbers")
        return x, covariance

    def _predict(self, x: Array, covariance: Array, sample: _Sample) -> tuple[Array, Array]:
        """One step of the discretised model by Newton's method, and its covariance."""
        w, sensitivity = self._transcription.advance(x, sample.applied, np.r_[sample.parameters, self._grid])
        transition = sensitivity[: len(x)]
        size = len(self._transcription.problem.model.variables)
        return w[:size], transition @ covariance @ transition.T + np.diag(self._process)

    def _correct(self, xz: Array, covariance: Array, sample: _Sample, known: np.ndarray) -> tuple[Array, Array]:
        """Joseph's form, which keeps the covariance symmetric and positive."""
        y, jacobian = (value.full() for value in self._measurement(xz, sample.applied, sample.parameters))
        x, H = xz[: len(covariance)], np.ascontiguousarray(jacobian[known])
        R = np.diag(self._noise[known])
        gain = np.linalg.solve(H @ covariance @ H.T + R, H @ covariance).T
        keep = np.eye(len(x)) - gain @ H
        innovation = sample.measured - y.ravel()
        turns = np.round(innovation[known] / (2.0 * np.pi))
        innovation = innovation[known] - np.where(self._angles[known], 2.0 * np.pi * turns, 0.0)
        return x + gain @ innovation, keep @ covariance @ keep.T + gain @ R @ gain.T
