"""A state some time ahead, within a sample."""

from __future__ import annotations

import numpy as np

from rumo.discretization import Discretization
from rumo.estimation.ekf.augmented import AugmentedModel
from rumo.estimation.ekf.core import CoreFilter, can_compute
from rumo.estimation.ekf.engine import FilterNumbers
from rumo.estimation.ekf.numpy import NumpyFilter
from rumo.problem import Problem
from rumo.signals import Array


class Prediction:
    """A problem's model over shares of a sample, by one step of a scheme, in the C core where that can.

    Parameters
    ----------
    problem : Problem
        With the model, and the sampling time.
    discretization : Discretization, optional
        Implicit Euler if not given.
    """

    def __init__(self, problem: Problem, discretization: Discretization | None = None) -> None:
        states = problem.model.states
        self._model = AugmentedModel(problem, states, (), (), discretization)
        ones, zeros = np.ones(len(states)), np.zeros(len(states))
        numbers = FilterNumbers(ones, ones, zeros, zeros, np.inf, 0)  # nothing is filtered
        engine = NumpyFilter if can_compute(self._model) else CoreFilter
        self._engine = engine(self._model, numbers)

    def ahead(self, x: Array, u: Array, p: Array, share: float) -> Array:
        """State (nx,) a share of a sample after x (nx,), with input u (nu,) and parameters p (np_,) held.

        NaN where x is not finite, or the model has no finite value.
        """
        try:
            if np.isfinite(x).all():
                return self._engine.linearise(x, u, self._model.parameters(p, share))[0]
        except np.linalg.LinAlgError:
            pass
        return np.full(len(x), np.nan)
