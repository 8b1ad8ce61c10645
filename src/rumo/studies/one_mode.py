"""What schemes make of a single mode: how it decays, and how it follows what drives it."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from rumo.discretization.stability import growth
from rumo.model import Model, Parameter
from rumo.problem import Problem
from rumo.registry import DISCRETIZATIONS
from rumo.signals import Array
from rumo.terms import Weight
from rumo.transcription import Transcription

BEGIN, LENGTH = 0.3, 1.0
"""Phase at the beginning [rad], and length of what is integrated [s]."""


def decays(schemes: Sequence[str], products: Array) -> dict[str, Array]:
    """What is left of a decaying mode after one step, |R(lambda h)|, for products of its rate lambda and the step h."""
    factors = {name: growth(DISCRETIZATIONS[name](), products.astype(complex).tolist()) for name in schemes}
    return {name: np.abs(factor) for name, factor in factors.items()}


def follower() -> Model:
    """A state that follows a sine at a given rate, starting on it.

    `y' = rate (sin(t) - y) + cos(t) + push`, whose solution without push is sin(t), however fast it is. Source:
    Prothero and Robinson (1974).
    """
    return Model(
        states={"y": "1", "phase": "rad"},
        inputs={"push": "1/s"},
        dynamics=lambda x, u, p: {"y": p.rate * (ca.sin(x.phase) - x.y) + ca.cos(x.phase) + u.push, "phase": 1.0},
        parameters={"rate": Parameter("1/s", 1.0)},
        name="follower",
    )


def following_errors(schemes: Sequence[str], rate: float, intervals: Sequence[int]) -> dict[str, Array]:
    """Largest error of the follower within one second, for numbers of intervals in it; shape (n,) for each scheme."""
    errors: dict[str, Array] = {}
    for name in schemes:
        found: list[float] = []
        for N in intervals:
            problem = Problem(
                follower(),
                horizon=N,
                sampling_time=LENGTH / N,
                track={"y": Weight(1.0)},
                moves={"push": Weight(1.0)},
                parameters={"rate": rate},
            )
            transcription = Transcription(problem, DISCRETIZATIONS[name]())
            x, worst = np.array([np.sin(BEGIN), BEGIN]), 0.0
            for k in range(N):
                x = transcription.advance(x, np.zeros(1))[0][:2]
                worst = max(worst, abs(x[0] - np.sin(BEGIN + LENGTH * (k + 1) / N)))
            found.append(worst)
        errors[name] = np.array(found)
    return errors
