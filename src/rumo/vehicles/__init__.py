"""Road vehicles: parameter sets, tyres, a prediction model and a plant."""

from rumo.vehicles.bicycle import dynamic_bicycle, friction_circles
from rumo.vehicles.errata import AsPrinted
from rumo.vehicles.four_wheel import four_wheel
from rumo.vehicles.parameters import PAPER_CAR, PASSENGER_CAR, TyreParameters, VehicleParameters
from rumo.vehicles.tyres import Dugoff, LinearTyre, ModifiedDugoff, SaturatingTyre, Tyre

__all__ = [
    "PAPER_CAR",
    "PASSENGER_CAR",
    "AsPrinted",
    "Dugoff",
    "LinearTyre",
    "ModifiedDugoff",
    "SaturatingTyre",
    "Tyre",
    "TyreParameters",
    "VehicleParameters",
    "dynamic_bicycle",
    "four_wheel",
    "friction_circles",
]
