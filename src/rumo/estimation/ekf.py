"""Extended Kalman filter on the controller's own discretised model: smooths without the lag of a low-pass."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rumo.errors import ArgumentError
from rumo.problem import Problem
from rumo.signals import Array, Signals
from rumo.transcription import Transcription


@dataclass(frozen=True)
class ExtendedKalman:
    """Extended Kalman filter, every state measured (Simon, 2006, ch. 13).

    Parameters
    ----------
    noise : mapping of str to float
        Standard deviation of the measurement of each state of the controller's model, positive.
    process : mapping of str to float
        Standard deviation of what the model misses in one sample, for each state, positive.
    """

    noise: Mapping[str, float]
    process: Mapping[str, float]

    def start(self, problem: Problem) -> RunningExtendedKalman:
        """Return a filter for the problem's model, discretised by implicit Euler; innovations in rad are wrapped."""
        states = problem.model.states
        noise, process = _variances(states, self.noise, "noise"), _variances(states, self.process, "process")
        return RunningExtendedKalman(Transcription(problem), noise, process)


def _variances(states: Signals, deviations: Mapping[str, float], argument: str) -> Array:
    sigma = states.finite_vector(dict(deviations), argument)
    for name, value in zip(states, sigma, strict=True):
        if value <= 0.0:
            raise ArgumentError(f"{argument}[{name!r}]", f"{value:g}", "a positive standard deviation")
    return sigma**2


class RunningExtendedKalman:
    """A filter with memory; it starts at the first sample without NaN or infinity."""

    def __init__(self, transcription: Transcription, noise: Array, process: Array) -> None:
        self._transcription = transcription
        self._angles = transcription.problem.model.states.angles
        self._noise = noise
        self._process = process
        self._x: Array | None = None
        self._covariance = np.diag(noise)

    def __call__(self, measurement: Array, applied: Array) -> Array:
        """Estimate (nx,) from a measurement (nx,); its entries that are not finite are left to the prediction."""
        known = np.isfinite(measurement)
        if self._x is None:
            if known.all():
                self._x = measurement
            return measurement
        try:
            x, covariance = self._predict(self._x, applied)
            if known.any():
                x, covariance = self._update(x, covariance, measurement, known)
        except np.linalg.LinAlgError:
            x, covariance = np.full_like(measurement, np.nan), self._covariance
        if not (np.isfinite(x).all() and np.isfinite(covariance).all()):
            # The model has no value here: start anew at the next good sample.
            self._x, self._covariance = None, np.diag(self._noise)
            return measurement
        self._x, self._covariance = x, covariance
        return x

    def _predict(self, x: Array, u: Array) -> tuple[Array, Array]:
        """One step of the discretised model by Newton's method, and its covariance."""
        w, sensitivity = self._transcription.advance(x, u)
        z, transition = w[: len(x)], sensitivity[: len(x)]
        return z, transition @ self._covariance @ transition.T + np.diag(self._process)

    def _update(self, x: Array, covariance: Array, measurement: Array, known: np.ndarray) -> tuple[Array, Array]:
        """Joseph's form, which keeps the covariance symmetric and positive."""
        H = np.eye(len(x))[known]
        R = np.diag(self._noise[known])
        gain = np.linalg.solve(H @ covariance @ H.T + R, H @ covariance).T
        keep = np.eye(len(x)) - gain @ H
        innovation = measurement - x
        innovation -= np.where(self._angles, 2.0 * np.pi * np.round(innovation / (2.0 * np.pi)), 0.0)
        return x + gain @ innovation[known], keep @ covariance @ keep.T + gain @ R @ gain.T
