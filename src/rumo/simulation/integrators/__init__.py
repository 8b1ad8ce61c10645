"""What takes a model from one state to another: the C core's Radau method, and SUNDIALS."""

from rumo.simulation.integrators.base import Integrated, Integration
from rumo.simulation.integrators.radau import Radau
from rumo.simulation.integrators.sundials import Sundials

__all__ = ["Integrated", "Integration", "Radau", "Sundials"]
