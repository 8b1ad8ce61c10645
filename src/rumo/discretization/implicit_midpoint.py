"""The implicit midpoint rule."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rumo.discretization.runge_kutta import ImplicitRungeKutta


@dataclass(frozen=True)
class ImplicitMidpoint(ImplicitRungeKutta):
    """`z = x + h f((x + z) / 2, u, p)`: second order, A-stable; the fastest modes change sign instead of vanishing.

    Source: Hairer and Wanner (1996), ch. IV.3.
    """

    A: ClassVar = ((0.5,),)
    b: ClassVar = (1.0,)
    order: ClassVar[int] = 2
    a_stable: ClassVar[bool] = True
    l_stable: ClassVar[bool] = False
