"""What every tyre model offers, and the slips it takes, without division by zero: from standstill, and in reverse.

`sigma` is the slip ratio (drive positive), `alpha` the slip angle, `F_z` the normal load. Forces act in the
wheel plane: F_x along, F_y to the left.
"""

from __future__ import annotations

from typing import Any, Protocol

import casadi as ca

from rumo.vehicles.parameters import TyreParameters

EPS_SPEED = 0.1
"""Speed [m/s] below which the slips are smoothed."""


class Tyre(Protocol):
    """A tyre model: what the numbers of a tyre, its slips, its load and the road make of a force.

    Predictions differentiate it, so forces and slopes have to be finite whatever the slips.
    """

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, mu: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) of a tyre.

        Parameters
        ----------
        tyre : TyreParameters
            Stiffness, and the friction `tyre.mu` for which the other numbers were found.
        sigma, tan_alpha : expression
            Slip ratio over the speed's magnitude, tangent of the slip angle.
        F_z : expression
            Normal load [N].
        mu : expression
            Friction coefficient between tyre and road, positive.
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
