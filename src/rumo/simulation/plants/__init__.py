"""Plants that others wrote: equations, parameters and code independent of Rumo's. Their packages are extras."""

from rumo.simulation.plants.commonroad import CommonRoadCar
from rumo.simulation.plants.fmu import FmuPlant, Port

__all__ = ["CommonRoadCar", "FmuPlant", "Port"]
