"""The models, discretisation schemes and controllers that come with Rumo, by name."""

from __future__ import annotations

from collections.abc import Callable

from rumo.controllers import Controller, DirectNlp, LinearTimeVarying, RealTimeIteration
from rumo.discretization import (
    Bdf2,
    Discretization,
    ExplicitEuler,
    Gauss2,
    ImplicitEuler,
    ImplicitMidpoint,
    Radau2,
    Radau3,
    Rk4,
    Sdirk2,
    Trapezoidal,
)
from rumo.model import Model
from rumo.textbook import cart_pendulum, robertson_dae, robertson_reactor, van_de_vusse_reactor
from rumo.vehicles import PAPER_CAR, dynamic_bicycle, four_wheel

MODELS: dict[str, Callable[[], Model]] = {
    "dynamic_bicycle": lambda: dynamic_bicycle(PAPER_CAR),
    "four_wheel": lambda: four_wheel(PAPER_CAR),
    "cart_pendulum": cart_pendulum,
    "robertson_reactor": robertson_reactor,
    "robertson_dae": robertson_dae,
    "van_de_vusse_reactor": van_de_vusse_reactor,
}
"""Model factories; the vehicles with the paper's parameters."""

DISCRETIZATIONS: dict[str, type[Discretization]] = {
    "implicit-euler": ImplicitEuler,
    "implicit-midpoint": ImplicitMidpoint,
    "trapezoidal": Trapezoidal,
    "bdf2": Bdf2,
    "sdirk2": Sdirk2,
    "radau2": Radau2,
    "radau3": Radau3,
    "gauss2": Gauss2,
    "explicit-euler": ExplicitEuler,
    "rk4": Rk4,
}
"""Discretisation schemes by their short names."""

CONTROLLERS: dict[str, type[Controller]] = {
    controller.name: controller for controller in (RealTimeIteration, DirectNlp, LinearTimeVarying)
}
"""Controller classes by their short names."""
