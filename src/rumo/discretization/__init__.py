"""Discretisation schemes: one residual each."""

from rumo.discretization.base import Discretization
from rumo.discretization.implicit_euler import ImplicitEuler

__all__ = ["Discretization", "ImplicitEuler"]
