"""A case's prediction: the reference solution, and how far a scheme is from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.discretization import Discretization
from rumo.discretization.stability import eigenvalues
from rumo.signals import Array
from rumo.simulation import Plant
from rumo.studies.discretization.cases import Case
from rumo.transcription import Transcription

TOLERANCE = 1e-13
"""Of CVODES, relative to a state's scale."""


@dataclass(frozen=True)
class Accuracy:
    """How far a scheme's prediction is from the reference solution.

    Attributes
    ----------
    outputs : float
        Largest distance of the outputs, in the case's unit, where the case's longest intervals end.
    states : float
        The same of any state, over its range along the horizon.
    perturbation_left : float
        What is left at the end of a small error of a fast state at the beginning, over that error, less what the
        reference solution leaves: 1 if it does not decay.
    """

    outputs: float
    states: float
    perturbation_left: float


UNUSABLE = Accuracy(np.inf, np.inf, np.inf)


class ReferenceSolution:
    """The exact prediction of a case, by CVODES.

    Attributes
    ----------
    x : ndarray, shape (n + 1, nx)
        States where the case's longest intervals begin and end.
    perturbed : ndarray, shape (nx,)
        State at the end, after a perturbation at the beginning.
    floor : float
        Change of the outputs if the tolerance is ten times larger, in the case's unit: errors below it are not the
        scheme's.
    rates : ndarray, shape (m, nx)
        Eigenvalues [1/s], complex, where the case's shortest intervals begin and end.
    span : float
        Range of the outputs along the horizon, in the case's unit.
    """

    def __init__(self, case: Case) -> None:
        self.case, model = case, case.model
        self._outputs = [model.states.index(name) for name in case.outputs]
        coarse, fine = max(case.steps), min(case.steps)
        p = model.default_parameters

        def drive(x: Array, times: Array, step: float, tolerance: float = TOLERANCE) -> Array:
            plant, states = Plant(model, step, tolerance, case.scales, "sundials"), [x]
            for t in times:
                states.append(plant.advance(states[-1], self._inputs(t), p))
            return np.array(states)

        times, fine_times = (step * np.arange(case.intervals(step)) for step in (coarse, fine))
        begin = drive(model.states.finite_vector(case.start, "start"), np.array([-coarse]), coarse)[-1]
        self._perturbation = model.states.finite_vector(case.perturbation, "perturbation", np.zeros(len(begin)))
        self.x = drive(begin, times, coarse)
        self.perturbed = drive(begin + self._perturbation, times, coarse)[-1]
        self.floor = self._distance(drive(begin, times, coarse, 10.0 * TOLERANCE) - self.x)
        along = drive(begin, fine_times, fine)
        u = np.array([self._inputs(t) for t in (*fine_times, case.length)])
        self.rates = eigenvalues(model, along, u, p)
        self._ranges = np.ptp(along, axis=0)
        self.span = float(np.linalg.norm(self._ranges[self._outputs]))

    def accuracy(self, scheme: Discretization, step: float) -> Accuracy:
        """Of a scheme with intervals of this length [s]; infinite errors if its equations cannot be solved."""
        transcription = Transcription(self.case.problem(step), scheme)
        try:
            x, perturbed = (
                self._predict(transcription, begin) for begin in (self.x[0], self.x[0] + self._perturbation)
            )
        except np.linalg.LinAlgError:
            return UNUSABLE
        error = x - self.x
        if not np.isfinite(perturbed).all() or not np.isfinite(error).all():
            return UNUSABLE
        fast = self._perturbation != 0.0
        left = (perturbed[-1] - x[-1]) - (self.perturbed - self.x[-1])
        return Accuracy(
            self._distance(error),
            float((np.abs(error) / self._ranges).max()),
            float(np.abs(left[fast] / self._perturbation[fast]).max()),
        )

    def _distance(self, error: Array) -> float:
        return float(np.linalg.norm(error[:, self._outputs], axis=1).max())

    def _predict(self, transcription: Transcription, begin: Array) -> Array:
        """States where the longest intervals begin and end."""
        problem, states = transcription.problem, [begin]
        p = transcription.given(problem.parameters)
        for k in range(problem.horizon):
            x, u = states[-1], self._inputs(k * problem.sampling_time)
            if transcription.discretization.explicit:  # no equations: without an end, they are the end
                w = transcription.interval(np.zeros(len(x)), x, u, p[k]).full().ravel()
            else:
                w, _ = transcription.advance(x, u, p[k])
            states.append(w[: len(begin)])
        return np.array(states[:: problem.horizon // (len(self.x) - 1)])

    def _inputs(self, t: float) -> Array:
        """Held over the longest intervals, so that all grids predict the same."""
        longest = max(self.case.steps)
        return self.case.inputs(longest * np.floor(t / longest + 1e-9))
