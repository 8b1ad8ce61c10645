"""Vehicles 1 to 3 of Althoff and Wuersching, "CommonRoad: Vehicle Models" (2020), tables 6 and 7.

Numbers are those of the parameter files of the package commonroad-vehicle-models 3.0.2. That report leaves out the drag
of the air: here it is 1/2 rho c A with rho = 1.2 kg/m^3, and c and A of our own, typical of such cars.
"""

from __future__ import annotations

from dataclasses import replace

from rumo.vehicles.coefficients import MagicFormulaCoefficients
from rumo.vehicles.limits import VehicleLimits
from rumo.vehicles.parameters import GRAVITY, TyreParameters, VehicleParameters

TYRE = MagicFormulaCoefficients(
    p_Cx1=1.6411,
    p_Dx1=1.1739,
    p_Ex1=0.46403,
    p_Kx1=22.303,
    p_Cy1=1.3507,
    p_Dy1=1.0489,
    p_Ey1=-0.0074722,
    p_Ky1=21.92,
    r_Bx1=13.276,
    r_Bx2=-13.778,
    r_Cx1=1.2568,
    r_Ex1=0.65225,
    r_By1=7.1433,
    r_By2=9.1916,
    r_Cy1=1.0719,
    r_Ey1=-0.27572,
    F_z0=4850.0,
)
"""The tyre of all three cars: table 7 of the report, where forces are proportional to the load."""

TYRE_235_60_R16 = replace(TYRE, p_Dx2=-0.16395, p_Kx3=0.21253, p_Dy2=-0.18033, p_Ky2=2.0012)
"""The tyre from which table 7 is taken, with its load sensitivity: an example of a PAC2002 file for Adams, 235/60 R16.

At twice the nominal load its friction is 14 % less along and 17 % less across; at the nominal load, its cornering
stiffness is a fifth less than the table's.
"""


def _car(
    *,
    m: float,
    I: float,  # noqa: E741 -- the paper's symbol
    axles: tuple[float, float],
    tracks: tuple[float, float],
    height: float,
    size: tuple[float, float],
    drag: tuple[float, float],
    steering_angle: float,
    speed: float,
    switching_speed: float,
    drive_front: float,
    brake_front: float,
) -> VehicleParameters:
    """A car of the report; pairs are front and rear, length and width, along and across.

    Stiffnesses are multiples of the static load. Beyond the switching speed the motor has constant power.
    """
    l_f, l_r = axles
    half_weight = 0.5 * m * GRAVITY / (l_f + l_r)
    acceleration = 11.5

    def tyre(load: float) -> TyreParameters:
        C_s, C_a = TYRE.stiffnesses(load)
        return TyreParameters(C_s=C_s, C_a=C_a, mu=TYRE.p_Dy1, magic_formula=TYRE)

    return VehicleParameters(
        m=m,
        I=I,
        l_f=l_f,
        l_r=l_r,
        t_w=0.25 * (tracks[0] + tracks[1]),
        r=0.344,
        J=1.7,
        b_lon=drag[0],
        b_lat=drag[1],
        front=tyre(half_weight * l_r),
        rear=tyre(half_weight * l_f),
        h=height,
        length=size[0],
        width=size[1],
        drive_front=drive_front,
        brake_front=brake_front,
        limits=VehicleLimits(
            steering_angle=steering_angle,
            steering_rate=0.4,
            acceleration=acceleration,
            braking=acceleration,
            speed=speed,
            power=m * acceleration * switching_speed,
        ),
    )


COMMONROAD_1 = _car(
    m=1225.8878467253344,
    I=1538.8533713561394,
    axles=(0.88392, 1.50876),
    tracks=(1.389888, 1.423416),
    height=0.557784,
    size=(4.298, 1.674),
    drag=(0.41, 2.1),
    steering_angle=0.91,
    speed=45.8,
    switching_speed=4.755,
    drive_front=1.0,
    brake_front=0.76,
)
"""A Ford Escort, vehicle 1; drag of c = 0.36 and A = 1.9 m^2 along, c = 1.0 and A = 3.5 m^2 across."""

PASSENGER_CAR = _car(
    m=1093.2952334674046,
    I=1791.5995300122856,
    axles=(1.1561957064, 1.4227170936),
    tracks=(1.38684, 1.36398),
    height=0.5748689544,
    size=(4.508, 1.61),
    drag=(0.38, 2.1),
    steering_angle=1.066,
    speed=50.8,
    switching_speed=7.319,
    drive_front=0.0,
    brake_front=0.66,
)
"""A BMW 320i, vehicle 2; drag of c = 0.3 and A = 2.1 m^2 along, c = 1.0 and A = 3.5 m^2 across."""

COMMONROAD_3 = _car(
    m=1478.8979637767998,
    I=2473.1176915564442,
    axles=(1.1507916024, 1.3211363976),
    tracks=(1.574292, 1.543812),
    height=0.7478167416,
    size=(4.569, 1.844),
    drag=(0.79, 4.2),
    steering_angle=1.023,
    speed=41.7,
    switching_speed=7.824,
    drive_front=0.0,
    brake_front=0.64,
)
"""A VW Vanagon, vehicle 3; drag of c = 0.44 and A = 3.0 m^2 along, c = 1.0 and A = 7.0 m^2 across."""
