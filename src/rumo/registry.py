"""The models and controllers that come with Rumo, by name."""

from __future__ import annotations

from collections.abc import Callable

from rumo.controllers import Controller, DirectNlp, LinearTimeVarying, RealTimeIteration
from rumo.model import Model
from rumo.textbook import cart_pendulum, robertson_reactor, van_de_vusse_reactor
from rumo.vehicles import PAPER_CAR, dynamic_bicycle, four_wheel

MODELS: dict[str, Callable[[], Model]] = {
    "dynamic_bicycle": lambda: dynamic_bicycle(PAPER_CAR),
    "four_wheel": lambda: four_wheel(PAPER_CAR),
    "cart_pendulum": cart_pendulum,
    "robertson_reactor": robertson_reactor,
    "van_de_vusse_reactor": van_de_vusse_reactor,
}
"""Model factories; the vehicles with the paper's parameters."""

CONTROLLERS: dict[str, type[Controller]] = {
    controller.name: controller for controller in (RealTimeIteration, DirectNlp, LinearTimeVarying)
}
"""Controller classes by their short names."""
