"""Radau IIA with two stages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rumo.discretization.runge_kutta import ImplicitRungeKutta


@dataclass(frozen=True)
class Radau2(ImplicitRungeKutta):
    """Collocation at 1/3 and 1: third order, A-stable and L-stable.

    Source: Hairer and Wanner (1996), table IV.5.5.
    """

    A: ClassVar = ((5.0 / 12.0, -1.0 / 12.0), (0.75, 0.25))
    b: ClassVar = (0.75, 0.25)
    order: ClassVar[int] = 3
    a_stable: ClassVar[bool] = True
    l_stable: ClassVar[bool] = True
