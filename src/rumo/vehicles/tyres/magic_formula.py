"""Magic formula: a fit of measured tyres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from rumo.errors import ArgumentError
from rumo.vehicles.coefficients import MagicFormulaCoefficients
from rumo.vehicles.parameters import TyreParameters

LEAST_WEIGHT = 0.05
"""Below this, the weight of combined slip goes smoothly to 0, and stays there."""


@dataclass(frozen=True)
class MagicFormula:
    """Pacejka's magic formula, a subset of version 5.2: pure slip, weighted where both slips are there.

    Each force is `D sin(C atan(B s - E (B s - atan(B s))))` of its slip s, the slip ratio or the slip angle, times a
    weight that falls with the other slip. Numbers are those of `TyreParameters.magic_formula`, not C_s and C_a.

    Road friction acts by similarity: forces are q times those on the road of the fit at slips / q, `q = mu / tyre.mu`.
    So peaks scale and stiffnesses stay, and on any road the largest force is as much of mu F_z. (Scaling D alone, as
    with the factor lambda_mu, is the same for each slip alone; but on ice, where slips are small, the weights would let
    both forces have their peaks at once.)

    Where the fit of a weight falls below 0, at large slips, the weight is 0, so that no tyre pushes along with its
    sliding.

    Notes
    -----
    Source: Pacejka, "Tire and Vehicle Dynamics", 3rd ed. (2012), section 4.3.2, without the terms that
    `MagicFormulaCoefficients` leaves out; section 4.2 for similarity.
    """

    def force(
        self, tyre: TyreParameters, sigma: Any, tan_alpha: Any, F_z: Any, mu: Any, direction: Any = 1.0
    ) -> tuple[Any, Any]:
        """Forces (F_x, F_y) [N], see `Tyre`; raises if the tyre has no coefficients."""
        c = tyre.magic_formula
        if c is None:
            raise ArgumentError(
                "tyre",
                "MagicFormula() of a tyre without coefficients",
                "TyreParameters(..., magic_formula=MagicFormulaCoefficients(...))",
                "rumo.vehicles.PASSENGER_CAR has some: dataclasses.replace(car.front, magic_formula=...).",
            )
        q = mu / tyre.mu
        kappa, alpha = sigma / q, ca.atan(tan_alpha) / q
        (D_x, D_y), (K_x, K_y) = c.peaks(F_z), c.stiffnesses(F_z)
        F_x0 = _pure(c.p_Cx1, D_x, c.p_Ex1, K_x, kappa)
        F_y0 = _pure(c.p_Cy1, D_y, c.p_Ey1, K_y, alpha)
        along, across = _weights(c, kappa, alpha)
        return q * along * F_x0, q * across * F_y0


def _pure(C: float, D: Any, E: float, K: Any, slip: Any) -> Any:
    return D * ca.sin(C * ca.atan(_curved(K / (C * D) * slip, E)))


def _weights(c: MagicFormulaCoefficients, kappa: Any, alpha: Any) -> tuple[Any, Any]:
    """G_xa and G_yk; `cos(atan(z))` is `1 / sqrt(1 + z^2)`."""
    B_xa = c.r_Bx1 / ca.sqrt(1.0 + (c.r_Bx2 * kappa) ** 2)
    B_yk = c.r_By1 / ca.sqrt(1.0 + (c.r_By2 * alpha) ** 2)
    G_xa = ca.cos(c.r_Cx1 * ca.atan(_curved(B_xa * alpha, c.r_Ex1)))
    G_yk = ca.cos(c.r_Cy1 * ca.atan(_curved(B_yk * kappa, c.r_Ey1)))
    return _not_below_zero(G_xa), _not_below_zero(G_yk)


def _curved(x: Any, E: float) -> Any:
    return (1.0 - E) * x + E * ca.atan(x)


def _not_below_zero(G: Any) -> Any:
    """G where it is above LEAST_WEIGHT, 0 where it is below -LEAST_WEIGHT, a parabola that fits between."""
    w = LEAST_WEIGHT
    return ca.fmax(G - w, 0.0) + (ca.fmin(ca.fmax(G, -w), w) + w) ** 2 / (4.0 * w)
