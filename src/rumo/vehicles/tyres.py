"""Tyre slips and forces, without division by zero: from standstill, in reverse, at zero slip.

`sigma` is the slip ratio (drive positive), `alpha` the slip angle, `F_z` the normal load. Forces act in the
wheel plane: F_x along, F_y to the left.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import casadi as ca

from rumo.vehicles.parameters import TyreParameters

EPS_SPEED = 0.1
"""Speed [m/s] below which the slips are smoothed."""


class Tyre(Protocol):
    """A tyre model."""

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) of a tyre.

        Parameters
        ----------
        tyre : TyreParameters
            Stiffness and friction.
        sigma, tan_alpha : expression
            Slip ratio over the speed's magnitude, tangent of the slip angle.
        F_z : expression
            Normal load [N].
        direction : expression
            1 when the wheel moves forwards, -1 in reverse, smooth between.

        Returns
        -------
        tuple of expression
            Force along the wheel plane and to its left [N].
        """
        ...


def slip(v_lon: Any, v_lat: Any, wheel_speed: Any, r: float, *, signed: bool = False) -> tuple[Any, Any, Any]:
    """Slip ratio, tangent of the slip angle and direction of motion of a wheel.

    Parameters
    ----------
    v_lon, v_lat : expression
        Velocity of the wheel's centre along and across its plane [m/s].
    wheel_speed : expression
        Angular speed of the wheel [rad/s].
    r : float
        Effective radius [m].
    signed : bool
        As printed: the signed velocity as the denominator, and no direction of motion.

    Notes
    -----
    The paper's equations (slip-angle) and (slip-ratio) with `sqrt(v^2 + eps^2)` as the denominator, so that the
    force always opposes the sliding, in reverse too.
    """
    speed = v_lon if signed else ca.sqrt(v_lon**2 + EPS_SPEED**2)
    return (r * wheel_speed - v_lon) / speed, -v_lat / speed, 1.0 if signed else v_lon / speed


@dataclass(frozen=True)
class LinearTyre:
    """Forces proportional to the slips: equations (longitudinal-force) and (lateral-force)."""

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) [N], see `Tyre`."""
        return tyre.C_s * sigma, tyre.C_a * ca.atan(tan_alpha)


@dataclass(frozen=True)
class Dugoff:
    """Dugoff's tyre: linear at small slip, limited by friction (Dugoff, Fancher and Segel, 1970)."""

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) [N], see `Tyre`."""
        demand_x, demand_y, share = _dugoff(tyre, sigma, tan_alpha, F_z, direction)
        return share * demand_x, share * demand_y


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
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) [N], see `Tyre`."""
        mu = tyre.mu
        demand_x, demand_y, share = _dugoff(tyre, sigma, tan_alpha, F_z, direction)
        s, t = ca.fmin(ca.fabs(sigma), 1.0), ca.fmin(ca.fabs(tan_alpha), 1.0)
        G_s = (1.15 - 0.75 * mu) * s**2 - (1.63 - 0.75 * mu) * s + self.c_s
        G_a = ca.fmax((mu - 1.6) * t + self.c_a, 0.0)
        return share * demand_x * G_s, share * demand_y * G_a


def _dugoff(tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, direction: Any) -> tuple[Any, Any, Any]:
    """Linear forces at full sliding speed, and the share H/k of them that friction allows.

    Dugoff's `F = C slip / (1 + sigma) f(lambda)` with `lambda = mu F_z (1 + sigma) / (2 k)` equals `C slip H / k` with
    `H = k/d` up to `k = mu F_z d / 2` and `H = mu F_z (1 - mu F_z d / (4 k))` beyond, d = 1 + sigma,
    the wheel's own speed over that of its centre: no division by zero in the linear part, at zero slip or where the
    wheel stands.
    """
    demand_x, demand_y = tyre.C_s * sigma, tyre.C_a * tan_alpha
    limit = tyre.mu * F_z
    # A wheel turning against its motion (sigma < -1) is a locked one as far as friction goes.
    d = ca.fmax(1.0 + direction * sigma, 0.0)
    tiny = 1e-6 * limit
    k = ca.sqrt(demand_x**2 + demand_y**2 + tiny**2)
    sliding = k > 0.5 * limit * d
    share = ca.if_else(sliding, limit * (1.0 - 0.25 * limit * d / k) / k, 1.0 / ca.fmax(d, 2.0 * tiny / limit))
    return demand_x, demand_y, share
