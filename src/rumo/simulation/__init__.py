"""Closed loop: a plant, disturbances, sensors, a clock and a log."""

from rumo.simulation.log import load, save
from rumo.simulation.loop import simulate
from rumo.simulation.plant import Plant
from rumo.simulation.sensors import Sensors
from rumo.simulation.wind import Constant, Disturbance, Gust, OrnsteinUhlenbeck, RandomWalk

__all__ = [
    "Constant",
    "Disturbance",
    "Gust",
    "OrnsteinUhlenbeck",
    "Plant",
    "RandomWalk",
    "Sensors",
    "load",
    "save",
    "simulate",
]
