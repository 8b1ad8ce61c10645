"""A path followed from where the vehicle is on it, not from where the clock says it should be."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from rumo.checks import as_names, positive_number
from rumo.errors import ArgumentError, UnknownNameError
from rumo.references.base import OfTime, Preview, of_time
from rumo.signals import Array, NamedArray

POINTS = 101


@dataclass(frozen=True)
class Following:
    """The part of a path that lies ahead of its point nearest to the vehicle, at the path's own speed.

    Parameters
    ----------
    path : callable
        Times (n,) [s] -> values (n,) of each signal: a `SinePath`, or any function of times.
    position : tuple of str
        States of the controller's model that say where the vehicle is, signals of the path too.
    window : float
        How far the vehicle may be ahead of the clock or behind it [s]; where the path crosses itself, less than the
        time from one crossing to the next.
    """

    path: Callable[[Array], Mapping[str, Array]]
    position: tuple[str, ...] = ("p_x", "p_y")
    window: float = 5.0
    _path: OfTime = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if isinstance(self.path, type) or not callable(self.path):
            raise ArgumentError("path", repr(self.path), "a function of times such as SinePath(amplitude=3.0)")
        if not as_names(self.position, "position"):
            raise ArgumentError("position", "no names", 'some such as ("p_x", "p_y")')
        positive_number(self.window, "window")
        object.__setattr__(self, "_path", of_time(self.path, "path"))

    def preview(self, times: Array, x: NamedArray[float]) -> Preview:
        """Signals ahead, see `Reference`."""
        place = x.values[[x.signals.index(name, "position") for name in self.position]]
        now = times[0]
        if np.isfinite(place).all():
            now = self._nearest(times[0], place)
        return Preview(self._path(now + (times - times[0])))

    def _nearest(self, clock: float, place: Array) -> float:
        """Time of the path's nearest point, to a microsecond or so: the best of a few points, again and again."""
        middle, reach = clock, self.window
        while reach > 1e-6:
            times = np.linspace(middle - reach, middle + reach, POINTS)
            middle = float(times[np.argmin(self._distances(times, place))])
            reach *= 4.0 / POINTS
        return middle

    def _distances(self, times: Array, place: Array) -> Array:
        path = self._path(times)
        for name in self.position:
            if name not in path:
                raise UnknownNameError("position", name, path)
        return np.linalg.norm(np.column_stack([path[name] for name in self.position]) - place, axis=1)
