"""Plants that others wrote: equations, parameters and code independent of Rumo's. Their packages are extras."""

from rumo.simulation.plants.commonroad import CommonRoadCar

__all__ = ["CommonRoadCar"]
