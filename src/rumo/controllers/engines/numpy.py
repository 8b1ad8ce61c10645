"""The real-time iteration in NumPy, line by line the paper: slow, readable, and the oracle of the core.

Prepare: linearise, eliminate, assemble. Solve: complete the quadratic program. Expand: from its solution to a plan.
States stay variables of the program, tied by the dynamics, so that an unstable plant costs no digits.
Throughout, deviations are from the guess: `dx_i = x_i - x_g,i`, `du_i = u_i - u_g,i`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from time import perf_counter

import numpy as np

from rumo.controllers.arguments import tracked
from rumo.controllers.engines.base import Candidate, Method
from rumo.controllers.engines.conditions import SparseProgram
from rumo.controllers.engines.qp import Solution, solve
from rumo.controllers.engines.settle import SETTLED, Settling, error_left
from rumo.controllers.engines.stagewise import Horizon, affine, assemble, quadratic_program
from rumo.controllers.engines.trajectory import Trajectory
from rumo.controllers.settings import QpOptions, Settings
from rumo.shift import Shift
from rumo.signals import Array
from rumo.status import Status
from rumo.transcription import Transcription

# Steps below this share of the inputs' ranges are rounding.
NO_STEP = 1e-12
# What inputs may lose of a step added to a guess, over their ranges, or over the longest step where that is longer.
MOST_LOST = 1e-6

Optimize = Callable[[SparseProgram, QpOptions], Solution]


class NumpyRti(Method):
    """One linearisation and one QP a step, or as many as the settings say; `optimize` solves a QP.

    Attributes
    ----------
    about : Trajectory
        What the last linearisation was about.
    wary : bool
        Whether a sample's first iteration is not enough: its measurement is a surprise, or later iterations have moved
        inputs at the one before.
    moved_later : float
        Largest change of an input over its range in later iterations since a sample began.
    """

    def __init__(self, transcription: Transcription, settings: Settings, optimize: Optimize = solve) -> None:
        self.transcription = transcription
        self.settings = settings
        self._optimize = optimize
        self._shift = Shift(transcription)
        self.reset()

    def configure(self, settings: Settings) -> None:
        """See `Method.configure`."""
        self.settings = settings

    def reset(self) -> None:
        """See `Method.reset`."""
        self._horizon: Horizon | None = None
        self._reach = np.zeros(len(self.transcription.problem.model.states))
        self.wary, self.moved_later = False, 0.0
        self.begin()

    def begin_sample(self, surprised: bool) -> None:
        """See `Method.begin_sample`."""
        self.wary, self.moved_later = surprised or self.moved_later > SETTLED, 0.0

    def begin(self) -> None:
        """Iterations begin: there is no step to compare the next one with."""
        self.step_size = np.nan

    @property
    def restarts(self) -> bool:
        """See `Method.restarts`."""
        return np.isfinite(self.settings.trusted_step)

    @property
    def is_over(self) -> bool:
        """Whether the time for the step is."""
        return perf_counter() > self.end

    @property
    def horizon(self) -> Horizon:
        """What was linearised last."""
        assert self._horizon is not None
        return self._horizon

    @property
    def reach_known(self) -> Array:
        """How far the inputs move states (nx,), where that was last known."""
        return self._reach

    def reach(self) -> Array | None:
        """See `Method.reach`."""
        return None if self._horizon is None else self._horizon.near_reach

    def dependence(self, plan: Trajectory) -> Array:
        """See `Method.dependence`: as linearised last."""
        return super().dependence(plan) if self._horizon is None else self._horizon.A[0, : plan.x.shape[1]]

    def prepare(self, guess: Trajectory, applied: Array) -> float | None:
        """Linearise about the guess, eliminate its unknowns, assemble the QP."""
        if not self.linearize(guess, applied):
            return None
        return 0.0 if self.restarts else self.horizon.straying

    def solve(self, x: Array, window: Mapping[str, Array], guess: Trajectory, applied: Array) -> Candidate | None:
        """Complete the QP with measurement and reference, solve it, expand; again, if that is not to be trusted."""
        self.begin()
        if not self.restarts:
            return self._repeat(self.iterate(x, window, applied), x, window, applied)
        settling = Settling(self, x, window, applied)
        if guess.still and not self.is_over and not settling.start(guess):
            return None
        candidate = self.iterate(x, window, applied)
        done = not self.is_usable(candidate) or settling.is_settled(candidate)
        return candidate if done else settling.settle(candidate)

    def is_usable(self, candidate: Candidate) -> bool:
        """Whether it is solved and finite, and no hard constraint is exceeded, as one may be that no input moves."""
        return candidate.usable and not self.broken(candidate).any()

    def _repeat(self, candidate: Candidate, x: Array, window: Mapping[str, Array], applied: Array) -> Candidate:
        """Iterations with full steps, as many as the settings say."""
        for _ in range(self.settings.sqp_iterations - 1):
            if not candidate.status.solved or self.change(candidate.trajectory) < self.settings.tolerance:
                break
            if not self.linearize(candidate.trajectory, applied):
                break
            better = self.iterate(x, window, applied)
            if not better.status.solved:
                break
            candidate = better
        return candidate

    def linearize(self, guess: Trajectory, applied: Array, damping: float = 0.0) -> bool:
        """Linearise about the guess, eliminate its unknowns, assemble the QP; False if that gives no numbers."""
        problem, transcription = self.transcription.problem, self.transcription
        d, blocks = problem.delay, problem.blocks
        self._values = blocks.values(guess.u[d:])
        u = np.vstack([guess.u[:d], blocks.matrix @ np.vstack([applied[-1], self._values])])
        self.about = replace(guess, u=u)
        stages = transcription.linearize(guess.x, u, guess.inner, problem.parameters)
        if not stages.finite:
            return False
        try:
            self._horizon = assemble(stages, problem, transcription.imposed, damping)
        except np.linalg.LinAlgError:
            return False
        self._reach = self._horizon.reach
        return True

    def iterate(self, x: Array, window: Mapping[str, Array], applied: Array) -> Candidate:
        """One QP about the guess linearised about, and its solution expanded; nothing if the time is over."""
        problem, guess = self.transcription.problem, self.about
        if self.is_over:
            return _nothing(guess, len(problem.constraints))
        horizon = self.horizon
        d, nu, nx, blocks = problem.delay, len(problem.model.inputs), len(x), problem.blocks.matrix

        # The initial state is the measurement, the first d inputs are those already decided.
        dx, values = x - guess.x[0], np.vstack([applied[-1], self._values])
        du = np.vstack([applied[:d], blocks @ values]) - guess.u
        program, unit = quadratic_program(horizon, problem, dx, du, tracked(problem, window)[1:], values)
        solution = self._optimize(program, self.settings.qp)
        v, dxz = np.split(solution.q, [self._values.size])

        # x = x_g + dx, u = u_g + du
        du[d:] += blocks[:, 1:] @ (v.reshape(-1, nu) * problem.input_scales)
        dxz = dxz.reshape(len(du), -1) * unit
        before = np.vstack([dx, dxz[:-1, :nx]])
        states = np.vstack([x, guess.x[1:] + dxz[:, :nx]])
        inner = guess.inner + affine(horizon.c, (horizon.A, before), (horizon.B, du))[:, nx:]
        # As linearised: a stiff model's constraints at states that satisfy the dynamics to first order say nothing.
        stages = horizon.stages
        constraints = affine(stages.G, (stages.D, dxz), (stages.E, du))
        trajectory = Trajectory(guess.u + du, states, inner)
        diagnostics = self._diagnostics(v, solution.residual)
        lost = np.abs(trajectory.u - guess.u - du)[d:] / problem.input_scales
        ill = solution.status.applicable and lost.max() > MOST_LOST * max(1.0, self.step_size)
        return Candidate(trajectory, constraints, Status.ILL_CONDITIONED if ill else solution.status, diagnostics)

    def advance(self, x: Array, window: Mapping[str, Array], applied: Array) -> bool:
        """Iterate on the state that is expected, and what was wanted at the last sample, one sample later."""
        i, share = self._shift.stages, np.minimum(self._shift.shares, 1.0)
        expected = {name: r[i] + share * (r[i + 1] - r[i]) for name, r in window.items()}
        for _ in range(self.settings.preparation_iterations):
            candidate = self.iterate(x, expected, applied)
            if not candidate.status.solved:
                break
            done = self.change(candidate.trajectory) < self.settings.tolerance
            if not self.linearize(candidate.trajectory, applied):
                return False
            if done:
                break
        return True

    def _diagnostics(self, v: Array, kkt_residual: float) -> Array:
        """See `Diagnostics`."""
        step = float(np.abs(v).max())
        before = self.step_size if self.step_size > NO_STEP else np.nan
        self.step_size = step if np.isfinite(step) else np.nan
        return np.array([self.horizon.straying, step, step / before, kkt_residual, error_left(before, step)])

    def change(self, new: Trajectory) -> float:
        """Largest change of an input over its range, or of a state over the reach of the inputs."""
        old, reach = self.about, self.horizon.reach
        inputs = np.abs(new.u - old.u).max(axis=0) / self.transcription.problem.input_scales
        states = np.abs(new.x - old.x).max(axis=0)[reach > 0.0] / reach[reach > 0.0]
        return float(max(inputs.max(), states.max(initial=0.0)))


def _nothing(guess: Trajectory, constraints: int) -> Candidate:
    """What there is where the time was over before a QP."""
    unknown = replace(guess, u=np.full_like(guess.u, np.nan))
    return Candidate(unknown, np.full((len(guess.u), constraints), np.nan), Status.BUDGET_EXCEEDED)
