"""What every estimator offers."""

from __future__ import annotations

from typing import Protocol

from rumo.problem import Problem
from rumo.signals import Array


class RunningEstimator(Protocol):
    """An estimator with memory, called once each sample."""

    def __call__(self, measurement: Array, applied: Array) -> Array:
        """Estimate of the state.

        Parameters
        ----------
        measurement : ndarray, shape (nx,)
            Measured states; with NaN or infinity in it the memory must stay sound.
        applied : ndarray, shape (nu,)
            Input held since the sample before.
        """
        ...


class Estimator(Protocol):
    """Settings of an estimator."""

    def start(self, problem: Problem) -> RunningEstimator:
        """Return an estimator without memory for the states of the problem's model."""
        ...
