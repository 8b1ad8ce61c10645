"""Cars, each with the sources of its numbers, and all of them by name."""

from collections.abc import Mapping
from types import MappingProxyType

from rumo.vehicles.parameters import VehicleParameters
from rumo.vehicles.sets.commonroad import COMMONROAD_1, COMMONROAD_3, PASSENGER_CAR, TYRE_235_60_R16
from rumo.vehicles.sets.paper import PAPER_CAR
from rumo.vehicles.sets.racer import RACER_1_10

VEHICLES: Mapping[str, VehicleParameters] = MappingProxyType(
    {
        "paper": PAPER_CAR,
        "passenger": PASSENGER_CAR,
        "racer": RACER_1_10,
        "commonroad-1": COMMONROAD_1,
        "commonroad-3": COMMONROAD_3,
    }
)
"""Cars by their short names."""

__all__ = [
    "COMMONROAD_1",
    "COMMONROAD_3",
    "PAPER_CAR",
    "PASSENGER_CAR",
    "RACER_1_10",
    "TYRE_235_60_R16",
    "VEHICLES",
]
