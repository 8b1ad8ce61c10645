"""Textbook models that are not vehicles."""

from rumo.textbook.cart_pendulum import cart_pendulum
from rumo.textbook.robertson import robertson_dae, robertson_reactor
from rumo.textbook.van_de_vusse import van_de_vusse_reactor
from rumo.textbook.van_der_pol import van_der_pol

__all__ = ["cart_pendulum", "robertson_dae", "robertson_reactor", "van_de_vusse_reactor", "van_der_pol"]
