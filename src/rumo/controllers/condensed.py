"""What controllers with a condensed QP share: linearise, condense, solve, expand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rumo.controllers.condensing import Condensed, condense, quadratic_program
from rumo.controllers.fallback import Trajectory
from rumo.controllers.gate import gate_stages
from rumo.controllers.policy import Candidate, PolicyController
from rumo.controllers.qp import QpOptions, QuadraticProgram, solve
from rumo.signals import Array
from rumo.status import Status

# Steps below this share of the inputs' ranges are rounding.
NO_STEP = 1e-12


class CondensedController(PolicyController):
    """One linearisation and one QP, about whatever trajectory the subclass chooses."""

    qp: QpOptions
    _condensed: Condensed | None = None
    _about: Trajectory
    _last_step = np.nan  # largest |v| of the iteration before

    def _reach(self) -> Array | None:
        return None if self._condensed is None else self._condensed.reach_until(gate_stages(self.problem))

    def _linearize(self, guess: Trajectory) -> bool:
        """Linearise about the guess, eliminate its unknowns, condense; False if that gives no numbers."""
        d, blocks = self.problem.delay, self.problem.blocks
        self._values = blocks.values(guess.u[d:])
        u = np.vstack([guess.u[:d], blocks.matrix @ np.vstack([self._applied[-1], self._values])])
        self._about = replace(guess, u=u)
        stages = self.transcription.linearize(guess.x, u, guess.inner, self._parameters)
        if not stages.finite:
            return False
        try:
            self._condensed = condense(stages, self.problem, self.transcription.imposed)
        except np.linalg.LinAlgError:
            return False
        return True

    def _iterate(self, x: Array, window: dict[str, Array]) -> Candidate:
        """One QP about the guess linearised about, and its solution expanded."""
        problem, condensed, guess = self.problem, self._condensed, self._about
        assert condensed is not None
        d, nu, blocks = problem.delay, len(problem.model.inputs), problem.blocks.matrix

        # The initial state is the measurement, the first d inputs are those already decided.
        known_u = np.vstack([self._applied[:d], blocks @ np.vstack([self._applied[-1], self._values])])
        known = np.r_[x - guess.x[0], (known_u - guess.u).ravel(), 1.0]
        reference = np.column_stack([window[name][1:] for name in problem.outputs])
        program = quadratic_program(condensed, problem, known, reference, self._values, self._applied[-1])
        v, status = self._optimize(program)

        # x = x_g + dx, u = u_g + du
        dx = condensed.x_known @ known + condensed.x_free @ v
        du = known_u - guess.u
        du[d:] += blocks[:, 1:] @ (v.reshape(-1, nu) * problem.input_scales)
        states = np.vstack([x, guess.x[1:] + dx])
        A, B, c = condensed.inner
        before = (states - guess.x)[:-1, :, None]
        inner = guess.inner + (A @ before + B @ du[:, :, None])[:, :, 0] + c
        trajectory = Trajectory(guess.u + du, states, inner)
        # As linearised: a stiff model's constraints at states that satisfy the dynamics to first order say nothing.
        constraints = (condensed.g_known @ known + condensed.g_free @ v).reshape(problem.horizon, -1)
        return self._assess(trajectory, constraints, status, self._diagnostics(condensed, v, status))

    def _diagnostics(self, condensed: Condensed, v: Array, status: Status) -> Array:
        """See `Diagnostics`. The Lagrangian's slope at the guess is H v, since it is none at v."""
        step = float(np.abs(v).max())
        contraction = step / self._last_step if self._last_step > NO_STEP else np.nan
        slope = float(np.abs(condensed.hessian @ v).max()) if status is Status.OPTIMAL else np.nan
        self._last_step = step if np.isfinite(step) else np.nan
        return np.array([condensed.straying, step, contraction, slope])

    def _start_guess(self, x: Array) -> Trajectory:
        self._last_step = np.nan
        return super()._start_guess(x)

    def _attempt(self, x: Array, window: dict[str, Array]) -> tuple[Candidate | None, Status]:
        candidate, status = super()._attempt(x, window)
        if candidate is None:
            self._last_step = np.nan
        return candidate, status

    def _optimize(self, program: QuadraticProgram) -> tuple[Array, Status]:
        return solve(program, self.qp)
