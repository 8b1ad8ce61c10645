"""From a linearised horizon to a small dense quadratic program in the free inputs. Arrays only.

Throughout, deviations are from the guess: `dx_i = x_i - x_g,i`, `du_i = u_i - u_g,i`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.controllers.qp import QuadraticProgram
from rumo.problem import Problem
from rumo.signals import Array
from rumo.transcription import Stages

# A constraint whose gradient, over the inputs' ranges, is less than this share of its scale is not imposed.
NO_INFLUENCE = 1e-10


@dataclass(frozen=True)
class Condensed:
    """Affine maps from what is known only at feedback, and from the free inputs, to all that matters.

    With `k = (dx_0, du_0 ... du_{N-1}, 1)` known and `v` the deviations of the free inputs in units of their range, a
    quantity is `known @ k + free @ v`; `du` in k is what the inputs are known to deviate by, whatever v is.

    Attributes
    ----------
    x_known, x_free : ndarray, shapes (N, nx, nk), (N, nx, n)
        State deviations.
    y_known, y_free : ndarray, shapes (N ny, nk), (N ny, n)
        Tracked outputs, stage by stage.
    g_known, g_free : ndarray, shapes (N nc, nk), (N nc, n)
        Path constraints, stage by stage.
    increments : ndarray, shape (n, n)
        Change of the input increments.
    hessian : ndarray, shape (n, n)
        Gauss-Newton Hessian of the cost.
    rows : ndarray of int
        Path constraints that are imposed: those that a free input can influence.
    correction : ndarray, shape (N, nx)
        Newton step of each stage onto the dynamics.
    inner : tuple of ndarray, shapes (N, nw - nx, nx), (N, nw - nx, nu), (N, nw - nx)
        The intervals' other unknowns over (dx_{i-1}, du_{i-1}, 1).
    """

    x_known: Array
    x_free: Array
    y_known: Array
    y_free: Array
    g_known: Array
    g_free: Array
    increments: Array
    hessian: Array
    rows: np.ndarray
    correction: Array
    inner: tuple[Array, Array, Array]

    @property
    def reach(self) -> Array:
        """How far the ranges of all free inputs together move each state until the end of the horizon (nx,)."""
        return self.reach_until(len(self.x_free))

    def reach_until(self, stage: int) -> Array:
        """The same until a stage of the horizon."""
        return np.abs(self.x_free[stage - 1]).sum(axis=1)

    @property
    def straying(self) -> float:
        """How far the guess is from satisfying the dynamics, over the reach of the inputs; but not at its last stage.

        There it is an extrapolation.
        """
        reach = self.reach
        moved = reach > 0.0
        return float(np.max(np.abs(self.correction[:-1]).max(axis=0, initial=0.0)[moved] / reach[moved], initial=0.0))


def eliminate(stages: Stages) -> tuple[Array, Array, Array]:
    """Solve each implicit stage for its unknowns: `dw_i = A dx_{i-1} + B du_{i-1} + c`, one LU per stage.

    For implicit Euler, `M = I - A1` and the unknowns are the new state: equation
    (implicit-linearized-virtual-displacement-dynamics) of the paper,
    `(I - A1) dx_i = A0 dx_{i-1} + B du_{i-1} + (F_g - x_g)`.

    Returns
    -------
    A, B, c : ndarray, shapes (N, nw, nx), (N, nw, nu), (N, nw)
        The explicit form of every stage.

    Raises
    ------
    numpy.linalg.LinAlgError
        If M is singular at some stage.
    """
    nx = stages.A0.shape[2]
    right = np.concatenate([stages.A0, stages.B, stages.defect[:, :, None]], axis=2)
    solved = np.linalg.solve(stages.M, right)
    return solved[:, :, :nx], solved[:, :, nx:-1], solved[:, :, -1]


def condense(stages: Stages, problem: Problem, imposed: np.ndarray) -> Condensed:
    """Express states, outputs and constraints by the known quantities and the free inputs.

    Parameters
    ----------
    stages : Stages
        The linearised horizon.
    problem : Problem
        Weights, delay and ranges.
    imposed : ndarray of bool, shape (N, nc)
        Constraints that can be influenced by structure.

    Raises
    ------
    numpy.linalg.LinAlgError
        If a stage cannot be solved for its new state.

    Notes
    -----
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
    return Condensed(x_known, x_free, y_known, y_free, g_known, g_free, increments, hessian, rows, c[:, :nx], inner)


def quadratic_program(
    condensed: Condensed, problem: Problem, known: Array, reference: Array, u_guess: Array, applied: Array
) -> QuadraticProgram:
    """The QP of equation (implicit-optimization-problem) in the free inputs.

    Parameters
    ----------
    condensed : Condensed
        The prepared horizon.
    problem : Problem
        Weights and limits.
    known : ndarray, shape (nk,)
        `(dx_0, du_0 ... du_{N-1}, 1)`.
    reference : ndarray, shape (N, ny)
        Wanted outputs of stages 1 to N.
    u_guess : ndarray, shape (nb, nu)
        Guess of the free inputs: those of the blocks.
    applied : ndarray, shape (nu,)
        Input before the first free one.
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
    move_lower, move_upper = (bound.ravel()[limited] for bound in problem.block_move_bounds)
    return QuadraticProgram(
        hessian=condensed.hessian,
        gradient=gradient,
        lower=((problem.input_lower - u_guess) / scale).ravel(),
        upper=((problem.input_upper - u_guess) / scale).ravel(),
        rows=np.vstack([condensed.g_free[rows], condensed.increments[limited]]),
        row_lower=np.r_[np.full(len(rows), -np.inf), move_lower - moves[limited]],
        row_upper=np.r_[-condensed.g_known[rows] @ known, move_upper - moves[limited]],
        l1=np.r_[[np.inf if item is None else item.l1 for item in penalties], np.full(len(limited), np.inf)],
        l2=np.r_[[0.0 if item is None else item.l2 for item in penalties], np.zeros(len(limited))],
    )
