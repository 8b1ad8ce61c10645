"""Dugoff's tyre."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from rumo.vehicles.parameters import TyreParameters

TINY = 1e-6
"""Part of mu F_z that is added to the demand under its root."""


@dataclass(frozen=True)
class Dugoff:
    """Dugoff's tyre: linear at small slip, limited by friction (Dugoff, Fancher and Segel, 1970)."""

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, mu: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) [N], see `Tyre`."""
        demand_x, demand_y, share = linear_share(tyre, sigma, tan_alpha, F_z, mu, direction)
        return share * demand_x, share * demand_y


def linear_share(
    tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, mu: Any, direction: Any
) -> tuple[Any, Any, Any]:
    """Linear forces at full sliding speed, and the share H/k of them that friction allows.

    Dugoff's `F = C slip / (1 + sigma) f(lambda)` with `lambda = mu F_z (1 + sigma) / (2 k)` equals `C slip H / k` with
    `H = k/d` up to `k = mu F_z d / 2` and `H = mu F_z (1 - mu F_z d / (4 k))` beyond, d = 1 + sigma,
    the wheel's own speed over that of its centre: no division by zero in the linear part, at zero slip or where the
    wheel stands.
    """
    demand_x, demand_y = tyre.C_s * sigma, tyre.C_a * tan_alpha
    limit = mu * F_z
    # A wheel turning against its motion (sigma < -1) is a locked one as far as friction goes.
    d = ca.fmax(1.0 + direction * sigma, 0.0)
    k = ca.sqrt(demand_x**2 + demand_y**2 + (TINY * limit) ** 2)
    sliding = k > 0.5 * limit * d
    share = ca.if_else(sliding, limit * (1.0 - 0.25 * limit * d / k) / k, 1.0 / ca.fmax(d, 2.0 * TINY))
    return demand_x, demand_y, share
