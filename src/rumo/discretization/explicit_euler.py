"""Explicit Euler, for comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from rumo.discretization.base import Discretization
from rumo.model import Model


@dataclass(frozen=True)
class ExplicitEuler(Discretization):
    """`z = x + h f(x, u, p)`: first order; a mode of rate -r needs steps below 2 / r."""

    order: ClassVar[int] = 1
    a_stable: ClassVar[bool] = False
    l_stable: ClassVar[bool] = False
    explicit: ClassVar[bool] = True

    def residual(self, model: Model, end: Any, inner: Any, x: Any, u: Any, p: Any, step: Any) -> Any:
        """`x + h f(x) - z`."""
        return x + step * model.f(x, u, p) - end
