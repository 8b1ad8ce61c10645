"""Road vehicles: parameter sets, tyres, a prediction model and a plant."""

from rumo.vehicles.bicycle import dynamic_bicycle, friction_circles
from rumo.vehicles.commands import Acceleration, AxleTorques, RearTorque, SteeringAngle, SteeringRate, WheelTorques
from rumo.vehicles.errata import AsPrinted
from rumo.vehicles.four_wheel import four_wheel
from rumo.vehicles.parameters import PAPER_CAR, PASSENGER_CAR, TyreParameters, VehicleParameters
from rumo.vehicles.rolling_bicycle import frenet_bicycle, friction_ellipses, rolling_bicycle, slip_limits
from rumo.vehicles.tyres import Dugoff, LinearTyre, ModifiedDugoff, SaturatingTyre, Tyre, UpToPeak

__all__ = [
    "PAPER_CAR",
    "PASSENGER_CAR",
    "Acceleration",
    "AsPrinted",
    "AxleTorques",
    "Dugoff",
    "LinearTyre",
    "ModifiedDugoff",
    "RearTorque",
    "SaturatingTyre",
    "SteeringAngle",
    "SteeringRate",
    "Tyre",
    "TyreParameters",
    "UpToPeak",
    "VehicleParameters",
    "WheelTorques",
    "dynamic_bicycle",
    "four_wheel",
    "frenet_bicycle",
    "friction_circles",
    "friction_ellipses",
    "rolling_bicycle",
    "slip_limits",
]
