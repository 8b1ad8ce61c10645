"""Textbook models that are not vehicles."""

from rumo.textbook.cart_pendulum import cart_pendulum
from rumo.textbook.gas_pipeline import gas_pipeline
from rumo.textbook.heat_rod import heat_rod
from rumo.textbook.mass_chain import mass_chain
from rumo.textbook.robertson import robertson_dae, robertson_reactor
from rumo.textbook.tubular_reactor import tubular_reactor
from rumo.textbook.van_de_vusse import van_de_vusse_reactor
from rumo.textbook.van_der_pol import van_der_pol

__all__ = [
    "cart_pendulum",
    "gas_pipeline",
    "heat_rod",
    "mass_chain",
    "robertson_dae",
    "robertson_reactor",
    "tubular_reactor",
    "van_de_vusse_reactor",
    "van_der_pol",
]
