"""What goes wrong in a run: faults of sensors, actuators, clock, network, solver and plant, as data."""

from rumo.simulation.faults.actuators import Biased, Saturated, Slow, Stuck, Weakened
from rumo.simulation.faults.base import Fault
from rumo.simulation.faults.clock import LateCommand, LostCommand, SkippedSample
from rumo.simulation.faults.kinds import KINDS, make_fault
from rumo.simulation.faults.outliers import Outliers
from rumo.simulation.faults.plant import Changed, Disturbed
from rumo.simulation.faults.sensors import (
    Drift,
    Dropout,
    Frozen,
    LateMeasurement,
    Missing,
    Noisy,
    Offset,
    Reading,
    Scaled,
    Swapped,
)
from rumo.simulation.faults.solver import Budget, Misinformed

__all__ = [
    "KINDS",
    "Biased",
    "Budget",
    "Changed",
    "Disturbed",
    "Drift",
    "Dropout",
    "Fault",
    "Frozen",
    "LateCommand",
    "LateMeasurement",
    "LostCommand",
    "Misinformed",
    "Missing",
    "Noisy",
    "Offset",
    "Outliers",
    "Reading",
    "Saturated",
    "Scaled",
    "SkippedSample",
    "Slow",
    "Stuck",
    "Swapped",
    "Weakened",
    "make_fault",
]
