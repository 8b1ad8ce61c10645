"""The car of the paper."""

from __future__ import annotations

from math import radians

from rumo.vehicles.limits import VehicleLimits
from rumo.vehicles.parameters import TyreParameters, VehicleParameters

_TYRE = TyreParameters(C_s=600_000.0, C_a=250_000.0, mu=0.9)

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
    front=_TYRE,
    rear=_TYRE,
    # 300 N m on each of two wheels of 0.6 m: 5 m/s^2.
    limits=VehicleLimits(steering_angle=radians(45.0), steering_rate=1.5, acceleration=5.0, braking=5.0),
)
"""Table 1 of the paper, with the bounds of its section on results; it gives no height, length, width, speed or power.

The tyres are some fifty times stiffer than ordinary ones; the table is kept for its study.
"""
