"""References: what the tracked outputs should do over time."""

from rumo.references.trajectories import Reference, SinePath, constant

__all__ = ["Reference", "SinePath", "constant"]
