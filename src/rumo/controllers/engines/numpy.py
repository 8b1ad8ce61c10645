"""The real-time iteration in NumPy, line by line the paper: slow, readable, and the oracle of the core.

Prepare: linearise, eliminate, condense. Solve: complete the quadratic program. Expand: from its solution to a plan.
Throughout, deviations are from the guess: `dx_i = x_i - x_g,i`, `du_i = u_i - u_g,i`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rumo.controllers.arguments import tracked
from rumo.controllers.engines.base import Candidate, Method
from rumo.controllers.engines.qp import QuadraticProgram, solve
from rumo.controllers.engines.reach import near_reach, reach
from rumo.controllers.engines.trajectory import Trajectory
from rumo.controllers.settings import QpOptions, Settings
from rumo.problem import Problem
from rumo.shift import Shift
from rumo.signals import Array
from rumo.status import Status
from rumo.transcription import Stages, Transcription

# A constraint that the inputs' ranges move by less than this share of its scale is not imposed.
NO_INFLUENCE = 1e-10
# Steps below this share of the inputs' ranges are rounding.
NO_STEP = 1e-12

Optimize = Callable[[QuadraticProgram, QpOptions], tuple[Array, Status]]


class NumpyRti(Method):
    """One linearisation and one QP a step, or as many as the settings say; `optimize` solves a QP.

    Attributes
    ----------
    about : Trajectory
        What the last linearisation was about.
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
        self._condensed: Condensed | None = None
        self._last_step = np.nan  # largest |v| of the iteration before

    def missed(self) -> None:
        """See `Method.missed`."""
        self._last_step = np.nan

    def reach(self) -> Array | None:
        """See `Method.reach`."""
        return None if self._condensed is None else self._condensed.near_reach

    def prepare(self, guess: Trajectory, applied: Array) -> float | None:
        """Linearise about the guess, eliminate its unknowns, condense."""
        if guess.resting:
            self._last_step = np.nan
        return self._condensed.straying if self.linearize(guess, applied) and self._condensed else None

    def solve(self, x: Array, window: Mapping[str, Array], guess: Trajectory, applied: Array) -> Candidate | None:
        """Complete the QP with measurement and reference, solve it, expand; again, if the settings say so."""
        candidate = self.iterate(x, window, applied)
        for _ in range(self.settings.sqp_iterations - 1):
            if not candidate.status.solved or self._change(candidate.trajectory) < self.settings.tolerance:
                break
            if not self.linearize(candidate.trajectory, applied):
                break
            better = self.iterate(x, window, applied)
            if not better.status.solved:
                break
            candidate = better
        return candidate

    def linearize(self, guess: Trajectory, applied: Array) -> bool:
        """Linearise about the guess, eliminate its unknowns, condense; False if that gives no numbers."""
        problem, transcription = self.transcription.problem, self.transcription
        d, blocks = problem.delay, problem.blocks
        self._values = blocks.values(guess.u[d:])
        u = np.vstack([guess.u[:d], blocks.matrix @ np.vstack([applied[-1], self._values])])
        self.about = replace(guess, u=u)
        stages = transcription.linearize(guess.x, u, guess.inner, problem.parameters)
        if not stages.finite:
            return False
        try:
            self._condensed = condense(stages, problem, transcription.imposed)
        except np.linalg.LinAlgError:
            return False
        return True

    def iterate(self, x: Array, window: Mapping[str, Array], applied: Array) -> Candidate:
        """One QP about the guess linearised about, and its solution expanded."""
        problem, condensed, guess = self.transcription.problem, self._condensed, self.about
        assert condensed is not None
        d, nu, blocks = problem.delay, len(problem.model.inputs), problem.blocks.matrix

        # The initial state is the measurement, the first d inputs are those already decided.
        known_u = np.vstack([applied[:d], blocks @ np.vstack([applied[-1], self._values])])
        known = np.r_[x - guess.x[0], (known_u - guess.u).ravel(), 1.0]
        reference = tracked(problem, window)[1:]
        program = quadratic_program(condensed, problem, known, reference, self._values, applied[-1])
        v, status = self._optimize(program, self.settings.qp)

        # x = x_g + dx, u = u_g + du
        dx = condensed.x_known @ known + condensed.x_free @ v
        du = known_u - guess.u
        du[d:] += blocks[:, 1:] @ (v.reshape(-1, nu) * problem.input_scales)
        states = np.vstack([x, guess.x[1:] + dx])
        A, B, c = condensed.inner
        before = (states - guess.x)[:-1, :, None]
        inner = guess.inner + (A @ before + B @ du[:, :, None])[:, :, 0] + c
        # As linearised: a stiff model's constraints at states that satisfy the dynamics to first order say nothing.
        constraints = (condensed.g_known @ known + condensed.g_free @ v).reshape(problem.horizon, -1)
        trajectory = Trajectory(guess.u + du, states, inner)
        return Candidate(trajectory, constraints, status, self._diagnostics(condensed, v, status))

    def advance(self, x: Array, window: Mapping[str, Array], applied: Array) -> bool:
        """Iterate on the state that is expected, and what was wanted at the last sample, one sample later."""
        i, share = self._shift.stages, np.minimum(self._shift.shares, 1.0)
        expected = {name: r[i] + share * (r[i + 1] - r[i]) for name, r in window.items()}
        for _ in range(self.settings.preparation_iterations):
            candidate = self.iterate(x, expected, applied)
            if not candidate.status.solved:
                break
            done = self._change(candidate.trajectory) < self.settings.tolerance
            if not self.linearize(candidate.trajectory, applied):
                return False
            if done:
                break
        return True

    def _diagnostics(self, condensed: Condensed, v: Array, status: Status) -> Array:
        """See `Diagnostics`. The Lagrangian's slope at the guess is H v, since it is none at v."""
        step = float(np.abs(v).max())
        contraction = step / self._last_step if self._last_step > NO_STEP else np.nan
        slope = float(np.abs(condensed.hessian @ v).max()) if status is Status.OPTIMAL else np.nan
        self._last_step = step if np.isfinite(step) else np.nan
        return np.array([condensed.straying, step, contraction, slope])

    def _change(self, new: Trajectory) -> float:
        """Largest change of an input over its range, or of a state over the reach of the inputs."""
        assert self._condensed is not None
        old, reach = self.about, self._condensed.reach
        inputs = np.abs(new.u - old.u).max(axis=0) / self.transcription.problem.input_scales
        states = np.abs(new.x - old.x).max(axis=0)[reach > 0.0] / reach[reach > 0.0]
        return float(max(inputs.max(), states.max(initial=0.0)))


