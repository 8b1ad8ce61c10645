"""One drive in which somebody else decides."""

from __future__ import annotations

import numpy as np

from rumo.environment.place import Place
from rumo.plan import Plan
from rumo.signals import Array, NamedArray
from rumo.simulation import ClosedLoop, Sample
from rumo.simulation.moment import Moment


class Episode:
    """A run of a closed loop, and where the car is.

    Attributes
    ----------
    moment : Moment
        For which a command is asked.
    sample : Sample or None
        The one before.
    seen : NamedArray
        Estimated state of the observed model; where it is not finite, the last that was.
    progress : float
        True arc length, counted on from lap to lap [m].
    deviation : float
        True distance to the left of the path [m].
    trail : list of tuple of float
        True positions [m].
    """

    def __init__(self, loop: ClosedLoop, place: Place) -> None:
        self._samples, self._place = loop.moments(), place
        self.sample: Sample | None = None
        self.trail: list[tuple[float, float]] = []
        self.seen: NamedArray[float] = NamedArray(loop.observed.states, np.zeros(len(loop.observed.states)))
        self._meet(None)

    def plan(self) -> Plan | None:
        """What the controller would do now."""
        if self._planned is None:
            self._planned = (self.moment.plan(),)
        return self._planned[0]

    def go_on(self, command: Array) -> None:
        """Until the next command is asked for.

        Raises
        ------
        PlantError
            If the plant cannot go on.
        """
        self.sample = self._samples.send(command)
        self._meet(self.progress)

    def close(self) -> None:
        """End it."""
        self._samples.close()

    def _meet(self, near: float | None) -> None:
        self.moment: Moment = next(self._samples)
        self._planned: tuple[Plan | None] | None = None
        seen, true = self.moment.observed.values, self.moment.true
        self.seen = NamedArray(self.seen.signals, np.where(np.isfinite(seen), seen, self.seen.values))
        self.progress = self._place.of(true, near)
        self.deviation, _ = self._place.beside(true, self.progress)
        self.trail.append(self._place.position(true))
