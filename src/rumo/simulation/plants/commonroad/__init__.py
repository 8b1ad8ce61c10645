"""Cars of the CommonRoad vehicle models."""

from rumo.simulation.plants.commonroad.car import CommonRoadCar

__all__ = ["CommonRoadCar"]
