"""Linear tyre: the paper's prediction model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from rumo.vehicles.parameters import TyreParameters


@dataclass(frozen=True)
class LinearTyre:
    """Forces proportional to the slips: equations (longitudinal-force) and (lateral-force). Friction limits nothing."""

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, mu: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) [N], see `Tyre`."""
        return tyre.C_s * sigma, tyre.C_a * ca.atan(tan_alpha)
