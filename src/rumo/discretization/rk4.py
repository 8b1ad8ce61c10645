"""The classical Runge-Kutta scheme of fourth order, for comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from rumo.discretization.base import Discretization
from rumo.model import Model


@dataclass(frozen=True)
class Rk4(Discretization):
    """Four explicit stages: fourth order; a mode of rate -r needs steps below 2.785 / r."""

    order: ClassVar[int] = 4
    a_stable: ClassVar[bool] = False
    l_stable: ClassVar[bool] = False
    explicit: ClassVar[bool] = True

    def residual(self, model: Model, end: Any, inner: Any, x: Any, u: Any, p: Any, step: Any) -> Any:
        """`x + h (k1 + 2 k2 + 2 k3 + k4) / 6 - z`."""
        k1 = model.f(x, u, p)
        k2 = model.f(x + 0.5 * step * k1, u, p)
        k3 = model.f(x + 0.5 * step * k2, u, p)
        k4 = model.f(x + step * k3, u, p)
        return x + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4) - end
