"""What an estimator and a controller are told where inputs begin to act between two samples."""

from __future__ import annotations

import numpy as np

from rumo.discretization import Discretization
from rumo.estimation import Estimate, RunningEstimator
from rumo.estimation.prediction import Prediction
from rumo.interrupts import interruptible
from rumo.problem import Problem
from rumo.signals import Array
from rumo.simulation.actuators import Actuators


class Compensation:
    """From the estimate at a sample to the state at which the next input begins to act, a share of a sample later.

    So a controller sees samples at which its inputs change, as ever. Estimators that have an `input_age` are told the
    share; others get the mean of two inputs.

    Parameters
    ----------
    problem : Problem
        Of the observed model.
    discretization : Discretization
        The controller's.
    estimator : RunningEstimator
        Of the run.
    share : float
        Of a sample, 0 or more and less than 1.
    """

    def __init__(
        self, problem: Problem, discretization: Discretization, estimator: RunningEstimator, share: float
    ) -> None:
        self._parameters, self._share = problem.model.parameters, share
        self._prediction = Prediction(problem, discretization) if share else None
        self._mean = bool(share) and not hasattr(estimator, "input_age")
        if share and not self._mean:
            setattr(estimator, "input_age", share)  # noqa: B010 -- no part of what every estimator has

    def applied(self, actuators: Actuators) -> Array:
        """Input since the sample before, for the estimator (nu,)."""
        if self._mean:
            return self._share * actuators.before + (1.0 - self._share) * actuators.believed
        return actuators.believed

    def ahead(self, estimate: Estimate, applied: Array, known: Array) -> Array:
        """State (nx,) when the next input begins to act.

        Parameters
        ----------
        estimate : Estimate
            At the sample.
        applied : ndarray, shape (nu,)
            Until then.
        known : ndarray, shape (np_,)
            Parameters of the model; those that are estimated take their place.
        """
        if self._prediction is None:
            return estimate.x
        parameters = known.copy()
        for name, value in estimate.parameters.items():
            parameters[self._parameters.index(name)] = value
        with interruptible():
            return np.asarray(self._prediction.ahead(estimate.x, applied, parameters, self._share))
