"""Linearisation along the reference: no iteration, the method the paper calls cheaper but worse."""

from __future__ import annotations

import numpy as np

from rumo.controllers.condensed import CondensedController
from rumo.controllers.fallback import Trajectory
from rumo.controllers.gate import WIDE_GATE, InnovationGate
from rumo.controllers.policy import Candidate
from rumo.controllers.qp import QpOptions
from rumo.discretization import Discretization
from rumo.errors import ArgumentError
from rumo.problem import Problem
from rumo.signals import Array


class LinearTimeVarying(CondensedController):
    """Linear time-varying MPC: the same QP as the real-time iteration, about the reference instead of the last plan.

    The reference must name every state of the model; inputs that it leaves out are linearised about the
    safe input.

    Parameters
    ----------
    problem : Problem
        What to solve.
    discretization : Discretization, optional
        Implicit Euler if not given.
    qp : QpOptions, optional
        Limits and accuracy of the QP solver.
    gate : InnovationGate, optional
        Holds back implausible measurements; None lets all finite ones pass.
    """

    name = "ltv"

    def __init__(
        self,
        problem: Problem,
        discretization: Discretization | None = None,
        *,
        qp: QpOptions | None = None,
        gate: InnovationGate | None = WIDE_GATE,
    ) -> None:
        self.qp = qp or QpOptions()
        super().__init__(problem, discretization, gate=gate)

    @property
    def _reference_signals(self) -> tuple[str, ...]:
        model = self.problem.model
        return (*self.problem.outputs, *model.states, *model.inputs)

    def _prepare(self, guess: Trajectory) -> bool:
        """Nothing: the reference to linearise about comes with the measurement."""
        return True

    def _solve(self, x: Array, window: dict[str, Array], guess: Trajectory) -> Candidate | None:
        reference = self._trajectory(window)
        if not self._linearize(reference):
            return None
        return self._iterate(x, window)

    def _trajectory(self, window: dict[str, Array]) -> Trajectory:
        problem = self.problem
        model, N = problem.model, problem.horizon
        missing = [name for name in model.states if name not in window]
        if missing:
            raise ArgumentError(
                "reference",
                f"no values for {', '.join(missing)}",
                "values for every state of the model",
                "LinearTimeVarying linearises along the reference.",
            )
        named = dict(zip(model.inputs, np.tile(problem.safe_input[:, None], N + 1), strict=True)) | window
        u = np.column_stack([named[name][:N] for name in model.inputs])
        x = np.column_stack([named[name] for name in model.states])
        return Trajectory(u, x, self.transcription.inner_between(x[:-1], x[1:]))
