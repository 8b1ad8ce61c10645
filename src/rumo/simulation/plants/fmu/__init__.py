"""Functional mock-up units (FMI): plants that any simulation tool may have exported."""

from rumo.simulation.plants.fmu.plant import FmuPlant
from rumo.simulation.plants.fmu.ports import Port

__all__ = ["FmuPlant", "Port"]
