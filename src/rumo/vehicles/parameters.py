"""What a car and its tyres are, in numbers."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path

import numpy as np

from rumo.checks import checked, non_negative_number, positive_number, share
from rumo.signals import Array
from rumo.vehicles.coefficients import MagicFormulaCoefficients
from rumo.vehicles.limits import VehicleLimits
from rumo.vehicles.toml import read_dataclass, write_dataclass

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""


@dataclass(frozen=True)
class TyreParameters:
    """Stiffness and friction of one tyre.

    Parameters
    ----------
    C_s : float
        Longitudinal stiffness [N] per unit of slip ratio.
    C_a : float
        Cornering stiffness [N/rad].
    mu : float
        Friction coefficient between tyre and road.
    magic_formula : MagicFormulaCoefficients, optional
        What `rumo.vehicles.MagicFormula` needs besides mu, of the road where they were fitted; the other tyre models
        need C_s and C_a.
    """

    C_s: float
    C_a: float
    mu: float
    magic_formula: MagicFormulaCoefficients | None = None

    def __post_init__(self) -> None:
        for name in ("C_s", "C_a", "mu"):
            positive_number(getattr(self, name), f"TyreParameters.{name}")
        if self.magic_formula is not None:
            checked(self.magic_formula, "TyreParameters.magic_formula", MagicFormulaCoefficients)


@dataclass(frozen=True)
class VehicleParameters:
    """Geometry, inertia and tyres of a car with two steered front and two driven rear wheels.

    Parameters
    ----------
    m : float
        Mass [kg].
    I : float
        Moment of inertia about the vertical axis [kg m^2].
    l_f, l_r : float
        Distance from the centre of gravity to the front and rear axle [m].
    t_w : float
        Half of the track width [m].
    r : float
        Effective wheel radius [m].
    J : float
        Moment of inertia of one wheel about its axle [kg m^2].
    b_lon, b_lat : float
        Drag coefficients along and across the car [N s^2/m^2].
    front, rear : TyreParameters
        A front and a rear tyre.
    h : float
        Height of the centre of gravity [m]; 0 keeps the normal loads static.
    drive_front : float
        Share of a driving torque that the front axle gets.
    brake_front : float, optional
        The same of a braking torque; None for a car without brakes, whose motor brakes the axles that it drives.
    length, width : float
        Of the whole car [m]; if 0, from the front end of its front wheels to the rear end of its rear wheels, and from
        the middle of its left wheels to that of its right ones.
    limits : VehicleLimits
        What it can do at most.

    Raises
    ------
    ArgumentError
        If a number is not positive, or of those that may be 0, negative.
    """

    m: float
    I: float  # noqa: E741 -- the paper's symbol
    l_f: float
    l_r: float
    t_w: float
    r: float
    J: float
    b_lon: float
    b_lat: float
    front: TyreParameters
    rear: TyreParameters
    h: float = 0.0
    drive_front: float = 0.0
    brake_front: float | None = None
    length: float = 0.0
    width: float = 0.0
    limits: VehicleLimits = field(default_factory=VehicleLimits)

    def __post_init__(self) -> None:
        for item in fields(self):
            value, name = getattr(self, item.name), f"VehicleParameters.{item.name}"
            if item.name in ("front", "rear"):
                checked(value, name, TyreParameters)
            elif item.name == "limits":
                checked(value, name, VehicleLimits)
            elif item.name in ("h", "b_lon", "b_lat", "length", "width"):
                non_negative_number(value, name)
            elif item.name == "drive_front" or (item.name == "brake_front" and value is not None):
                share(value, name)
            elif item.name == "brake_front":
                continue
            else:
                positive_number(value, name)
        object.__setattr__(self, "length", self.length or self.wheelbase + 2.0 * self.r)
        object.__setattr__(self, "width", self.width or 2.0 * self.t_w)

    @classmethod
    def from_toml(cls, path: str | Path) -> VehicleParameters:
        """A car from a file.

        Parameters
        ----------
        path : str or Path
            Of a TOML file: a key for each parameter, tables `[front]` and `[rear]` for those of the tyres,
            `[front.magic_formula]` and `[rear.magic_formula]` for coefficients, and `[limits]`.

        Raises
        ------
        ArgumentError
            If the file is no TOML, a key is unknown or missing, or a value cannot work.
        OSError
            If the file cannot be read.
        """
        return read_dataclass(cls, path)

    def to_toml(self, path: str | Path) -> None:
        """Write a file that `from_toml` reads; an old one is replaced.

        Parameters
        ----------
        path : str or Path
            Where to; the folder must exist.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        write_dataclass(self, path)

    @property
    def wheelbase(self) -> float:
        """Distance between the axles, L = l_f + l_r [m]."""
        return self.l_f + self.l_r

    @property
    def rolling_mass(self) -> float:
        """Mass that a force along the car accelerates with its four wheels turning [kg]."""
        return self.m + 4.0 * self.J / self.r**2

    @property
    def ends(self) -> tuple[float, float]:
        """Of the body, before and behind the centre of gravity [m]: its axles are as far from its ends."""
        overhang = 0.5 * (self.length - self.wheelbase)
        return self.l_f + overhang, -self.l_r - overhang

    @property
    def mu(self) -> float:
        """Friction that the models take the road for by default: that of the tyre that has less."""
        return min(self.front.mu, self.rear.mu)

    @property
    def front_load(self) -> float:
        """Static normal load of one front tyre [N]."""
        return 0.5 * self.m * GRAVITY * self.l_r / self.wheelbase

    @property
    def rear_load(self) -> float:
        """Static normal load of one rear tyre [N]."""
        return 0.5 * self.m * GRAVITY * self.l_f / self.wheelbase

    def rolling(self, speed: Array, curvature: Array) -> dict[str, Array]:
        """States v_y, w_f, w_r, delta of rolling without slip at a speed [m/s] along a curvature [1/m], all (n,)."""
        steered = self.wheelbase * curvature
        return {
            "v_y": self.l_r * (speed * curvature),
            "w_f": speed * np.hypot(1.0, steered) / self.r,
            "w_r": speed / self.r,
            "delta": np.arctan(steered),
        }
