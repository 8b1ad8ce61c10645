"""What implicit Runge-Kutta schemes share."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from rumo.discretization.base import Discretization
from rumo.model import Model
from rumo.signals import Array


class ImplicitRungeKutta(Discretization):
    """A scheme of s stages whose matrix A can be inverted, solved for the states at the stages.

    With W = A^-1 the stages fulfil `h f(X_i) = sum_j W_ij (X_j - x)`: each derivative of f enters one block of rows
    only. The state at the end is the last stage where b is the last row of A (stiffly accurate), else the combination
    `x + sum_i (b W)_i (X_i - x)`, without f again.

    Attributes
    ----------
    A, b : sequences
        The scheme's coefficients, shapes (s, s), (s,).

    Source: Hairer and Wanner (1996), ch. IV.8.
    """

    A: ClassVar[Sequence[Sequence[float]]]
    b: ClassVar[Sequence[float]]

    @cached_property
    def stiffly_accurate(self) -> bool:
        """Whether the last stage is the end of the step."""
        return tuple(self.b) == tuple(self.A[-1])

    def inner(self, states: int, algebraic: int) -> Sequence[tuple[int, float]]:
        """All stages but one that is the end."""
        nodes = np.sum(self.A, axis=1)[: len(self.b) - self.stiffly_accurate].tolist()
        return [(signal, node) for node in nodes for signal in range(states + algebraic)]

    def residual(self, model: Model, end: Any, inner: Any, x: Any, u: Any, p: Any, step: Any) -> Any:
        """`h f(X_i) - sum_j W_ij (X_j - x)` and the algebraic equations, at each stage."""
        nx, size = x.numel(), end.numel()
        stages = [inner[i * size : (i + 1) * size] for i in range(inner.numel() // size)]
        stages += [end] if self.stiffly_accurate else []
        weights: Array = np.linalg.inv(np.array(self.A, dtype=float))
        # Rounding must not couple what the scheme does not.
        weights[np.abs(weights) < 1e-13] = 0.0
        rows = [
            ca.vertcat(
                step * model.f(stage, u, p)
                - sum(w * (other[:nx] - x) for w, other in zip(row, stages, strict=True) if w),
                model.g(stage, u, p),
            )
            for row, stage in zip(weights, stages, strict=True)
        ]
        if self.stiffly_accurate:
            return ca.vertcat(rows[-1], *rows[:-1])
        share = np.array(self.b) @ weights
        last = x + sum(d * (stage[:nx] - x) for d, stage in zip(share, stages, strict=True)) - end[:nx]
        return ca.vertcat(last, model.g(end, u, p), *rows)
