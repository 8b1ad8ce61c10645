"""Where to linearise: about the last plan, along the reference, or not at all."""

from rumo.studies.linearization.corners import CORNER, CornerDrive
from rumo.studies.linearization.drives import BASE, Drive
from rumo.studies.linearization.study import LinearizationStudy, StartedNlp
from rumo.studies.linearization.sweeps import SWEEPS, Sweep

__all__ = ["BASE", "CORNER", "SWEEPS", "CornerDrive", "Drive", "LinearizationStudy", "StartedNlp", "Sweep"]
