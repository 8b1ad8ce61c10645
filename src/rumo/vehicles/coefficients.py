"""Coefficients of the magic formula."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import casadi as ca

from rumo.checks import finite_number, non_negative_number, positive_number
from rumo.errors import ArgumentError

LEAST_SHARE = 0.1
"""Of the friction at the nominal load, at whatever load: far beyond the loads of a fit its straight line reaches 0."""

CHANGES = ("p_Dx2", "p_Kx3", "p_Dy2", "r_Bx2", "r_By2")
"""Coefficients that may have either sign: changes with load or slip."""


@dataclass(frozen=True)
class MagicFormulaCoefficients:
    """Coefficients of one tyre in the magic formula, a subset of those in files of MF-Tyre 5.2 and PAC2002.

    Longitudinal ones first, `x`, then lateral ones, `y`; `p` are of pure slip, `r` of combined slip. `df` is
    `(F_z - F_z0) / F_z0`. Left out is what makes a tyre differ from left to right or from braking to driving, since
    cars have it mirrored: shifts, r_By3, p_Ex4; and camber, turn slip, and how curvatures vary with the load.

    Parameters
    ----------
    p_Cx1, p_Cy1 : float
        Shape, above 0 and up to 2: beyond, large slips would push along with the sliding.
    p_Dx1, p_Dy1 : float
        Peak friction at the nominal load.
    p_Ex1, p_Ey1 : float
        Curvature, at most 1.
    p_Kx1 : float
        Longitudinal stiffness over the load, at the nominal load.
    p_Ky1 : float
        Cornering stiffness over the load [1/rad]; with p_Ky2, the largest over the nominal load. Positive: files in
        which the slip angle is counted the other way have it negative.
    r_Bx1, r_Bx2, r_Cx1, r_Ex1 : float
        How the longitudinal force falls with the slip angle.
    r_By1, r_By2, r_Cy1, r_Ey1 : float
        How the lateral force falls with the slip ratio.
    F_z0 : float
        Nominal load [N].
    p_Dx2, p_Dy2 : float
        Change of the peak friction with df.
    p_Kx3 : float
        Exponent of the longitudinal stiffness over the load, `exp(p_Kx3 df)`.
    p_Ky2 : float
        Load at which the cornering stiffness is largest, over the nominal load; 0 for one proportional to the load.

    Raises
    ------
    ArgumentError
        If a number is not finite or beyond the limits above.

    Notes
    -----
    Source: Pacejka, "Tire and Vehicle Dynamics", 3rd ed. (2012), section 4.3.2.
    """

    p_Cx1: float
    p_Dx1: float
    p_Ex1: float
    p_Kx1: float
    p_Cy1: float
    p_Dy1: float
    p_Ey1: float
    p_Ky1: float
    r_Bx1: float
    r_Bx2: float
    r_Cx1: float
    r_Ex1: float
    r_By1: float
    r_By2: float
    r_Cy1: float
    r_Ey1: float
    F_z0: float
    p_Dx2: float = 0.0
    p_Kx3: float = 0.0
    p_Dy2: float = 0.0
    p_Ky2: float = 0.0

    def __post_init__(self) -> None:
        for item in fields(self):
            name, value = f"MagicFormulaCoefficients.{item.name}", getattr(self, item.name)
            finite_number(value, name)
            if item.name == "p_Ky1" and value < 0.0:
                raise ArgumentError(name, repr(value), "a positive number", "Here a positive slip angle pushes left.")
            if item.name[1:3] == "_E":
                _at_most(1.0, value, name)
            elif item.name == "p_Ky2":
                non_negative_number(value, name)
            elif item.name not in CHANGES:
                positive_number(value, name)
                if item.name[1:3] == "_C":
                    _at_most(2.0, value, name)

    def peaks(self, F_z: Any) -> tuple[Any, Any]:
        """Largest forces along and across [N], pure slip, at a load [N]."""
        df = F_z / self.F_z0 - 1.0
        return F_z * _friction(self.p_Dx1, self.p_Dx2, df), F_z * _friction(self.p_Dy1, self.p_Dy2, df)

    def stiffnesses(self, F_z: Any) -> tuple[Any, Any]:
        """Slopes of the forces at zero slip along [N] and across [N/rad], at a load [N]."""
        K_x = self.p_Kx1 * F_z
        if self.p_Kx3:
            K_x = K_x * ca.exp(self.p_Kx3 * (F_z / self.F_z0 - 1.0))
        if not self.p_Ky2:
            return K_x, self.p_Ky1 * F_z
        q = F_z / (self.p_Ky2 * self.F_z0)
        return K_x, self.p_Ky1 * self.F_z0 * (2.0 * q / (1.0 + q**2))  # sin(2 atan(q)) without angles


def _friction(nominal: float, change: float, df: Any) -> Any:
    return ca.fmax(nominal + change * df, LEAST_SHARE * nominal) if change else nominal


def _at_most(limit: float, value: float, name: str) -> None:
    if value > limit:
        raise ArgumentError(name, repr(value), f"at most {limit:g}")
