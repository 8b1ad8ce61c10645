"""Gauss-Legendre collocation with two stages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rumo.discretization.runge_kutta import ImplicitRungeKutta

ROOT = 3.0**0.5


@dataclass(frozen=True)
class Gauss2(ImplicitRungeKutta):
    """Collocation at (3 -+ sqrt 3) / 6: fourth order, A-stable; the fastest modes stay instead of vanishing.

    Source: Hairer and Wanner (1996), table IV.5.2.
    """

    A: ClassVar = ((0.25, 0.25 - ROOT / 6.0), (0.25 + ROOT / 6.0, 0.25))
    b: ClassVar = (0.5, 0.5)
    order: ClassVar[int] = 4
    a_stable: ClassVar[bool] = True
    l_stable: ClassVar[bool] = False
