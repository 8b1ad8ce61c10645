"""Closed loop: a plant, disturbances, sensors, faults, a clock and a log."""

from rumo.interrupts import Interrupted
from rumo.simulation import faults
from rumo.simulation.foreign import PlantLike
from rumo.simulation.log import load, save
from rumo.simulation.loop import ClosedLoop
from rumo.simulation.moment import Moment
from rumo.simulation.monitors import DelayWatch
from rumo.simulation.place import ByPlace, DisturbanceByState, Patch
from rumo.simulation.plant import Plant
from rumo.simulation.recorder import Recorder
from rumo.simulation.sample import Sample
from rumo.simulation.scenario import Scenario, simulate
from rumo.simulation.sensors import Sensors
from rumo.simulation.wind import Constant, Disturbance, Gust, OrnsteinUhlenbeck, RandomWalk

__all__ = [
    "ByPlace",
    "ClosedLoop",
    "Constant",
    "DelayWatch",
    "Disturbance",
    "DisturbanceByState",
    "Gust",
    "Interrupted",
    "Moment",
    "OrnsteinUhlenbeck",
    "Patch",
    "Plant",
    "PlantLike",
    "RandomWalk",
    "Recorder",
    "Sample",
    "Scenario",
    "Sensors",
    "faults",
    "load",
    "save",
    "simulate",
]
