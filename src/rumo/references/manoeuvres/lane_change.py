"""Lane changes between cones: ISO 3888-1 and ISO 3888-2."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import non_negative_number, positive_number
from rumo.references.paths import Path
from rumo.references.race_line import minimum_curvature
from rumo.references.tracks import Track
from rumo.signals import Array

SPACING = 0.25
"""Of the points of a line between cones [m]."""


@dataclass(frozen=True)
class Lane:
    """Ground between two rows of cones.

    Attributes
    ----------
    begin, end : float
        Along the road, x [m].
    right, left : float
        Its edges, y [m].
    """

    begin: float
    end: float
    right: float
    left: float


@dataclass(frozen=True)
class LaneChange:
    """Lanes one after the other that a vehicle has to drive through without touching a cone.

    The first lane begins at the origin and leads along +x, in its middle; y is to the left.

    Parameters
    ----------
    name : str
        Of the manoeuvre.
    lanes : tuple of Lane
        In the order of travel.
    width : float
        Of the vehicle [m].
    """

    name: str
    lanes: tuple[Lane, ...]
    width: float

    @property
    def length(self) -> float:
        """From the first cone to the last [m]."""
        return self.lanes[-1].end

    def limits(self, x: ArrayLike) -> tuple[Array, Array]:
        """Edges right and left (n,) at places x (n,) along the road [m].

        Between two lanes any ground is free; there, these are the outer edges of both. Before the first lane and after
        the last one their edges go on.
        """
        return edges(self.lanes, np.asarray(x, dtype=float))

    def cones(self, spacing: float = 3.0) -> Array:
        """Positions (n, 2) of cones on both edges of every lane, at its ends and between, at most so far apart [m]."""
        gap, places = positive_number(spacing, "spacing"), list[Array]()
        for lane in self.lanes:
            x = np.linspace(lane.begin, lane.end, int(np.ceil((lane.end - lane.begin) / gap)) + 1)
            places += [np.column_stack([x, np.full_like(x, y)]) for y in (lane.right, lane.left)]
        return np.concatenate(places)

    def track(self, approach: float = 30.0, exit: float = 30.0) -> Track:
        """The same as a track about the straight y = 0, which begins at x = -approach and ends so far behind [m]."""
        return self._track(positive_number(approach, "approach"), positive_number(exit, "exit"), 0.0)

    def path(self, margin: float = 0.0, *, approach: float = 30.0, exit: float = 30.0) -> Path:
        """The line of least curvature on which the vehicle's middle touches no cone.

        Parameters
        ----------
        margin : float
            Between the vehicle's sides and the cones, at least [m]. Half the vehicle's width stays from the edges in
            any case; a long vehicle at an angle needs more, about half its length times the angle.
        approach, exit : float
            Length before the first lane and after the last [m]; arc lengths begin where the approach begins.

        Raises
        ------
        ArgumentError
            If the lanes have no room for it.
        """
        aside = 0.5 * self.width + non_negative_number(margin, "margin")
        track = self._track(positive_number(approach, "approach"), positive_number(exit, "exit"), SPACING)
        return minimum_curvature(track, aside, spacing=SPACING)

    def _track(self, approach: float, exit: float, longer: float) -> Track:
        """With lanes longer at both ends, so that a line is within also between its points."""
        lanes = tuple(Lane(lane.begin - longer, lane.end + longer, lane.right, lane.left) for lane in self.lanes)
        straight = Path.from_curvature((0.0, approach + self.length + exit), (0.0, 0.0), start=(-approach, 0.0, 0.0))
        return Track(straight, _Edge(lanes, approach, 1.0), _Edge(lanes, approach, -1.0), self.name)


@dataclass(frozen=True)
class _Edge:
    """Width to one side of a straight that begins at x = -approach, by its arc length."""

    lanes: tuple[Lane, ...]
    approach: float
    side: float

    def __call__(self, s: Array) -> Array:
        right, left = edges(self.lanes, s - self.approach)
        return left if self.side > 0.0 else -right


def edges(lanes: tuple[Lane, ...], x: Array) -> tuple[Array, Array]:
    """Edges right and left at places x along the road, see `LaneChange.limits`."""
    right, left = np.full_like(x, lanes[-1].right), np.full_like(x, lanes[-1].left)
    for lane, following in reversed(list(pairwise(lanes))):
        before = x < following.begin
        right[before], left[before] = min(lane.right, following.right), max(lane.left, following.left)
        before = x <= lane.end
        right[before], left[before] = lane.right, lane.left
    return right, left


def iso_3888_1(width: float) -> LaneChange:
    """Severe double lane change: 125 m, to a lane whose right edge is 3.5 m further left, and back.

    Parameters
    ----------
    width : float
        Of the vehicle without mirrors [m].

    Notes
    -----
    ISO 3888-1: sections of 15, 30, 25, 25, 15 and 15 m; lanes of 1.1 w + 0.25, 1.2 w + 0.25 and 1.3 w + 0.25 m. The
    offset of 3.5 m is taken between edges of the same side, and the last lane has the first one's right edge.
    """
    w = positive_number(width, "width")
    first, second, third = 1.1 * w + 0.25, 1.2 * w + 0.25, 1.3 * w + 0.25
    right = -0.5 * first
    lanes = (
        Lane(0.0, 15.0, right, right + first),
        Lane(45.0, 70.0, right + 3.5, right + 3.5 + second),
        Lane(95.0, 125.0, right, right + third),
    )
    return LaneChange("ISO 3888-1", lanes, w)


def iso_3888_2(width: float) -> LaneChange:
    """Obstacle avoidance ("moose test"): 61 m, to a lane 1 m to the left of the first one, and back.

    Parameters
    ----------
    width : float
        Of the vehicle without mirrors [m].

    Notes
    -----
    ISO 3888-2: sections of 12, 13.5, 11, 12.5 and 12 m; lanes of 1.1 w + 0.25, w + 1 and 1.3 w + 0.25 m, the last at
    least 3 m. The left edges of the first and the last lane are in line, the right edge of the middle one is 1 m away.
    """
    w = positive_number(width, "width")
    first, second, third = 1.1 * w + 0.25, w + 1.0, max(1.3 * w + 0.25, 3.0)
    left = 0.5 * first
    lanes = (
        Lane(0.0, 12.0, left - first, left),
        Lane(25.5, 36.5, left + 1.0, left + 1.0 + second),
        Lane(49.0, 61.0, left - third, left),
    )
    return LaneChange("ISO 3888-2", lanes, w)
