"""What can be said of a loop before it is closed."""

from rumo.analysis.damping import LoopDamping, damping

__all__ = ["LoopDamping", "damping"]
