"""Modified Dugoff tyre: the paper's plant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from rumo.vehicles.parameters import TyreParameters
from rumo.vehicles.tyres.dugoff import linear_share


@dataclass(frozen=True)
class ModifiedDugoff:
    """Modified Dugoff tyre (Bian et al., SAE 2014-01-0123): Dugoff times G_s and G_a, which shape the peak.

    The factors are fits for slips up to 1; beyond, their values at 1 are kept. On slippery roads, mu below 0.45, the
    fit of G_a falls below 0 before; it stops there, so that no tyre ever pushes along with its sliding.

    Parameters
    ----------
    c_s, c_a : float
        Constants of G_s and G_a. (1.27, 1.155) peaks 8 to 24 % above mu F_z at mu = 0.9, depending on the
        stiffness; public codes also use (1.5, 1.5), which peaks 33 to 47 % above.
    """

    c_s: float = 1.27
    c_a: float = 1.155

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, mu: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) [N], see `Tyre`."""
        demand_x, demand_y, share = linear_share(tyre, sigma, tan_alpha, F_z, mu, direction)
        s, t = ca.fmin(ca.fabs(sigma), 1.0), ca.fmin(ca.fabs(tan_alpha), 1.0)
        G_s = (1.15 - 0.75 * mu) * s**2 - (1.63 - 0.75 * mu) * s + self.c_s
        G_a = ca.fmax((mu - 1.6) * t + self.c_a, 0.0)
        return share * demand_x * G_s, share * demand_y * G_a
