"""A case's prediction: the truth, by CVODES, and how far a scheme is from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.discretization import Discretization
from rumo.discretization.stability import modes
from rumo.signals import Array
from rumo.simulation import Plant
from rumo.studies.cases import Case
from rumo.transcription import Transcription

TOLERANCE = 1e-12
"""Of CVODES, relative to a state's scale."""


@dataclass(frozen=True)
class PredictionError:
    """How far a scheme is from the truth.

    Attributes
    ----------
    outputs : float
        Largest distance of the outputs at the end of any interval, in the case's unit.
    states : float
        The same of any state, over its range along the horizon.
    kick_left : float
        What is left at the end of a small error of a fast state at the beginning, less what the true system leaves:
        1 if it does not decay.
    """

    outputs: float
    states: float
    kick_left: float


UNUSABLE = PredictionError(np.inf, np.inf, np.inf)


class Truth:
    """The exact prediction of a case.

    Attributes
    ----------
    x : ndarray, shape (n + 1, nx)
        States at the ends of the case's shortest intervals.
    kicked : ndarray, shape (nx,)
        State at the end, after a kick at the beginning.
    rates : ndarray, shape (n + 1, nx)
        Of the modes at x [1/s], complex.
    span : float
        Range of the outputs along x, in the case's unit.
    """

    def __init__(self, case: Case) -> None:
        self.case, model, finest = case, case.model, min(case.steps)
        plant, p = Plant(model, finest, TOLERANCE, case.scales), model.default_parameters

        def drive(x: Array, intervals: range) -> Array:
            states = [x]
            for k in intervals:
                states.append(plant.advance(states[-1], self._inputs(finest * k), p))
            return np.array(states)

        intervals, settling = range(case.intervals(finest)), range(-round(max(case.steps) / finest), 0)
        begin = drive(model.states.finite_vector(case.start, "start"), settling)[-1]
        self._kick = model.states.finite_vector(case.kick, "kick", np.zeros(len(begin)))
        self.x, self.kicked = drive(begin, intervals), drive(begin + self._kick, intervals)[-1]
        u = np.array([self._inputs(finest * k) for k in range(len(self.x))])
        self.rates = modes(model, self.x, u, p)
        self._outputs = [model.states.index(name) for name in case.outputs]
        self.span = float(np.linalg.norm(np.ptp(self.x[:, self._outputs], axis=0)))

    def error(self, scheme: Discretization, step: float) -> PredictionError:
        """Of a scheme with intervals of this length [s]; infinite if its equations cannot be solved."""
        transcription = Transcription(self.case.problem(step), scheme)
        try:
            x, kicked = (self._predict(transcription, begin) for begin in (self.x[0], self.x[0] + self._kick))
        except np.linalg.LinAlgError:
            return UNUSABLE
        error = x - self.x[:: (len(self.x) - 1) // self.case.intervals(step)]
        if not np.isfinite(kicked).all() or not np.isfinite(error).all():
            return UNUSABLE
        outputs = error[:, self._outputs]
        fast = self._kick != 0.0
        left = (kicked[-1] - x[-1]) - (self.kicked - self.x[-1])
        return PredictionError(
            float(np.linalg.norm(outputs, axis=1).max()),
            float((np.abs(error) / np.ptp(self.x, axis=0)).max()),
            float(np.abs(left[fast] / self._kick[fast]).max()),
        )

    def _predict(self, transcription: Transcription, begin: Array) -> Array:
        problem, states = transcription.problem, [begin]
        p = transcription.given(problem.parameters)
        for k in range(problem.horizon):
            x, u = states[-1], self._inputs(k * problem.sampling_time)
            if transcription.discretization.explicit:  # no equations: without an end, they are the end
                w = transcription.interval(np.zeros(len(x)), x, u, p[k]).full().ravel()
            else:
                w, _ = transcription.advance(x, u, p[k])
            states.append(w[: len(begin)])
        return np.array(states)

    def _inputs(self, t: float) -> Array:
        """Held over the longest intervals, so that all grids predict the same."""
        longest = max(self.case.steps)
        return self.case.inputs(longest * np.floor(t / longest + 1e-9))
