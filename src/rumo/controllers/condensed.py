"""What controllers with a condensed QP share: linearise, condense, solve, expand."""

from __future__ import annotations

import numpy as np

from rumo.controllers.condensing import Condensed, condense, quadratic_program
from rumo.controllers.fallback import Trajectory
from rumo.controllers.gate import gate_stages
from rumo.controllers.policy import Candidate, PolicyController
from rumo.controllers.qp import QpOptions, QuadraticProgram, solve
from rumo.signals import Array
from rumo.status import Status


class CondensedController(PolicyController):
    """One linearisation and one QP, about whatever trajectory the subclass chooses."""

    qp: QpOptions
    _condensed: Condensed | None = None

    def _reach(self) -> Array | None:
        return None if self._condensed is None else self._condensed.reach_until(gate_stages(self.problem))

    def _linearize(self, guess: Trajectory) -> bool:
        """Linearise about the guess, eliminate the implicit states, condense; False if that gives no numbers."""
        stages = self.transcription.linearize(guess.x, guess.u, guess.inner)
        if not stages.finite:
            return False
        try:
            self._condensed = condense(stages, self.problem, self.transcription.imposed)
        except np.linalg.LinAlgError:
            return False
        return True

    def _iterate(self, x: Array, window: dict[str, Array], guess: Trajectory) -> Candidate:
        """One QP about a prepared guess, and its solution expanded."""
        problem, condensed = self.problem, self._condensed
        assert condensed is not None
        d, nu = problem.delay, len(problem.model.inputs)

        # The initial state is the measurement, the first d inputs are those already decided.
        du_decided = self._applied[:d] - guess.u[:d]
        known = np.r_[x - guess.x[0], du_decided.ravel(), 1.0]
        reference = np.column_stack([window[name][1:] for name in problem.outputs])
        program = quadratic_program(condensed, problem, known, reference, guess.u[d:], self._applied[-1])
        v, status = self._optimize(program)

        # x = x_g + dx, u = u_g + du
        dx = condensed.x_known @ known + condensed.x_free @ v
        du = np.vstack([du_decided, v.reshape(-1, nu) * problem.input_scales])
        states = np.vstack([x, guess.x[1:] + dx])
        A, B, c = condensed.inner
        before = (states - guess.x)[:-1, :, None]
        inner = guess.inner + (A @ before + B @ du[:, :, None])[:, :, 0] + c
        trajectory = Trajectory(guess.u + du, states, inner)
        # As linearised: a stiff model's constraints at states that satisfy the dynamics to first order say nothing.
        constraints = (condensed.g_known @ known + condensed.g_free @ v).reshape(problem.horizon, -1)
        return self._assess(trajectory, constraints, status)

    def _optimize(self, program: QuadraticProgram) -> tuple[Array, Status]:
        return solve(program, self.qp)
