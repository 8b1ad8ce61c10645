"""How far the edges of a track are from another line along it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rumo.references.paths import Path
from rumo.signals import Array

if TYPE_CHECKING:
    from rumo.references.tracks import Track

STRIDE = 0.25
"""Steps along a normal to the line until an edge is behind [m]."""
HALVINGS = 10
"""Of the step in which the edge is."""
FURTHEST = 50.0
"""How far away an edge is looked for [m]."""


def widths_about(track: Track, line: Path, s: Array) -> tuple[Array, Array]:
    """Distances (n,) from a line to the left and to the right edge of a track, along its normals at s (n,) [m].

    Negative where the line is outside, NaN where there is no edge within 50 m.
    """
    places, found = line.at(s), np.empty((2, len(s)))
    near = track.path.project((places.x[0], places.y[0]), heading=float(places.heading[0]))
    for i, (x, y, heading) in enumerate(zip(places.x, places.y, places.heading, strict=True)):
        near = track.path.project((x, y), near)
        here = track.path.at(near)
        for side, (sign, limit) in enumerate(zip((1.0, -1.0), track.limits(near), strict=True)):
            ray = _Ray(track, x, y, -sign * np.sin(heading), sign * np.cos(heading), near, side)
            found[side, i] = ray.length(float(limit) - sign * float(here.left(x, y)))
    return found[0], found[1]


@dataclass(frozen=True)
class _Ray:
    """A normal to a line, to one side of it, that meets the edge of a track somewhere."""

    track: Track
    x: float
    y: float
    to_x: float
    to_y: float
    near: float
    side: int

    def within(self, distance: float) -> bool:
        """Whether the edge is further away."""
        x, y = self.x + distance * self.to_x, self.y + distance * self.to_y
        path = self.track.path
        there = path.project((x, y), self.near, window=20.0)
        aside = float(path.at(there).left(x, y))
        return (-aside if self.side else aside) <= float(self.track.limits(there)[self.side])

    def length(self, guess: float) -> float:
        """Distance to the edge [m], by a guess: what it is where both lines are parallel."""
        low, high = guess - 0.5 * STRIDE, guess + 0.5 * STRIDE
        while not self.within(low):
            low, high = low - STRIDE, low
            if low < -FURTHEST:
                return np.nan
        while self.within(high):
            low, high = high, high + STRIDE
            if high > FURTHEST:
                return np.nan
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.within(middle) else (low, middle)
        return low
