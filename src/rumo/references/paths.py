"""Paths through points, by their arc length."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers, finite_number, non_negative_number, positive_number
from rumo.errors import ArgumentError, ShapeError
from rumo.kernel import Curve
from rumo.references.clothoids import checked_curvature, clothoids
from rumo.references.pieces import Nodes, polynomials, with_straights
from rumo.references.splines import checked_points, spline
from rumo.signals import Array, read_only

TURN = 2.0 * np.pi
CLOSING = 1e-6
"""How far a closed path may end from where it began, as a share of its length, and how far its heading [rad]."""
AMBIGUOUS, FARTHEST = 0.01, 3.0
"""Distance that the right heading is worth: a share of the path's length, and at most so much [m]."""


class PathPoints(NamedTuple):
    """A path at n arc lengths, each (n,).

    Attributes
    ----------
    x, y : ndarray
        Position [m].
    heading : ndarray
        Direction of travel, not wrapped [rad].
    curvature, curvature_rate : ndarray
        Its derivative by arc length, positive to the left [1/m], and the next one [1/m^2].
    """

    x: Array
    y: Array
    heading: Array
    curvature: Array
    curvature_rate: Array

    def left(self, x: Array | float, y: Array | float) -> Array:
        """How far positions x, y [m] are to the left of the path's points [m]."""
        return np.cos(self.heading) * (y - self.y) - np.sin(self.heading) * (x - self.x)

    def turned(self, direction: Array | float) -> Array:
        """By how much directions [rad] differ from the path's, within half a turn [rad]."""
        return (direction - self.heading + np.pi) % TURN - np.pi


