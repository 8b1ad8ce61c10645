"""The backward differentiation formula of second order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from rumo.discretization.base import Discretization
from rumo.model import Model


@dataclass(frozen=True)
class Bdf2(Discretization):
    """A trapezoidal half step, then BDF2 to the end: second order, A-stable and L-stable.

    A multistep formula must not look back across a jump of the input, and inputs jump with every interval: so it is
    started anew in each step. Source: Bank et al. (1985); Hosea and Shampine (1996).
    """

    order: ClassVar[int] = 2
    a_stable: ClassVar[bool] = True
    l_stable: ClassVar[bool] = True

    def inner(self, states: int, algebraic: int) -> Sequence[tuple[int, float]]:
        """The middle, and algebraic variables at the beginning."""
        middle = [(signal, 0.5) for signal in range(states + algebraic)]
        return [*middle, *((signal, 0.0) for signal in range(states, states + algebraic))]

    def residual(self, model: Model, end: Any, inner: Any, x: Any, u: Any, p: Any, step: Any) -> Any:
        """`(4 m - x + h f(z)) / 3 - z` with `m = x + h (f(x) + f(m)) / 4`."""
        nx, size, half = x.numel(), end.numel(), 0.5 * step
        middle, algebraic = ca.vertsplit(inner, [0, size, inner.numel()])
        begin = ca.vertcat(x, algebraic)
        m = middle[:nx]
        start = x + 0.5 * half * (model.f(begin, u, p) + model.f(middle, u, p)) - m
        last = (4.0 * m - x + 2.0 * half * model.f(end, u, p)) / 3.0 - end[:nx]
        return ca.vertcat(last, model.g(end, u, p), start, model.g(middle, u, p), model.g(begin, u, p))
