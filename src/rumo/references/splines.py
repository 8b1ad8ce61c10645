"""Smooth curves through points, or close to them, by their true arc length."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from scipy.interpolate import BSpline, CubicSpline, splprep

from rumo.checks import as_numbers
from rumo.errors import ArgumentError, ShapeError
from rumo.references.pieces import Nodes, polynomials
from rumo.signals import Array

NODES, SHARES = np.polynomial.legendre.leggauss(6)
TOLERANCE = 1e-7
"""How far the position's derivative by arc length may be from the unit vector along the heading."""
MOST = 256
"""Pieces between two points."""
CUSP = "A sharp turn needs more points, or smoothing=... [m]; a car can't turn on the spot."


def checked_points(points: object, closed: bool) -> Array:
    """Points (n, 2), finite, none like the one before it; of a closed curve without the first at the end again."""
    array = as_numbers(points, "points")
    if array.ndim != 2 or array.shape[1] != 2:
        raise ShapeError("points", f"shape {array.shape}", "shape (n, 2): x and y [m]")
    if not np.isfinite(array).all():
        row = int(np.argmin(np.isfinite(array).all(axis=1)))
        raise ArgumentError(f"points[{row}]", f"{array[row].tolist()}", "finite numbers [m]")
    if closed and len(array) > 1 and (array[0] == array[-1]).all():
        array = array[:-1]
    least = 3 if closed else 2
    if len(array) < least:
        raise ShapeError("points", f"{len(array)}", f"at least {least} of a{' closed' if closed else 'n open'} path")
    same = np.flatnonzero((np.diff(array, axis=0) == 0.0).all(axis=1))
    if len(same):
        row = int(same[0]) + 1
        raise ArgumentError(
            f"points[{row}]", f"{array[row].tolist()}, as the point before", "another point", "Leave one of them out."
        )
    return array


def spline(points: Array, closed: bool, smoothing: float) -> tuple[Nodes, Array]:
    """Nodes of a spline through points (n, 2), and the arc lengths (n,) of the curve at these.

    Cubic by the length of chords, or, with smoothing, a quintic of as few pieces as come within a root mean square
    distance [m] of the points; then by arc length, in as many pieces as it takes.
    """
    if smoothing:
        curve, knots, at_points = _smoothed(points, closed, smoothing)
    else:
        curve, knots, at_points = _interpolated(points, closed)
    pieces = 2
    while True:
        tau = _between(knots, pieces)
        nodes, deviation = _by_length(curve, tau)
        if deviation <= TOLERANCE:
            break
        pieces *= 2
        if pieces > MOST:
            place = curve(tau[np.argmax(np.abs(nodes.curvature))])
            raise ArgumentError(
                "points", f"a turn on the spot at ({place[0]:.4g}, {place[1]:.4g})", "points of a smooth line", CUSP
            )
    return nodes, np.interp(at_points, tau, nodes.s)


def _interpolated(points: Array, closed: bool) -> tuple[Any, Array, Array]:
    """Curve by a parameter, its knots, and the points' parameters."""
    every = np.vstack([points, points[:1]]) if closed else points
    tau = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(every, axis=0), axis=1))]
    curve = CubicSpline(tau, every, bc_type="periodic" if closed else "not-a-knot")
    return curve, tau, tau[: len(points)]


def _smoothed(points: Array, closed: bool, smoothing: float) -> tuple[Any, Array, Array]:
    every = np.vstack([points, points[:1]]) if closed else points
    tau = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(every, axis=0), axis=1))]
    degree = min(5, len(every) - 1)
    with warnings.catch_warnings():
        warnings.simplefilter(
            "ignore", RuntimeWarning
        )  # fewer knots than it would take: the curve is as close as can be
        (t, c, k), _ = splprep(every.T, u=tau, s=len(points) * smoothing**2, k=degree, per=closed)
    curve = BSpline(t, np.column_stack(c), k)
    return curve, np.unique(t[k : len(t) - k]), tau[: len(points)]


def _between(knots: Array, pieces: int) -> Array:
    """The knots, with each interval in so many pieces."""
    shares = np.arange(pieces) / pieces
    return np.r_[(knots[:-1, None] + np.diff(knots)[:, None] * shares).ravel(), knots[-1]]


def _by_length(curve: Any, tau: Array) -> tuple[Nodes, float]:
    """Nodes at parameters tau, and how far the derivative by arc length is from the direction between them."""
    step = np.diff(tau)
    inner = tau[:-1] + 0.5 * np.multiply.outer(1.0 + NODES, step)
    lengths = 0.5 * step * (SHARES @ np.linalg.norm(curve(inner, 1), axis=2))
    s = np.r_[0.0, np.cumsum(lengths)]
    position, first, second = curve(tau), curve(tau, 1), curve(tau, 2)
    speed = np.linalg.norm(first, axis=1)
    heading = np.unwrap(np.arctan2(first[:, 1], first[:, 0]))
    with np.errstate(divide="ignore", invalid="ignore"):
        curvature = _cross(first, second) / speed**3
        third = curve(np.stack([tau[:-1] + 1e-6 * step, tau[1:] - 1e-6 * step]), 3)  # it jumps at knots
        ends = [np.stack([values[:-1], values[1:]]) for values in (first, second, speed, curvature)]
        slope = _cross(ends[0], third) / ends[2] ** 3 - 3.0 * ends[3] * (ends[0] * ends[1]).sum(-1) / ends[2] ** 2
        nodes = Nodes(s, position[:, 0], position[:, 1], heading, curvature, slope / ends[2])
    if not (np.isfinite(nodes.rates).all() and np.isfinite(curvature).all()):
        return nodes, np.inf
    pieces, inside = polynomials(nodes), s[:-1] + 0.28 * lengths  # in the middle the error is 0
    values: Any = pieces(inside)
    slopes: Any = pieces(inside, 1)
    turned = np.abs(slopes[:, 2] * lengths).max()  # more than half a turn within a piece would be lost
    deviation = np.hypot(slopes[:, 0] - np.cos(values[:, 2]), slopes[:, 1] - np.sin(values[:, 2])).max()
    return nodes, float(deviation) if turned < 1.0 else np.inf


def _cross(a: Any, b: Any) -> Any:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
