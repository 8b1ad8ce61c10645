"""Radau IIA with three stages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rumo.discretization.runge_kutta import ImplicitRungeKutta

ROOT = 6.0**0.5


@dataclass(frozen=True)
class Radau3(ImplicitRungeKutta):
    """Collocation at (4 - sqrt 6) / 10, (4 + sqrt 6) / 10 and 1: fifth order, A-stable and L-stable.

    Source: Hairer and Wanner (1996), table IV.5.6.
    """

    A: ClassVar = (
        ((88.0 - 7.0 * ROOT) / 360.0, (296.0 - 169.0 * ROOT) / 1800.0, (-2.0 + 3.0 * ROOT) / 225.0),
        ((296.0 + 169.0 * ROOT) / 1800.0, (88.0 + 7.0 * ROOT) / 360.0, (-2.0 - 3.0 * ROOT) / 225.0),
        ((16.0 - ROOT) / 36.0, (16.0 + ROOT) / 36.0, 1.0 / 9.0),
    )
    b: ClassVar = ((16.0 - ROOT) / 36.0, (16.0 + ROOT) / 36.0, 1.0 / 9.0)
    order: ClassVar[int] = 5
    a_stable: ClassVar[bool] = True
    l_stable: ClassVar[bool] = True
