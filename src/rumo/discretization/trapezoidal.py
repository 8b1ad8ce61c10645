"""The trapezoidal rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from rumo.discretization.base import Discretization
from rumo.model import Model


@dataclass(frozen=True)
class Trapezoidal(Discretization):
    """`z = x + h (f(x, u, p) + f(z, u, p)) / 2`: second order, A-stable; the fastest modes change sign.

    Inputs jump between steps, and algebraic variables with them: those at the beginning are unknown too.

    Source: Hairer and Wanner (1996), ch. IV.3.
    """

    order: ClassVar[int] = 2
    a_stable: ClassVar[bool] = True
    l_stable: ClassVar[bool] = False

    def inner(self, states: int, algebraic: int) -> Sequence[tuple[int, float]]:
        """Algebraic variables at the beginning."""
        return [(signal, 0.0) for signal in range(states, states + algebraic)]

    def residual(self, model: Model, end: Any, inner: Any, x: Any, u: Any, p: Any, step: Any) -> Any:
        """`x + h (f(x) + f(z)) / 2 - z`, and the algebraic equations at both ends."""
        begin = ca.vertcat(x, inner)
        slope = 0.5 * (model.f(begin, u, p) + model.f(end, u, p))
        return ca.vertcat(x + step * slope - end[: x.numel()], model.g(end, u, p), model.g(begin, u, p))
