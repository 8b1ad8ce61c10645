"""Implicit Euler, the paper's scheme."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca

from rumo.discretization.base import Discretization
from rumo.model import Model


@dataclass(frozen=True)
class ImplicitEuler(Discretization):
    """`F = x + h f(end)`: first order, A-stable and L-stable.

    Source: the paper's equation (discrete-vector-field-detail); Hairer and Wanner (1996), ch. IV.3.
    """

    order: ClassVar[int] = 1
    a_stable: ClassVar[bool] = True
    l_stable: ClassVar[bool] = True

    def residual(self, model: Model, end: Any, inner: Any, x: Any, u: Any, p: Any, step: Any) -> Any:
        """`F - end` and the algebraic equations."""
        F = x + step * model.f(end, u, p)
        return ca.vertcat(F - end[: x.numel()], model.g(end, u, p))
