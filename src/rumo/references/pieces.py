"""A curve by its arc length, piece after piece: what paths are made of, wherever their shape comes from."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import PPoly

from rumo.kernel import Curve
from rumo.signals import Array


class Nodes(NamedTuple):
    """Where the m pieces of a curve meet.

    Attributes
    ----------
    s, x, y, heading, curvature : ndarray, shape (m + 1,)
        Arc length, position [m], direction of travel, not wrapped [rad], and its derivative [1/m].
    rates : ndarray, shape (2, m)
        Derivative of the curvature where each piece begins and where it ends [1/m^2].
    """

    s: Array
    x: Array
    y: Array
    heading: Array
    curvature: Array
    rates: Array


def polynomials(nodes: Nodes) -> PPoly:
    """Position, heading, curvature and its rate (5,) by arc length: quintic, twice differentiable at the nodes.

    The curvature is the heading's derivative, exactly; the position's derivative is a unit vector to 1e-7 or so.
    """
    h = np.diff(nodes.s)
    cosine, sine = np.cos(nodes.heading), np.sin(nodes.heading)
    x = _quintic(h, nodes.x, cosine, -nodes.curvature * sine)
    y = _quintic(h, nodes.y, sine, nodes.curvature * cosine)
    heading = _quintic(h, nodes.heading, nodes.curvature, nodes.rates)
    curvature = _derivative(heading)
    return PPoly(np.stack([x, y, heading, curvature, _derivative(curvature)], axis=2), nodes.s)


def with_straights(pieces: PPoly) -> PPoly:
    """The same with a straight before the beginning, and one after the end, of any length."""
    ends: Any = pieces.c[:, [0, -1]]
    s = np.r_[pieces.x[0], pieces.x[-1]]
    values = Curve(pieces.x, pieces.c)(s)  # to the last digit as the path itself will be
    straights = np.zeros_like(ends)
    straights[4, :, 0], straights[4, :, 1] = np.cos(values[2]), np.sin(values[2])
    straights[5, :, :3] = values[:3].T
    straights[5, 0] -= straights[4, 0]  # it begins a metre before
    c = np.concatenate([straights[:, :1], pieces.c, straights[:, 1:]], axis=1)
    # The end itself is still of the path.
    return PPoly(c, np.r_[s[0] - 1.0, pieces.x[:-1], np.nextafter(s[1], np.inf), s[1] + 1.0])


def _quintic(h: Array, value: Array, slope: Array, second: Array) -> Array:
    """Coefficients (6, m) by value, slope and second derivative at the ends of pieces of lengths h (m,)."""
    begin, end = second if second.ndim == 2 else (second[:-1], second[1:])
    by_value = (np.diff(value) - (slope[:-1] + 0.5 * begin * h) * h) / h**3
    by_slope = (np.diff(slope) - begin * h) / h**2
    by_second = 0.5 * (end - begin) / h
    return np.stack(
        [
            (6.0 * by_value - 3.0 * by_slope + by_second) / h**2,
            (-15.0 * by_value + 7.0 * by_slope - 2.0 * by_second) / h,
            10.0 * by_value - 4.0 * by_slope + by_second,
            0.5 * begin,
            slope[:-1],
            value[:-1],
        ]
    )


def _derivative(coefficients: Array) -> Array:
    """Coefficients of the derivative of polynomials of degree 5 (6, m), highest power first."""
    powers = np.arange(5.0, 0.0, -1.0)[:, None]
    return np.concatenate([np.zeros_like(coefficients[:1]), powers * coefficients[:-1]])
