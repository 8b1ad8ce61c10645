"""Curves in pieces, computed by the core."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.kernel._core import Curve as _Curve
from rumo.signals import Array, read_only


class Curve:
    """A few values by one number: a polynomial of each on every piece, as SciPy's `PPoly`.

    The first and the last piece go on beyond the ends, but of a closed curve, which begins again.

    Parameters
    ----------
    breaks : ndarray, (m + 1,)
        Where the pieces meet, increasing.
    coefficients : ndarray, (k, m, n)
        Of n values on m pieces, of the highest power first, by the distance from where a piece begins.
    shift : ndarray, (n,), optional
        Of a closed curve: what a lap adds to each value.
    """

    def __init__(self, breaks: Array, coefficients: Array, shift: Array | None = None) -> None:
        order, pieces, self._values = coefficients.shape
        by_piece = read_only(np.ascontiguousarray(coefficients.transpose(1, 2, 0)))
        self._arrays = read_only(breaks), by_piece, None if shift is None else read_only(shift)
        self._curve = _Curve(*self._arrays, pieces, self._values, order)

    def __call__(self, s: ArrayLike) -> Array:
        """Values (n, ...) at numbers of any shape; NaN where these are not finite."""
        s = np.asarray(s, dtype=float, order="C")
        values = np.empty((self._values, *s.shape))
        self._curve.at(s, s.size, values)
        return values

    def nearest(self, x: float, y: float, low: float, high: float) -> float:
        """Where from `low` to `high` the first two values, to which laps add nothing, are nearest to x, y.

        Of a closed curve, one lap in the middle of these is looked at; NaN without finite numbers.
        """
        return self._curve.nearest(x, y, low, high)

    def when(self, place: ArrayLike) -> Array:
        """Arguments at which values 0, of any shape, are reached, if values 1 and 2 are its derivatives by these.

        Value 0 never falls, and value 2 is constant on each piece, as of a motion with constant accelerations. Where an
        end is as far as it gets, that end; NaN without finite numbers.
        """
        place = np.asarray(place, dtype=float, order="C")
        times = np.empty(place.shape)
        self._curve.when(place, place.size, times)
        return times

    def __reduce__(self) -> tuple[Any, ...]:
        breaks, by_piece, shift = self._arrays
        return Curve, (breaks, by_piece.transpose(2, 0, 1), shift)
