"""The real-time iteration, line by line the paper: one linearisation and one QP per sample."""

from __future__ import annotations

import numpy as np

from rumo.checks import whole_number
from rumo.controllers.base import Candidate, Controller
from rumo.controllers.condensing import Condensed, condense, quadratic_program
from rumo.controllers.fallback import Trajectory
from rumo.controllers.qp import QpOptions, solve
from rumo.discretization import Discretization
from rumo.problem import Problem
from rumo.signals import Array

# A guess farther from the dynamics than this share of what the inputs can do is not linearised about.
STRAYED = 0.03


class RealTimeIteration(Controller):
    """Real-time iteration on an implicit discretisation (Diehl, 2001; Wagner and Normey-Rico).

    Parameters
    ----------
    problem : Problem
        What to solve.
    discretization : Discretization, optional
        Implicit Euler if not given.
    sqp_iterations : int
        Linearisations and QPs per step; 1 is the real-time iteration, more is sequential quadratic
        programming with full steps.
    tolerance : float
        With more than one iteration, stop when no input changes by more than this share of its range, and no state by
        more than this share of how far the inputs can move it.
    qp : QpOptions, optional
        Limits and accuracy of the QP solver.
    """

    name = "rti"

    def __init__(
        self,
        problem: Problem,
        discretization: Discretization | None = None,
        *,
        sqp_iterations: int = 1,
        tolerance: float = 1e-9,
        qp: QpOptions | None = None,
    ) -> None:
        self.sqp_iterations = whole_number(sqp_iterations, "sqp_iterations", 1)
        self.tolerance = tolerance
        self.qp = qp or QpOptions()
        self._condensed: Condensed | None = None
        super().__init__(problem, discretization)

    def _prepare(self, guess: Trajectory) -> bool:
        # A plan made from a wild measurement would keep misleading its successors.
        if not self._linearize(guess) or self._condensed is None:
            return False
        return guess.resting or self._condensed.straying < STRAYED

    def _linearize(self, guess: Trajectory) -> bool:
        """Linearise about the guess, eliminate the implicit states, condense; False if that gives no numbers."""
        stages = self.transcription.linearize(guess.x, guess.u)
        if not stages.finite:
            return False
        try:
            self._condensed = condense(stages, self.problem, self.transcription.imposed)
        except np.linalg.LinAlgError:
            return False
        return True

    def _solve(self, x: Array, window: dict[str, Array], guess: Trajectory) -> Candidate | None:
        candidate = self._iterate(x, window, guess)
        for _ in range(self.sqp_iterations - 1):
            if not candidate.status.solved or self._change(candidate.trajectory, guess) < self.tolerance:
                break
            guess = candidate.trajectory
            if not self._linearize(guess):
                break
            better = self._iterate(x, window, guess)
            if not better.status.solved:
                break
            candidate = better
        return candidate

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
        v, status = solve(program, self.qp)

        # x = x_g + dx, u = u_g + du
        dx = condensed.x_known @ known + condensed.x_free @ v
        du = np.vstack([du_decided, v.reshape(-1, nu) * problem.input_scales])
        trajectory = Trajectory(guess.u + du, np.vstack([x, guess.x[1:] + dx]))
        # As linearised: a stiff model's constraints at states that satisfy the dynamics to first order say nothing.
        constraints = (condensed.g_known @ known + condensed.g_free @ v).reshape(problem.horizon, -1)
        return self._assess(trajectory, constraints, status)

    def _change(self, new: Trajectory, old: Trajectory) -> float:
        """Largest change of an input over its range, or of a state over the reach of the inputs."""
        assert self._condensed is not None
        reach = self._condensed.reach
        inputs = np.abs(new.u - old.u).max(axis=0) / self.problem.input_scales
        states = np.abs(new.x - old.x).max(axis=0)[reach > 0.0] / reach[reach > 0.0]
        return float(max(inputs.max(), states.max(initial=0.0)))
