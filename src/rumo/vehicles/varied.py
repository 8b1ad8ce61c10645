"""Numbers of a car as parameters of its model: one model, however heavy the car is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from math import inf
from types import SimpleNamespace
from typing import Any

from rumo.checks import SMALLEST, as_names
from rumo.errors import ArgumentError, UnknownNameError
from rumo.model import Parameter
from rumo.vehicles.parameters import TyreParameters, VehicleParameters

POSITIVE, ANY_SIZE, SHARE = (SMALLEST, inf), (0.0, inf), (0.0, 1.0)


@dataclass(frozen=True)
class Variable:
    """A number of a car that can be a parameter of a model.

    Attributes
    ----------
    path : str
        Where `VehicleParameters` has it.
    unit : str
        Its unit.
    limits : tuple of float
        The least and the largest value that a car can have.
    """

    path: str
    unit: str
    limits: tuple[float, float] = POSITIVE

    def of(self, parameters: VehicleParameters) -> float | None:
        """The car's own."""
        value: Any = parameters
        for name in self.path.split("."):
            value = getattr(value, name)
        return value

    def parameter(self, parameters: VehicleParameters) -> Parameter:
        """Of a model, the car's own by default."""
        value = self.of(parameters)
        if value is None:
            raise ArgumentError("varied", f"{self.path!r} of a car with {self.path} = None", "numbers that the car has")
        return Parameter(self.unit, value, *self.limits)


VARIABLES: Mapping[str, Variable] = {
    "m": Variable("m", "kg"),
    "I": Variable("I", "kg m^2"),
    "l_f": Variable("l_f", "m"),
    "l_r": Variable("l_r", "m"),
    "t_w": Variable("t_w", "m"),
    "r": Variable("r", "m"),
    "J": Variable("J", "kg m^2"),
    "h": Variable("h", "m", ANY_SIZE),
    "b_lon": Variable("b_lon", "N s^2/m^2", ANY_SIZE),
    "b_lat": Variable("b_lat", "N s^2/m^2", ANY_SIZE),
    "drive_front": Variable("drive_front", "1", SHARE),
    "brake_front": Variable("brake_front", "1", SHARE),
    "front_C_s": Variable("front.C_s", "N"),
    "front_C_a": Variable("front.C_a", "N/rad"),
    "rear_C_s": Variable("rear.C_s", "N"),
    "rear_C_a": Variable("rear.C_a", "N/rad"),
}
"""Numbers of `VehicleParameters` by the names of parameters; those of tyres begin with their axle. Friction is a
parameter of all models, `mu`."""

OF_ALL_CARS = tuple(name for name in VARIABLES if name not in ("h", "drive_front", "brake_front"))
"""Those that every car has, whatever becomes of its loads and brakes."""


def varied_parameters(parameters: VehicleParameters, varied: object) -> dict[str, Parameter]:
    """Parameters of a model for chosen numbers of a car.

    Raises
    ------
    UnknownNameError
        If there is no such number.
    ArgumentError
        If the car does not have it.
    """
    names = as_names(varied, "varied")
    for name in names:
        if name not in VARIABLES:
            raise UnknownNameError("varied", name, VARIABLES)
    return {name: VARIABLES[name].parameter(parameters) for name in names}


def varied_car(parameters: VehicleParameters, p: Any, varied: object) -> VehicleParameters:
    """A car whose chosen numbers are expressions, the model's parameters p; the car itself if none are.

    Static loads and all else that a car computes of its numbers follow.
    """
    names = as_names(varied, "varied")
    if not names:
        return parameters
    symbols = {VARIABLES[name].path: p[name] for name in names}
    axles = {axle: _Numbers(getattr(parameters, axle), symbols, f"{axle}.") for axle in ("front", "rear")}
    car: Any = _Numbers(parameters, symbols | axles)
    return car


class _Numbers(SimpleNamespace):
    """A dataclass whose numbers may be expressions, which its own checks would refuse."""

    def __init__(self, of: VehicleParameters | TyreParameters, symbols: Mapping[str, Any], prefix: str = "") -> None:
        names = [item.name for item in fields(of)]
        super().__init__(**{name: symbols.get(prefix + name, getattr(of, name)) for name in names})
        self._of = type(of)

    def __getattr__(self, name: str) -> Any:
        computed: Any = getattr(vars(self)["_of"], name)  # a property, of these numbers
        return computed.fget(self)
