"""What goes wrong in a run: faults of sensors, actuators, clock, network and solver, as data."""

from rumo.simulation.faults.actuators import Biased, Saturated, Stuck, Weakened
from rumo.simulation.faults.base import Fault
from rumo.simulation.faults.clock import LateCommand, LostCommand, SkippedSample
from rumo.simulation.faults.sensors import Frozen, LateMeasurement, Missing, Offset, Reading
from rumo.simulation.faults.solver import Budget, Misinformed

__all__ = [
    "Biased",
    "Budget",
    "Fault",
    "Frozen",
    "LateCommand",
    "LateMeasurement",
    "LostCommand",
    "Misinformed",
    "Missing",
    "Offset",
    "Reading",
    "Saturated",
    "SkippedSample",
    "Stuck",
    "Weakened",
]
