"""Where to linearise: about the last plan, along the reference, or not at all."""

from rumo.studies.linearization.study import LinearizationStudy, StartedNlp
from rumo.studies.linearization.sweeps import BASE, SWEEPS, Drive, Sweep

__all__ = ["BASE", "SWEEPS", "Drive", "LinearizationStudy", "StartedNlp", "Sweep"]
