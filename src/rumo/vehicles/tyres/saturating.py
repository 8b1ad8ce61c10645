"""Linear tyre within the friction circle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from rumo.vehicles.parameters import TyreParameters


@dataclass(frozen=True)
class SaturatingTyre:
    """Linear forces, scaled back along their own direction to stay within mu F_z.

    A force that would be k becomes `k / (1 + (k / (mu F_z))^4)^(1/4)`: linear at small slip, within 6 % up to 0.7
    mu F_z, and mu F_z at large slip. Smooth everywhere, and it never falls, so a prediction has an easy time with it.
    """

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, mu: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) [N], see `Tyre`."""
        F_x, F_y = tyre.C_s * sigma, tyre.C_a * ca.atan(tan_alpha)
        used = (F_x**2 + F_y**2) / (mu * F_z) ** 2
        share = 1.0 / ca.sqrt(ca.sqrt(1.0 + used**2))
        return share * F_x, share * F_y
