"""Bad samples in a row: what a drive makes of sensors and solvers that fail for a moment."""

from rumo.studies.faults.study import BASE, FaultRun, FaultStudy
from rumo.studies.faults.troubles import FAULTS, Drive, Trouble

__all__ = ["BASE", "FAULTS", "Drive", "FaultRun", "FaultStudy", "Trouble"]
