"""What a guess is worth, and what a step from it promises: cost, and what is lacking of what has to hold.

Cost, prices of soft limits included, and a price for what is lacking are an exact penalty function of the nonlinear
problem, as long as the price is above all multipliers. Source: Nocedal and Wright (2006), section 18.5; Byrd, Nocedal
and Waltz (2008) for the price.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.controllers.engines.stagewise import affine
from rumo.controllers.engines.trajectory import Trajectory
from rumo.kernel import SLACK_TOLERANCE
from rumo.signals import Array
from rumo.transcription import Stages, Transcription

SHARE_OF_LACK = 0.1
"""What a step takes off of what is lacking, at least, at the price that it needs."""


NO_PROMISE = 1e-12
"""Promises that are rounding, over the merit."""


@dataclass(frozen=True)
class Worth:
    """The cost of a trajectory, and what is lacking of the dynamics, over reaches, and of hard limits, over scales."""

    cost: float
    lack: float

    def merit(self, price: float) -> float:
        """Both together."""
        return self.cost + price * self.lack


@dataclass(frozen=True)
class Promise:
    """The merit of what is linearised about, by how much less a step promises, and the price of both."""

    merit: float
    less: float
    price: float

    @property
    def promises(self) -> bool:
        """More than rounding."""
        return self.less > NO_PROMISE * abs(self.merit)


def worth_of_guess(
    transcription: Transcription, stages: Stages, c: Array, reach: Array, values: Array, reference: Array
) -> Worth:
    """Of a guess, linearised.

    Parameters
    ----------
    c : ndarray, shape (N, nw)
        Newton's corrections of the intervals' unknowns.
    reach : ndarray, shape (nx,)
        How far inputs move states.
    values : ndarray, shape (nb + 1, nu)
        The input before the first block, and those of the blocks.
    reference : ndarray, shape (N, ny)
        Outputs wanted.
    """
    unit = np.where(reach > 0.0, reach, 1.0)
    defects = float((np.abs(c[:, : len(reach)]) / unit).sum())
    return _worth(transcription, stages.y - reference, stages.G, values, defects)


def promise_of_step(
    transcription: Transcription,
    stages: Stages,
    step: tuple[Trajectory, Trajectory],
    constraints: Array,
    values: Array,
    reference: Array,
) -> Worth:
    """Of a step from one trajectory to another, if all were as linearised, constraints (N, nc): dynamics hold then."""
    old, new = step
    nz = stages.Cx.shape[2] - new.x.shape[1]
    dxz = np.hstack([(new.x - old.x)[1:], (new.inner - old.inner)[:, :nz]])
    error = affine(stages.y, (stages.Cx, dxz), (stages.Cu, new.u - old.u)) - reference
    return _worth(transcription, error, constraints, values, 0.0)


def is_admissible(transcription: Transcription, guess: Trajectory, G: Array, values: Array) -> bool:
    """Whether free inputs, of blocks (nb + 1, nu), are within bounds and move bounds, and hard limits hold by G."""
    problem, numbers, d = transcription.problem, transcription.problem.numbers, transcription.problem.delay
    u, moves, room = guess.u[d:], np.diff(values, axis=0), SLACK_TOLERANCE * problem.input_scales
    lower, upper = problem.block_move_bounds
    within = (u >= numbers.input_lower[d:] - room) & (u <= numbers.input_upper[d:] + room)
    moved = (moves >= lower - room) & (moves <= upper + room)
    broken = transcription.imposed & np.isinf(numbers.l1) & (SLACK_TOLERANCE * problem.constraint_scales < G)
    return bool(within.all() and moved.all() and not broken.any())


def price_for(now: Worth, promised: Worth, price: float) -> float:
    """A price at which a step takes off a share of what is lacking, whatever it costs otherwise; not below `price`."""
    less = now.lack - promised.lack
    if not less > 0.0:
        return price
    needed = (promised.cost - now.cost) / ((1.0 - SHARE_OF_LACK) * less)
    return 2.0 * needed if needed > price else price


def _worth(transcription: Transcription, error: Array, constraints: Array, values: Array, defects: float) -> Worth:
    problem = transcription.problem
    excess = np.where(transcription.imposed, np.maximum(constraints, 0.0), 0.0)
    hard = np.isinf(problem.numbers.l1)
    l1, l2 = np.where(hard, 0.0, problem.numbers.l1), np.where(hard, 0.0, problem.numbers.l2)
    moves = problem.block_move_weights * np.diff(values, axis=0) ** 2
    cost = (problem.output_weights * error**2).sum() + moves.sum() + ((l1 + l2 * excess) * excess).sum()
    return Worth(float(cost), defects + float((excess / problem.constraint_scales)[:, hard].sum()))
