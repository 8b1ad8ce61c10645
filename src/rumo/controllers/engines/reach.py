"""How far the inputs can move each state: the unit in which surprises, steps and defects are measured."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from rumo.kernel import GATE_STAGES
from rumo.problem import Problem
from rumo.signals import Array


def responses(A: Array, B: Array, problem: Problem) -> Iterator[Array]:
    """What the range of each free input does to the rows of stages 1 to N (rows, n), one stage after the other.

    Parameters
    ----------
    A, B : ndarray, shapes (N, rows, nx), (N, rows, nu)
        Maps of the stages, see `stagewise.eliminate`; rows after the first nx are of other variables.
    problem : Problem
        Ranges, delay and blocks.
    """
    nx, shares = A.shape[2], problem.blocks.matrix[:, 1:]
    response = np.zeros((A.shape[1], shares.shape[1] * B.shape[2]))
    for k in range(len(A)):
        response = A[k] @ response[:nx]
        if k >= problem.delay:
            share = shares[k - problem.delay]
            response += (share[:, None] * (B[k] * problem.input_scales)[:, None]).reshape(response.shape)
        yield response


def gate_stage(problem: Problem) -> int:
    """The last stage that the gate looks at."""
    return min(problem.horizon, problem.delay + GATE_STAGES)


def near_reach(A: Array, B: Array, problem: Problem) -> Array:
    """How far the ranges of all free inputs together move each state (nx,) over the stages that the gate looks at."""
    *_, last = islice(responses(A, B, problem), gate_stage(problem))
    return np.abs(last).sum(axis=1)
