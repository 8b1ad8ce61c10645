"""A singly diagonally implicit Runge-Kutta scheme of two stages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rumo.discretization.runge_kutta import ImplicitRungeKutta

GAMMA = 1.0 - 0.5**0.5


@dataclass(frozen=True)
class Sdirk2(ImplicitRungeKutta):
    """Two stages, one after the other: second order, A-stable and L-stable.

    Source: Alexander (1977).
    """

    A: ClassVar = ((GAMMA, 0.0), (1.0 - GAMMA, GAMMA))
    b: ClassVar = (1.0 - GAMMA, GAMMA)
    order: ClassVar[int] = 2
    a_stable: ClassVar[bool] = True
    l_stable: ClassVar[bool] = True
