"""How far the inputs can move each state: the unit in which surprises, steps and defects are measured."""

from __future__ import annotations

import numpy as np

from rumo.kernel import GATE_STAGES
from rumo.problem import Problem
from rumo.signals import Array


def reach(A: Array, B: Array, problem: Problem, stage: int) -> Array:
    """How far the ranges of all free inputs together move each state until a stage of the horizon (nx,).

    Parameters
    ----------
    A, B : ndarray, shapes (N, nx, nx), (N, nx, nu)
        Maps of the stages, see `numpy.eliminate`.
    problem : Problem
        Ranges, delay and blocks.
    stage : int
        1 to N.

    Notes
    -----
    O(stage nx^2 (nx + nu)), by one sweep back from the stage.
    """
    d, nx, shares = problem.delay, A.shape[1], problem.blocks.matrix[:, 1:]
    to_stage, moved = np.eye(nx), np.zeros((nx, shares.shape[1], B.shape[2]))
    for k in range(stage - 1, d - 1, -1):
        moved += shares[k - d][:, None] * (to_stage @ B[k] * problem.input_scales)[:, None]
        to_stage = to_stage @ A[k]
    return np.abs(moved).sum(axis=(1, 2))


def near_reach(A: Array, B: Array, problem: Problem) -> Array:
    """The same over the stages that the gate looks at."""
    return reach(A, B, problem, min(problem.horizon, problem.delay + GATE_STAGES))