@dataclass(frozen=True, eq=False)
class Condensed:
    """Affine maps to states, outputs and constraints: `known @ k + free @ v`.

    `k = (dx_0, du_0 ... du_{N-1}, 1)` is known at feedback, with du what the inputs are known to deviate by whatever v
    is; v are the deviations of the n free inputs in units of their range. States (N, nx, .), outputs y (N ny, .) and
    path constraints g (N nc, .), stage by stage; `increments` (n, n) of the inputs; `rows` of g that a free input can
    influence; `correction` (N, nx), the Newton step of each stage onto the dynamics; `inner`, the intervals' other
    unknowns over (dx_{i-1}, du_{i-1}, 1); `reach` of the inputs until the end of the horizon, and of the gate's.
    """

    x_known: Array
    y_known: Array
    g_known: Array
    x_free: Array
    y_free: Array
    g_free: Array
    increments: Array
    hessian: Array
    rows: np.ndarray
    correction: Array
    inner: tuple[Array, Array, Array]
    reach: Array
    near_reach: Array

    @property
    def straying(self) -> float:
        """How far the guess is from the dynamics, over the reach of the inputs; not at its last, extrapolated stage."""
        reach, moved = self.reach, self.reach > 0.0
        return float(np.max(np.abs(self.correction[:-1]).max(axis=0, initial=0.0)[moved] / reach[moved], initial=0.0))


def eliminate(stages: Stages) -> tuple[Array, Array, Array]:
    """Solve each implicit stage for its unknowns: `dw_i = A dx_{i-1} + B du_{i-1} + c`, one LU per stage.

    For implicit Euler, `M = I - A1` and the unknowns are the new state: equation
    (implicit-linearized-virtual-displacement-dynamics) of the paper,
    `(I - A1) dx_i = A0 dx_{i-1} + B du_{i-1} + (F_g - x_g)`. Raises `LinAlgError` if M is singular at some stage.
    """
    nx = stages.A0.shape[2]
    right = np.concatenate([stages.A0, stages.B, stages.defect[:, :, None]], axis=2)
    solved = np.linalg.solve(stages.M, right)
    return solved[:, :, :nx], solved[:, :, nx:-1], solved[:, :, -1]


