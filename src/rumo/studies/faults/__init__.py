"""Bad samples in a row: what a drive makes of sensors, actuators, solvers and roads that fail for a while."""

from rumo.studies.faults.outcome import Drive
from rumo.studies.faults.study import BASE, FaultRun, FaultStudy
from rumo.studies.faults.troubles import FAULTS, Trouble

__all__ = ["BASE", "FAULTS", "Drive", "FaultRun", "FaultStudy", "Trouble"]
