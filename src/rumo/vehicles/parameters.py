"""Vehicle parameter sets with their sources."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from rumo.checks import checked, non_negative_number, positive_number, share
from rumo.signals import Array

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
    """

    C_s: float
    C_a: float
    mu: float

    def __post_init__(self) -> None:
        for name in ("C_s", "C_a", "mu"):
            positive_number(getattr(self, name), f"TyreParameters.{name}")


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
    h: float = field(default=0.0)
    drive_front: float = 0.0
    brake_front: float | None = None

    def __post_init__(self) -> None:
        for item in fields(self):
            value, name = getattr(self, item.name), f"VehicleParameters.{item.name}"
            if item.name in ("front", "rear"):
                checked(value, name, TyreParameters)
            elif item.name in ("h", "b_lon", "b_lat"):
                non_negative_number(value, name)
            elif item.name == "drive_front" or (item.name == "brake_front" and value is not None):
                share(value, name)
            elif item.name == "brake_front":
                continue
            else:
                positive_number(value, name)

    @property
    def wheelbase(self) -> float:
        """Distance between the axles, L = l_f + l_r [m]."""
        return self.l_f + self.l_r

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
        return {
            "v_y": self.l_r * (speed * curvature),
            "w_f": speed * np.sqrt(1.0 + (self.wheelbase * curvature) ** 2) / self.r,
            "w_r": speed / self.r,
            "delta": np.arctan(self.wheelbase * curvature),
        }


_PAPER_TYRE = TyreParameters(C_s=600_000.0, C_a=250_000.0, mu=0.9)

PAPER_CAR = VehicleParameters(
    m=200.0,
    I=150.0,
    l_f=0.8,
    l_r=1.0,
    t_w=0.6,
    r=0.6,
    J=0.2,
    b_lon=0.01,
    b_lat=0.05,
    front=_PAPER_TYRE,
    rear=_PAPER_TYRE,
)
"""Table 1 of the paper. The tyres are some fifty times stiffer than ordinary ones; the table is kept for its study."""


def _passenger_car() -> VehicleParameters:
    """A BMW 320i, vehicle 2 of Althoff and Wuersching, "CommonRoad: Vehicle Models" (2020), tables 6 and 7.

    There the stiffness of a tyre is a multiple of its normal load: p_kx1 = 22.303 along, p_ky1 = 21.92 per
    radian across; the lateral peak friction is p_dy1 = 1.0489. The drag coefficients, which that report leaves
    out, are 1/2 rho c A with rho = 1.2 kg/m^3: c = 0.3 and A = 2.1 m^2 along, c = 1.0 and A = 3.5 m^2 across.
    """
    m, l_f, l_r = 1093.2952334674046, 1.1561957064, 1.4227170936

    def tyre(load: float) -> TyreParameters:
        return TyreParameters(C_s=22.303 * load, C_a=21.92 * load, mu=1.0489)

    half_weight = 0.5 * m * GRAVITY / (l_f + l_r)
    return VehicleParameters(
        m=m,
        I=1791.5995300122856,
        l_f=l_f,
        l_r=l_r,
        t_w=0.25 * (1.38684 + 1.36398),
        r=0.344,
        J=1.7,
        b_lon=0.38,
        b_lat=2.1,
        front=tyre(half_weight * l_r),
        rear=tyre(half_weight * l_f),
        h=0.5748689544,
        brake_front=0.66,
    )


PASSENGER_CAR = _passenger_car()
"""A BMW 320i after CommonRoad vehicle 2; see `_passenger_car` for the sources of each figure."""
