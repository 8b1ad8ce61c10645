"""Cars to be driven, by name: what stands in for reality, and what a prediction of it needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rumo.checks import checked
from rumo.errors import ArgumentError, UnknownNameError
from rumo.simulation import Plant
from rumo.simulation.plants import CommonRoadCar
from rumo.simulation.plants.commonroad.car import CARS
from rumo.vehicles import (
    VEHICLES,
    Acceleration,
    ModifiedDugoff,
    RearTorque,
    VehicleParameters,
    dynamic_bicycle,
    four_wheel,
)

OWN = ("four-wheel", "bicycle")
COMMONROAD = "commonroad-"
MODELS = ("ks", "st", "std", "mb")
PLANTS = (*OWN, *(f"{COMMONROAD}{model}" for model in MODELS))
"""Names; those of CommonRoad also with the number of a car, "commonroad-mb:2"."""
USUAL = "passenger"
"""The car that is driven if none is named."""


@dataclass(frozen=True, eq=False)
class DrivenCar:
    """A plant, and how to tell it where to go.

    Attributes
    ----------
    plant : Plant or PlantLike
        That is driven.
    drive : RearTorque or Acceleration
        What it is told along its way.
    car : VehicleParameters
        As it is predicted.
    """

    plant: Any
    drive: RearTorque | Acceleration
    car: VehicleParameters

    def start(self, motion: Mapping[str, float]) -> dict[str, float]:
        """Its state in a motion p_x, p_y, psi, v_x, v_y, omega, delta, with wheels that roll."""
        if hasattr(self.plant, "start"):
            return dict(self.plant.start(**motion))
        known = {name: motion.get(name, 0.0) for name in self.plant.states}
        return known | {name: motion["v_x"] / self.car.r for name in known if name.startswith("w_")}


def split(name: str) -> tuple[str, int | None]:
    """Name of a plant, and the number of a car that may stand behind it; raises for what is no such name."""
    kind, colon, number = name.partition(":")
    if kind not in PLANTS:
        raise UnknownNameError("plant", name, PLANTS)
    if not colon:
        return kind, None
    if kind in OWN or number not in {str(known) for known in CARS}:
        expected = f"{kind}, whose car is the vehicle" if kind in OWN else f"{kind}:1, {kind}:2 or {kind}:3"
        raise ArgumentError("plant", repr(name), expected)
    return kind, int(number)


def usual_vehicle(plant: str) -> str:
    """Name of the car that is driven where a plant is named and no vehicle."""
    number = split(plant)[1]
    return USUAL if number is None else CARS[number]


def driven_car(plant: str, car: VehicleParameters, sampling_time: float, varied: Sequence[str] = ()) -> DrivenCar:
    """A plant by name.

    Parameters
    ----------
    plant : str
        One of `PLANTS`. Loads of "four-wheel" follow accelerations if the car has a height. CommonRoad's are cars of
        their own: the number behind a colon says which; without, it is the one that `car` is.
    car : VehicleParameters
        The car.
    sampling_time : float
        For which inputs are held [s].
    varied : sequence of str
        Numbers of the car that are parameters of "four-wheel", see there.

    Raises
    ------
    ArgumentError
        If the name is unknown, or the car is none of CommonRoad's.
    """
    kind, number = split(plant)
    if kind == "bicycle":
        return DrivenCar(Plant(dynamic_bicycle(car, ModifiedDugoff()), sampling_time), RearTorque(), car)
    if kind == "four-wheel":
        return DrivenCar(
            Plant(four_wheel(car, load_transfer=car.h > 0.0, varied=varied), sampling_time), RearTorque(), car
        )
    if number is None:
        number = next((known for known, name in CARS.items() if VEHICLES[name] == car), None)
        if number is None:
            raise ArgumentError(
                "plant",
                f"{plant!r} with a vehicle that is none of CommonRoad's",
                f"one of {', '.join(CARS.values())}, or a number",
                f"Write {kind}:2 for a BMW 320i, or drive the vehicle by four-wheel.",
            )
    driven = CommonRoadCar(kind.removeprefix(COMMONROAD), number, sampling_time=sampling_time)
    return DrivenCar(driven, Acceleration(), checked(driven.car, "plant.car", VehicleParameters))
