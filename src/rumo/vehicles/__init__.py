"""Road vehicles: parameter sets, tyres, a prediction model and a plant."""

from rumo.vehicles.bicycle import dynamic_bicycle, friction_circles
from rumo.vehicles.coefficients import MagicFormulaCoefficients
from rumo.vehicles.commands import Acceleration, AxleTorques, RearTorque, SteeringAngle, SteeringRate, WheelTorques
from rumo.vehicles.errata import AsPrinted
from rumo.vehicles.filters import car_filter
from rumo.vehicles.four_wheel import four_wheel
from rumo.vehicles.limits import VehicleLimits
from rumo.vehicles.parameters import TyreParameters, VehicleParameters
from rumo.vehicles.problems import path_problem, trajectory_problem
from rumo.vehicles.rolling_bicycle import (
    frenet_bicycle,
    friction_ellipses,
    power_limit,
    rolling_bicycle,
    slip_limits,
    track_limits,
)
from rumo.vehicles.sets import (
    COMMONROAD_1,
    COMMONROAD_3,
    PAPER_CAR,
    PASSENGER_CAR,
    RACER_1_10,
    TYRE_235_60_R16,
    VEHICLES,
)
from rumo.vehicles.tyres import Dugoff, LinearTyre, MagicFormula, ModifiedDugoff, SaturatingTyre, Tyre, UpToPeak

__all__ = [
    "COMMONROAD_1",
    "COMMONROAD_3",
    "PAPER_CAR",
    "PASSENGER_CAR",
    "RACER_1_10",
    "TYRE_235_60_R16",
    "VEHICLES",
    "Acceleration",
    "AsPrinted",
    "AxleTorques",
    "Dugoff",
    "LinearTyre",
    "MagicFormula",
    "MagicFormulaCoefficients",
    "ModifiedDugoff",
    "RearTorque",
    "SaturatingTyre",
    "SteeringAngle",
    "SteeringRate",
    "Tyre",
    "TyreParameters",
    "UpToPeak",
    "VehicleLimits",
    "VehicleParameters",
    "WheelTorques",
    "car_filter",
    "dynamic_bicycle",
    "four_wheel",
    "frenet_bicycle",
    "friction_circles",
    "friction_ellipses",
    "path_problem",
    "power_limit",
    "rolling_bicycle",
    "slip_limits",
    "track_limits",
    "trajectory_problem",
]
