"""Whether a trajectory is what it is said to be, the solution of a horizon's NLP; and how it becomes that."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rumo.controllers.engines.numpy import NumpyRti
from rumo.controllers.engines.trajectory import Trajectory
from rumo.controllers.settings import Settings
from rumo.plan import DIAGNOSTICS
from rumo.signals import Array
from rumo.status import Status
from rumo.transcription import Transcription

NO_CHANGE = 1e-6
"""Step of an input, over its range, that a solution need not be improved by."""
ACCURATE = 1e-4
"""The same that a solution may still ask for."""
MOST = 20
"""Iterations: at a solution with much curvature they converge slowly."""


class Polish:
    """Real-time iterations from a trajectory that another method says is the solution.

    At a solution they leave all as it is, whatever that method's tolerances mean. IPOPT's is absolute, of a cost that
    is scaled until its steepest slope is 1: where the prices of violations are above the largest weight, one of these.
    With prices of 10 000 times the weights, little is left of the weights that is not below the tolerance.
    """

    def __init__(self, transcription: Transcription) -> None:
        self._method = NumpyRti(transcription, Settings())

    def update(self, transcription: Transcription) -> None:
        """Use the numbers of another problem of the same structure."""
        self._method = NumpyRti(transcription, Settings())

    def __call__(
        self, trajectory: Trajectory, x: Array, window: Mapping[str, Array], applied: Array, end: float
    ) -> tuple[Trajectory, Status]:
        """The trajectory, or what it becomes, and what that is worth.

        BUDGET_EXCEEDED where iterations ask for more than `ACCURATE`, and do not get closer; OPTIMAL also where the QP
        has no solution that could be trusted, or the clock of `time.perf_counter` comes to `end`, so that nothing is
        known against it.
        """
        self._method.end = end
        before, off = trajectory, np.inf
        for _ in range(MOST):
            candidate = (
                self._method.iterate(x, window, applied) if self._method.linearize(trajectory, applied) else None
            )
            if candidate is None or not candidate.status.solved or not candidate.trajectory.finite:
                break
            step = float(candidate.diagnostics[DIAGNOSTICS.index("step")])
            if step >= off:
                trajectory = before
                break
            before, off = trajectory, step
            if step <= NO_CHANGE:
                break
            trajectory = candidate.trajectory
        return trajectory, Status.BUDGET_EXCEEDED if ACCURATE < off < np.inf else Status.OPTIMAL
