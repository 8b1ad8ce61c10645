"""Discretisation schemes: one residual each."""

from rumo.discretization.base import Discretization
from rumo.discretization.bdf2 import Bdf2
from rumo.discretization.explicit_euler import ExplicitEuler
from rumo.discretization.gauss2 import Gauss2
from rumo.discretization.implicit_euler import ImplicitEuler
from rumo.discretization.implicit_midpoint import ImplicitMidpoint
from rumo.discretization.radau2 import Radau2
from rumo.discretization.radau3 import Radau3
from rumo.discretization.rk4 import Rk4
from rumo.discretization.sdirk2 import Sdirk2
from rumo.discretization.trapezoidal import Trapezoidal

__all__ = [
    "Bdf2",
    "Discretization",
    "ExplicitEuler",
    "Gauss2",
    "ImplicitEuler",
    "ImplicitMidpoint",
    "Radau2",
    "Radau3",
    "Rk4",
    "Sdirk2",
    "Trapezoidal",
]