class Path:
    """A smooth path through points, by its true arc length: a spline with continuous curvature.

    An open path goes on straight beyond its ends. A closed one goes round and round, and its heading grows by its
    turning from lap to lap, so that it is continuous everywhere.

    Parameters
    ----------
    points : array_like, (n, 2)
        x and y, in the order of travel [m]. The last point of a closed path is not the first one; if it is, it is left
        out.
    closed : bool
        Whether it leads back from the last point to the first.
    smoothing : float
        Root mean square distance at which it may pass the points, for points with noise [m]; through all of them if 0.

    Attributes
    ----------
    length : float
        Of one lap if it is closed [m].
    closed : bool
        Whether it is.
    turning : float
        By how much the heading grows along it [rad]: of a closed path, a whole number of turns.
    nodes : ndarray, (m + 1,)
        Arc lengths between which it is a polynomial, from 0 to `length` [m].
    stations : ndarray, (n,)
        Arc lengths at the points that it was made of [m].

    Raises
    ------
    ArgumentError
        If a point is repeated or not finite, or the path would have to turn on the spot.
    ShapeError
        If points are no (n, 2) array of at least two points, three if closed.

    Notes
    -----
    Cubic by the length of chords, or a quintic smoothing spline (Dierckx's, `scipy.interpolate.splprep`); its arc
    length by Gauss's quadrature; then quintic Hermite pieces by arc length, so that position, heading and curvature are
    continuous, and the curvature is the derivative of the heading.
    """

    def __init__(self, points: ArrayLike, closed: bool = False, *, smoothing: float = 0.0) -> None:
        if not isinstance(closed, bool | np.bool_):
            raise ArgumentError("closed", repr(closed), "True or False")
        smooth = non_negative_number(smoothing, "smoothing")
        if smooth == np.inf:
            raise ArgumentError("smoothing", "inf", "a finite distance [m]")
        array = checked_points(points, bool(closed))
        self._lay(*spline(array, bool(closed), smooth), bool(closed))

    @classmethod
    def from_curvature(
        cls,
        stations: ArrayLike,
        curvature: ArrayLike,
        *,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        closed: bool = False,
    ) -> Path:
        """A path by its curvature, linear between stations: straights, arcs, and clothoids between them.

        Parameters
        ----------
        stations : array_like, (n,)
            Arc lengths, increasing [m]; the path's own begin with 0 at the first.
        curvature : array_like, (n,)
            At the stations, positive to the left [1/m].
        start : tuple of float
            Position and heading where it begins [m, m, rad].
        closed : bool
            Whether it ends where it began.

        Raises
        ------
        ArgumentError
            If stations do not increase, a curvature is not finite, or a closed path does not end where it began.
        """
        s, kappa = checked_curvature(stations, curvature)
        x, y, heading = (finite_number(value, "start") for value in start)
        path = cls.__new__(cls)
        path._lay(clothoids(s - s[0], kappa, (x, y, heading)), s - s[0], closed)
        return path

    def _lay(self, nodes: Nodes, stations: Array, closed: bool) -> None:
        self.closed, self.length = closed, float(nodes.s[-1])
        self.turning = float(nodes.heading[-1] - nodes.heading[0])
        if closed:
            self.turning = TURN * round(self.turning / TURN)
            nodes = _closed(nodes, self.turning)
        self.nodes, self.stations = read_only(nodes.s), read_only(stations)
        pieces = polynomials(nodes) if closed else with_straights(polynomials(nodes))
        self._curve = Curve(pieces.x, pieces.c, np.array([0.0, 0.0, self.turning, 0.0, 0.0]) if closed else None)
        self._gap = float(np.diff(nodes.s).max())
        self._at_nodes = PathPoints(*map(read_only, self.at(nodes.s)))

    def at(self, s: ArrayLike) -> PathPoints:
        """The path at arc lengths [m], of any shape; beyond a lap, or beyond the ends, too."""
        return PathPoints(*self._curve(s))

    def project(
        self, point: ArrayLike, near: float | None = None, *, window: float = 10.0, heading: float | None = None
    ) -> float:
        """Arc length of the path's nearest point.

        Parameters
        ----------
        point : array_like, (2,)
            x and y [m].
        near : float, optional
            Arc length about which to look, such as where the vehicle was a moment ago [m]; laps are counted on from
            there. All of the path, within one lap, if not given.
        window : float
            How far from `near` to look, forwards and backwards [m]. Less than half the length of the smallest loop,
            where a path crosses itself or comes close to itself; at most half a lap is looked at.
        heading : float, optional
            Direction of the vehicle, which decides between places about as near, such as at a crossing, if the whole
            path is looked at [rad].

        Returns
        -------
        float
            [m], the best there is within the window; NaN for a place that is not finite.
        """
        place = as_numbers(point, "point")
        if place.shape != (2,):
            raise ShapeError("point", f"shape {place.shape}", "shape (2,): x and y [m]")
        x, y = place.tolist()
        if not np.isfinite(place).all():
            return np.nan
        if near is None:
            s = self._anywhere(x, y, None if heading is None else finite_number(heading, "heading"))
            within = s % self.length if self.closed else s
            return 0.0 if self.closed and within == self.length else within  # a hair before the line
        middle, reach = finite_number(near, "near"), positive_number(window, "window")
        return self.nearest(x, y, middle - reach, middle + reach)

    def nearest(self, x: float, y: float, low: float, high: float) -> float:
        """Arc length of the nearest point between two arc lengths, unchecked [m]."""
        return self._curve.nearest(x, y, low, high)

    def _anywhere(self, x: float, y: float, heading: float | None) -> float:
        """Arc length of the nearest point of all, or of those about as near where the path has that heading [m]."""
        there = self._at_nodes
        distances = (there.x - x) ** 2 + (there.y - y) ** 2
        if heading is None:
            i = int(distances.argmin())
            # Its neighbours, and the straights beyond the ends of an open path.
            reach = self._gap + (0.0 if self.closed else float(np.sqrt(distances[i])))
        else:
            near = min(AMBIGUOUS * self.length, FARTHEST)
            i = int((distances + near**2 * (1.0 - np.cos(there.heading - heading))).argmin())
            reach = 2.0 * near
        s = float(self.nodes[i])
        return self.nearest(x, y, s - reach, s + reach)

    def offset(self, s: ArrayLike, distance: ArrayLike) -> Array:
        """Positions (n, 2) at distances to the left of the path's points at arc lengths, (n,) both [m]."""
        there = self.at(s)
        across = np.stack([-np.sin(there.heading), np.cos(there.heading)], axis=-1)
        return np.stack([there.x, there.y], axis=-1) + np.asarray(distance, dtype=float)[..., None] * across

    def __repr__(self) -> str:
        return f"Path(length={self.length:.6g}, closed={self.closed}, turning={self.turning:.4g})"


def _closed(nodes: Nodes, turning: float) -> Nodes:
    """The same with an end that is its beginning, to the last digit."""
    gap: Any = np.hypot(nodes.x[-1] - nodes.x[0], nodes.y[-1] - nodes.y[0])
    bend = nodes.heading[-1] - nodes.heading[0] - turning
    jump = nodes.curvature[-1] - nodes.curvature[0]
    if gap > CLOSING * nodes.s[-1] or abs(bend) > CLOSING or abs(jump) * nodes.s[-1] > CLOSING * TURN:
        raise ArgumentError(
            "closed",
            f"a path that ends {gap:.3g} m and {bend:.3g} rad from where it began, at a curvature {jump:.3g} 1/m off",
            "one that ends where and as it began",
        )
    x, y, heading, curvature = (values.copy() for values in (nodes.x, nodes.y, nodes.heading, nodes.curvature))
    x[-1], y[-1], heading[-1], curvature[-1] = x[0], y[0], heading[0] + turning, curvature[0]
    return nodes._replace(x=x, y=y, heading=heading, curvature=curvature)
