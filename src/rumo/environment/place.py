"""Where a car is along a path."""

from __future__ import annotations

from rumo.references import PathTracking
from rumo.signals import NamedArray


class Place:
    """Where a car is along a path, followed from sample to sample.

    Parameters
    ----------
    reference : PathTracking
        Whose path it is, and where the car may be.
    step : float
        Farthest that a car gets from one sample to the next [m].
    """

    def __init__(self, reference: PathTracking, step: float) -> None:
        self._path, self._names = reference.path, reference.position
        self._window, self._step = reference.window, step

    def of(self, x: NamedArray[float], near: float | None) -> float:
        """Arc length [m], near another one, or the nearest of all on the side of the road that the car heads along."""
        if near is None:
            return self._path.project(self.position(x), heading=x["psi"])
        return self._path.nearest(*self.position(x), near - self._window, near + self._window + self._step)

    def position(self, x: NamedArray[float]) -> tuple[float, float]:
        """Of a car in this state [m]."""
        return x[self._names[0]], x[self._names[1]]

    def beside(self, x: NamedArray[float], s: float) -> tuple[float, float]:
        """Distance to the left of the path at s [m], and angle from its heading, within half a turn [rad]."""
        there = self._path.at(s)
        return float(there.left(*self.position(x))), float(there.turned(x["psi"]))
