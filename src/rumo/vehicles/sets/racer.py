"""A racing car at a scale of 1:10."""

from __future__ import annotations

from rumo.vehicles.limits import VehicleLimits
from rumo.vehicles.parameters import GRAVITY, TyreParameters, VehicleParameters


def _racer() -> VehicleParameters:
    """The car of F1TENTH (RoboRacer): the default parameters of `f1tenth_gym`, file f110_env.py.

    There the lateral force of an axle is mu C_S F_z alpha, with C_Sf = 4.718 and C_Sr = 5.4562 per radian, estimates
    by its authors. The wheels, radius 0.0508 m and width 0.0381 m, are those of ego_racecar.xacro in `f1tenth_gym_ros`,
    at the outside of the car. Of our own are the stiffness along, like that across; a wheel's inertia, a disc's of
    0.15 kg; and the drag, 1/2 rho c A with rho = 1.2 kg/m^3, c = 0.6 and A = 0.04 m^2 along, c = 1.0 and
    A = 0.07 m^2 across.
    """
    m, l_f, l_r, mu, width, r = 3.74, 0.15875, 0.17145, 1.0489, 0.31, 0.0508
    acceleration = 9.51

    def tyre(C_S: float, load: float) -> TyreParameters:
        return TyreParameters(C_s=mu * C_S * load, C_a=mu * C_S * load, mu=mu)

    half_weight = 0.5 * m * GRAVITY / (l_f + l_r)
    return VehicleParameters(
        m=m,
        I=0.04712,
        l_f=l_f,
        l_r=l_r,
        t_w=0.5 * (width - 0.0381),
        r=r,
        J=0.5 * 0.15 * r**2,
        b_lon=0.014,
        b_lat=0.042,
        front=tyre(4.718, half_weight * l_r),
        rear=tyre(5.4562, half_weight * l_f),
        h=0.074,
        length=0.58,
        width=width,
        drive_front=0.5,  # one motor drives all wheels, and brakes them
        limits=VehicleLimits(
            steering_angle=0.4189,
            steering_rate=3.2,
            acceleration=acceleration,
            braking=acceleration,
            speed=20.0,
            power=m * acceleration * 7.319,
        ),
    )


RACER_1_10 = _racer()
"""The 1:10 car of F1TENTH; see the file for the source of each figure."""
