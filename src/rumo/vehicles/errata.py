"""Switches that restore what the paper prints where Rumo does something else."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AsPrinted:
    """Each switch set to True follows the paper's text; the default is the physically right form.

    Parameters
    ----------
    lateral_kinematics : bool
        `p_y' = v_x sin(psi) - v_y cos(psi)` instead of a plus sign (equations vehicle-dynamics, bicycle-dynamics).
    drag : bool
        `-b (v + v_wind)^2`, which pushes forward when reversing, instead of `-b w |w|` with w = v - wind.
    signed_slip : bool
        `v_x` as the denominator of the slips instead of `sqrt(v_x^2 + eps^2)`; divides by zero at standstill.
    slip_at_center : bool
        Slip angles and ratios from the velocity at the centre of gravity instead of at each wheel.
    full_weight_friction : bool
        Friction circle `(mu m g)^2` for a single tyre instead of `(mu F_z)^2` with its static load.
    """

    lateral_kinematics: bool = False
    drag: bool = False
    signed_slip: bool = False
    slip_at_center: bool = False
    full_weight_friction: bool = False
