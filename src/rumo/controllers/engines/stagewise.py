"""The QP of a horizon, stage by stage: states stay variables, tied by the dynamics, as in multiple shooting.

An unstable plant costs no digits in it. Source: Bock and Plitt (1984).

Its variables are `q = (v, dxz_1 ... dxz_N)`, nq numbers: v the deviations of the blocks' free inputs from the guess, in
units of their ranges (nb nu); dxz_i those of states and algebraic variables at stage i, in units of how far the inputs
can move them (size,).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rumo.controllers.engines.conditions import SparseProgram, sparse
from rumo.controllers.engines.reach import gate_stage, responses
from rumo.problem import Problem
from rumo.signals import Array
from rumo.transcription import Stages

# A constraint that the inputs' ranges move by less than this share of its scale is not imposed.
NO_INFLUENCE = 1e-10
FARTHEST = 1e4
"""Deviation of a state that is known beforehand, in its unit."""


@dataclass(frozen=True, eq=False)
class Horizon:
    """A linearised horizon, as far as it is known before the measurement.

    Attributes
    ----------
    stages : Stages
        What was linearised.
    A, B, c : ndarray, shapes (N, nw, nx), (N, nw, nu), (N, nw)
        The stages solved for their unknowns, see `eliminate`.
    seen : Seen
        What of q a stage sees.
    unit : ndarray, shape (size,)
        Of dxz.
    Y : ndarray, shape (N, ny, 2 nu + size)
        Derivatives of tracked outputs by what the stage sees.
    hessian, dynamics : sparse array, shapes (nq, nq), (N size, nq)
    rows, row_unit : ndarray, shape (m,)
        Path constraints that are imposed, by position, and their units.
    limits : sparse array, shape (m + limited moves, nq)
        Derivatives of these over their units, and of the blocks' increments over their ranges.
    reach, near_reach : ndarray, shape (nx,)
        How far the inputs move states until the end of the horizon, and until the gate's.
    """

    stages: Stages
    A: Array
    B: Array
    c: Array
    seen: Seen
    unit: Array
    Y: Array
    hessian: Any
    dynamics: Any
    rows: np.ndarray
    row_unit: Array
    limits: Any
    reach: Array
    near_reach: Array

    @property
    def straying(self) -> float:
        """How far the guess is from the dynamics, over the reach of the inputs; not at its last, extrapolated stage."""
        reach, moved = self.reach, self.reach > 0.0
        correction = np.abs(self.c[:-1, : len(reach)]).max(axis=0, initial=0.0)
        return float(np.max(correction[moved] / reach[moved], initial=0.0))


@dataclass(frozen=True, eq=False)
class Seen:
    """What of q a stage sees: the blocks that its input lies between, and its own state, `(v_{b-1}, v_b, dxz_i)`.

    Attributes
    ----------
    at, at_block : ndarray of int, shapes (N, 2 nu + size), (nb, 2 nu)
        Where in q that is, for a stage and for a block's increment.
    U, T : ndarray, shapes (N, nu, 2 nu), (nb, nu, 2 nu)
        Derivatives of the stages' inputs, and of the blocks' increments over their ranges; 0 by what is known, inputs
        of the delay and the one before the first block.
    """

    at: np.ndarray
    at_block: np.ndarray
    U: Array
    T: Array


def seen_by_stages(problem: Problem, size: int) -> Seen:
    """What stages with `size` states and algebraic variables see."""
    N, d, nu, block = problem.horizon, problem.delay, len(problem.model.inputs), problem.blocks.block_of
    nb = len(problem.blocks.lengths)
    at_block = np.maximum(np.arange(-nu, nu) + nu * np.arange(nb)[:, None], 0)
    inputs = np.vstack([np.zeros((d, 2 * nu), dtype=int), at_block[block]])
    states = nb * nu + np.arange(N * size).reshape(N, size)
    shares = np.zeros((N, 2))
    shares[d:] = np.take_along_axis(problem.blocks.matrix, block[:, None] + np.arange(2), axis=1)
    shares[d:][block == 0, 0] = 0.0
    U = np.kron(shares[:, None], np.diag(problem.input_scales))
    T = np.tile(np.hstack([-np.eye(nu), np.eye(nu)]), (nb, 1, 1))
    T[0, :, :nu] = 0.0
    return Seen(np.hstack([inputs, states]), at_block, U, T)


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


def assemble(stages: Stages, problem: Problem, imposed: np.ndarray, damping: float = 0.0) -> Horizon:
    """Put the stages together; `LinAlgError` if M is singular at some stage. O(N) nonzeros. Damped as in `damping`."""
    A, B, c = eliminate(stages)
    (N, _, nx), nu, size = A.shape, B.shape[2], stages.Cx.shape[2]
    A_xz, B_xz, D = A[:, :size], B[:, :size], stages.D
    influence, reach, near_reach = np.zeros((N, D.shape[1])), np.zeros(size), np.zeros(size)
    sweep = responses(np.hstack([A_xz, D @ A_xz]), np.hstack([B_xz, D @ B_xz + stages.E]), problem)
    for k, response in enumerate(sweep):
        influence[k] = np.linalg.norm(response[size:], axis=1)
        reach = np.abs(response[:size]).sum(axis=1)
        near_reach = reach if k < gate_stage(problem) else near_reach
    unit = np.where(near_reach > 0.0, near_reach, 1.0)

    seen = seen_by_stages(problem, size)
    at, at_block, U, T = seen.at, seen.at_block, seen.U, seen.T
    n, nq = T.shape[0] * nu, T.shape[0] * nu + N * size
    Y = np.concatenate([stages.Cu @ U, stages.Cx * unit], axis=2)
    G = np.concatenate([stages.E @ U, D * unit], axis=2)
    Q, R = problem.output_weights, problem.block_move_weights * problem.input_scales**2 + damping
    hessian = sparse(
        (nq, nq),
        (2.0 * Y.transpose(0, 2, 1) @ (Q[:, :, None] * Y), at[:, :, None], at[:, None]),
        (2.0 * T.transpose(0, 2, 1) @ (R[:, :, None] * T), at_block[:, :, None], at_block[:, None]),
    )
    # dxz_i - A dx_{i-1} - B du_{i-1} = c
    here, inputs = at[:, 2 * nu :], at[:, : 2 * nu]
    equation = here[:, :, None] - n
    dynamics = sparse(
        (N * size, nq),
        (np.ones((N, size)), here - n, here),
        (-(A_xz * unit[:nx] / unit[:, None])[1:], equation[1:], here[:-1, None, :nx]),
        (-(B_xz @ U) / unit[:, None], equation, inputs[:, None]),
    )
    # Limits in units of what the inputs' ranges do to them, but of their scale where that is less.
    scales = np.broadcast_to(problem.constraint_scales, influence.shape)
    chosen = imposed & (influence > NO_INFLUENCE * scales)
    row_unit = np.minimum(influence, scales)[chosen]
    m, moves = len(row_unit), T[:, limited_moves(problem)]
    limits = sparse(
        (m + moves[:, :, 0].size, nq),
        (G[chosen] / row_unit[:, None], np.arange(m)[:, None], at[chosen.nonzero()[0]]),
        (moves, m + np.arange(moves[:, :, 0].size).reshape(len(T), -1, 1), at_block[:, None]),
    )
    rows = np.flatnonzero(chosen)
    return Horizon(
        stages, A, B, c, seen, unit, Y, hessian, dynamics, rows, row_unit, limits, reach[:nx], near_reach[:nx]
    )


def quadratic_program(
    horizon: Horizon, problem: Problem, dx: Array, du: Array, reference: Array, values: Array
) -> tuple[SparseProgram, Array]:
    """The QP of equation (implicit-optimization-problem), and the unit of dxz in it.

    For the known deviations of the initial state (nx,) and of inputs (N, nu), wanted outputs (N, ny), and the input
    before the first block and the blocks' guessed ones (nb + 1, nu).
    """
    stages, seen, unit, scale = horizon.stages, horizon.seen, horizon.unit, problem.input_scales
    Q, R = problem.output_weights, problem.block_move_weights * scale**2
    error = affine(stages.y, (stages.Cu, du)) - reference
    moves = np.diff(values, axis=0) / scale
    gradient = np.zeros(horizon.hessian.shape[0])
    np.add.at(gradient, seen.at, 2.0 * ((Q * error)[:, None] @ horizon.Y)[:, 0])
    np.add.at(gradient, seen.at_block, 2.0 * ((R * moves)[:, None] @ seen.T)[:, 0])

    ends = affine(horizon.c, (horizon.B, du))[:, : len(unit)]
    ends[0] += horizon.A[0, : len(unit)] @ dx
    from scipy.sparse import diags_array  # not needed by the compiled backends

    # States that inputs hardly reach are no more than FARTHEST units away.
    grown = np.maximum(1.0, np.abs(ends / unit).max(axis=0) / FARTHEST)
    factors = np.r_[np.ones(moves.size), np.tile(grown, len(du))]
    D, inverse = diags_array(factors), diags_array(1.0 / factors[moves.size :])
    rows, row_unit, limited = horizon.rows, horizon.row_unit, limited_moves(problem)
    l1, l2 = (np.tile(price, len(du))[rows] for price in (problem.numbers.l1, problem.numbers.l2))
    lower, upper = ((bound - values[1:]) / scale for bound in problem.block_bounds)
    move_lower, move_upper = ((bound / scale - moves)[:, limited].ravel() for bound in problem.block_move_bounds)
    inputs, states = np.arange(len(scale)), len(scale) + np.arange(len(unit))
    program = SparseProgram(
        hessian=(D @ horizon.hessian @ D).tocsc(),
        gradient=factors * gradient,
        equations=(inverse @ horizon.dynamics @ D).tocsc(),
        ends=(ends / (unit * grown)).ravel(),
        lower=lower.ravel(),
        upper=upper.ravel(),
        rows=(horizon.limits @ D).tocsc(),
        row_lower=np.r_[np.full(len(rows), -np.inf), move_lower],
        row_upper=np.r_[-affine(stages.G, (stages.E, du)).ravel()[rows] / row_unit, move_upper],
        l1=np.r_[l1 * row_unit, np.full(len(move_lower), np.inf)],
        l2=np.r_[l2 * row_unit**2, np.zeros(len(move_lower))],
        signals=np.r_[np.tile(inputs, len(moves)), np.tile(states, len(du))],
    )
    return program, unit * grown


def limited_moves(problem: Problem) -> np.ndarray:
    """Which inputs' moves have a bound (nu,)."""
    return np.isfinite(problem.move_lower) | np.isfinite(problem.move_upper)


def affine(constant: Array, *terms: tuple[Array, Array]) -> Array:
    """Stage by stage, a constant (N, m) and matrices (N, m, k) times vectors (N, k)."""
    return constant + sum((matrix @ vector[:, :, None])[:, :, 0] for matrix, vector in terms)
