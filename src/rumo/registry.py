"""The models, discretisation schemes and controllers that come with Rumo, by name."""

from __future__ import annotations

from collections.abc import Callable

from rumo import discretization as schemes
from rumo.controllers import DirectNlp, LinearTimeVarying, RealTimeIteration
from rumo.model import Model
from rumo.textbook import (
    cart_pendulum,
    gas_pipeline,
    heat_rod,
    mass_chain,
    robertson_dae,
    robertson_reactor,
    tubular_reactor,
    van_de_vusse_reactor,
    van_der_pol,
)
from rumo.vehicles import PAPER_CAR, dynamic_bicycle, four_wheel

MODELS: dict[str, Callable[[], Model]] = {
    "dynamic_bicycle": lambda: dynamic_bicycle(PAPER_CAR),
    "four_wheel": lambda: four_wheel(PAPER_CAR),
    "cart_pendulum": cart_pendulum,
    "robertson_reactor": robertson_reactor,
    "robertson_dae": robertson_dae,
    "van_de_vusse_reactor": van_de_vusse_reactor,
    "van_der_pol": van_der_pol,
    "heat_rod": heat_rod,
    "tubular_reactor": tubular_reactor,
    "mass_chain": mass_chain,
    "gas_pipeline": gas_pipeline,
}
"""Model factories; the vehicles with the paper's parameters, those in many equal parts with few of them."""

DISCRETIZATIONS: dict[str, type[schemes.Discretization]] = {
    "implicit-euler": schemes.ImplicitEuler,
    "implicit-midpoint": schemes.ImplicitMidpoint,
    "trapezoidal": schemes.Trapezoidal,
    "bdf2": schemes.Bdf2,
    "sdirk2": schemes.Sdirk2,
    "radau2": schemes.Radau2,
    "radau3": schemes.Radau3,
    "gauss2": schemes.Gauss2,
    "explicit-euler": schemes.ExplicitEuler,
    "rk4": schemes.Rk4,
}
"""Discretisation schemes by their short names."""

CONTROLLERS: dict[str, type[RealTimeIteration] | type[DirectNlp] | type[LinearTimeVarying]] = {
    "rti": RealTimeIteration,
    "nlp": DirectNlp,
    "ltv": LinearTimeVarying,
}
"""Controller classes by their short names."""