def condense(stages: Stages, problem: Problem, imposed: np.ndarray) -> Condensed:
    """Express states, outputs and constraints by the known quantities and the free inputs; `LinAlgError` if singular.

    O(N^2 nx nu) for the responses, O(N^3 nu^2 ny) for the Hessian. Source: Frison (2015), ch. 6.
    """
    A, B, c = eliminate(stages)
    N, nx, nu = len(A), A.shape[2], B.shape[2]
    size = nx + len(problem.model.algebraic)
    # Response of (dx_i, dz_i) to (dx_0, du_0 ... du_{N-1}, 1), by forward substitution.
    inputs = [slice(nx + k * nu, nx + (k + 1) * nu) for k in range(N)]
    response = np.zeros((N, size, nx + N * nu + 1))
    previous = np.eye(nx, nx + N * nu + 1)
    for k in range(N):
        response[k] = A[k, :size] @ previous
        response[k][:, inputs[k]] += B[k, :size]
        response[k][:, -1] += c[k, :size]
        previous = response[k, :nx]

    y = stages.Cx @ response
    g = stages.D @ response
    for k in range(N):
        y[k][:, inputs[k]] += stages.Cu[k]
        g[k][:, inputs[k]] += stages.E[k]
    y[:, :, -1] += stages.y
    g[:, :, -1] += stages.G

    first_free = nx + problem.delay * nu
    blocks = np.kron(problem.blocks.matrix[:, 1:], np.diag(problem.input_scales))

    def split(array: Array) -> tuple[Array, Array]:
        return array, array[..., first_free:-1] @ blocks

    x_known, x_free = split(response[:, :nx])
    y_known, y_free = split(y.reshape(-1, y.shape[2]))
    g_known, g_free = split(g.reshape(-1, g.shape[2]))
    n = blocks.shape[1]
    increments = (np.eye(n) - np.eye(n, k=-nu)) * np.tile(problem.input_scales, n // nu)

    Q = problem.output_weights.ravel()
    R = problem.block_move_weights.ravel()
    hessian = 2.0 * (y_free.T @ (Q[:, None] * y_free) + increments.T @ (R[:, None] * increments))
    influence = np.linalg.norm(g_free, axis=1).reshape(N, -1) / problem.constraint_scales
    rows = np.flatnonzero(imposed & (influence > NO_INFLUENCE))
    inner = A[:, nx:], B[:, nx:], c[:, nx:]
    reached = reach(A[:, :nx], B[:, :nx], problem, N), near_reach(A[:, :nx], B[:, :nx], problem)
    known, free = (x_known, y_known, g_known), (x_free, y_free, g_free)
    return Condensed(*known, *free, increments, hessian, rows, c[:, :nx], inner, *reached)


def quadratic_program(
    condensed: Condensed, problem: Problem, known: Array, reference: Array, u_guess: Array, applied: Array
) -> QuadraticProgram:
    """The QP of equation (implicit-optimization-problem) in the free inputs.

    For known quantities (nk,), wanted outputs (N, ny), the blocks' guessed inputs (nb, nu) and the one before (nu,).
    """
    Q = problem.output_weights.ravel()
    R = problem.block_move_weights.ravel()
    error = condensed.y_known @ known - reference.ravel()
    moves = np.diff(u_guess, axis=0, prepend=applied[None]).ravel()
    gradient = 2.0 * (condensed.y_free.T @ (Q * error) + condensed.increments.T @ (R * moves))

    n_free, scale = len(u_guess), problem.input_scales
    rows = condensed.rows
    constraints = [problem.constraints[row % len(problem.constraints)] for row in rows]
    penalties = [constraint.penalty for constraint in constraints]
    moved = np.isfinite(problem.move_lower) | np.isfinite(problem.move_upper)
    limited = np.flatnonzero(np.tile(moved, n_free))
    lower, upper = problem.block_bounds
    move_lower, move_upper = (bound.ravel()[limited] for bound in problem.block_move_bounds)
    return QuadraticProgram(
        hessian=condensed.hessian,
        gradient=gradient,
        lower=((lower - u_guess) / scale).ravel(),
        upper=((upper - u_guess) / scale).ravel(),
        rows=np.vstack([condensed.g_free[rows], condensed.increments[limited]]),
        row_lower=np.r_[np.full(len(rows), -np.inf), move_lower - moves[limited]],
        row_upper=np.r_[-condensed.g_known[rows] @ known, move_upper - moves[limited]],
        l1=np.r_[[np.inf if item is None else item.l1 for item in penalties], np.full(len(limited), np.inf)],
        l2=np.r_[[0.0 if item is None else item.l2 for item in penalties], np.zeros(len(limited))],
    )
