"""Where to linearise: about the last plan, along the reference, or not at all."""

from rumo.studies.linearization.study import BASE, SWEEPS, Drive, LinearizationStudy, StartedNlp, Sweep

__all__ = ["BASE", "SWEEPS", "Drive", "LinearizationStudy", "StartedNlp", "Sweep"]
