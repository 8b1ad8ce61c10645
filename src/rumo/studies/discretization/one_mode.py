"""What schemes make of a single mode: how it decays, and how it follows what drives it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from rumo.discretization.stability import stability_function
from rumo.model import Model, Parameter
from rumo.problem import Problem
from rumo.registry import DISCRETIZATIONS
from rumo.signals import Array
from rumo.terms import Weight
from rumo.transcription import Transcription

ONE_MODE = "one mode"
"""Key of the run, among those of the cases."""
PRODUCTS = -np.logspace(-1.0, 6.0, 141)
"""Rates of decaying modes times the length of a step."""
RATES = (1.0, 1e6)
"""Of a slow and a fast mode that follow a sine [1/s]."""
INTERVALS = (4, 8, 16, 32, 64, 128)
BEGIN, LENGTH = 0.3, 1.0
"""Phase at the beginning [rad], and length of what is integrated [s]."""


@dataclass(frozen=True, eq=False)
class ModeResult:
    """What became of one mode.

    Attributes
    ----------
    damping : mapping of str to ndarray, shape (n,)
        |R(z)| of each scheme for each z in `PRODUCTS`.
    following : mapping of float to mapping of str to ndarray
        Errors of the model of Prothero and Robinson, by rate and scheme, for each number of intervals in `INTERVALS`;
        explicit schemes only where they are stable.
    """

    damping: Mapping[str, Array]
    following: Mapping[float, Mapping[str, Array]]


@dataclass(frozen=True)
class ModeRun:
    """What some schemes make of one mode."""

    schemes: tuple[str, ...]

    def run(self, *, progress: Callable[[int, int], None] | None = None) -> ModeResult:
        """Damp it, and let it follow."""
        slow, fast = RATES
        stable = [name for name in self.schemes if DISCRETIZATIONS[name].a_stable]
        following = {slow: following_errors(self.schemes, slow), fast: following_errors(stable, fast)}
        return ModeResult(damping(self.schemes, PRODUCTS), following)


def damping(schemes: Sequence[str], products: Array) -> dict[str, Array]:
    """|R(z)| of each scheme, what is left of a mode after one step, for products z of its rate and the step (n,)."""
    factors = {name: stability_function(DISCRETIZATIONS[name](), products.astype(complex).tolist()) for name in schemes}
    return {name: np.abs(factor) for name, factor in factors.items()}


def prothero_robinson() -> Model:
    """A state that follows a sine at a given rate, starting on it.

    `y' = rate (sin(t) - y) + cos(t) + push`, whose solution without push is sin(t), however fast it is. Source:
    Prothero and Robinson (1974).
    """
    return Model(
        states={"y": "1", "phase": "rad"},
        inputs={"push": "1/s"},
        dynamics=lambda x, u, p: {"y": p.rate * (ca.sin(x.phase) - x.y) + ca.cos(x.phase) + u.push, "phase": 1.0},
        parameters={"rate": Parameter("1/s", 1.0)},
        name="prothero_robinson",
    )


def following_errors(schemes: Sequence[str], rate: float) -> dict[str, Array]:
    """Largest error of the model of Prothero and Robinson within one second, for each number of `INTERVALS`."""
    return {name: np.array([_following_error(name, rate, N) for N in INTERVALS]) for name in schemes}


def _following_error(scheme: str, rate: float, N: int) -> float:
    problem = Problem(
        prothero_robinson(),
        horizon=N,
        sampling_time=LENGTH / N,
        track={"y": Weight(1.0)},
        moves={"push": Weight(1.0)},
        parameters={"rate": rate},
    )
    transcription = Transcription(problem, DISCRETIZATIONS[scheme]())
    x, worst = np.array([np.sin(BEGIN), BEGIN]), 0.0
    for k in range(N):
        x = transcription.advance(x, np.zeros(1))[0][:2]
        worst = max(worst, abs(x[0] - np.sin(BEGIN + LENGTH * (k + 1) / N)))
    return worst
