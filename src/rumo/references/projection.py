"""The point of a curve nearest to a place."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np
from scipy.interpolate import PPoly

AMBIGUOUS, FARTHEST = 0.01, 3.0
"""Distance that the right heading is worth: a share of the curve's length, and at most so much [m]."""
CLOSE = 1e-9
"""Newton's step that ends the search [m]."""
MOST = 100
"""Steps of a search; halving alone gets from a kilometre to a nanometre in forty."""


class Projection:
    """Nearest points of a curve: the nearest node, then Newton's method between its neighbours, or halving.

    Parameters
    ----------
    pieces : PPoly
        Position among its values, by arc length; of an open curve with a straight piece before and after.
    closed : bool
        Whether the curve goes on where it began.
    """

    def __init__(self, pieces: PPoly, closed: bool) -> None:
        self._breaks = pieces.x.tolist()
        self._rows = np.ascontiguousarray(pieces.c[:, :, :2].transpose(1, 2, 0)).reshape(-1, 12)
        s = pieces.x[:-1] if closed else pieces.x[1:-1]
        self._x, self._y, self._heading = np.ascontiguousarray(pieces(s)[:, :3].T)
        self._stations = s.tolist()
        self._period = float(pieces.x[-1] - pieces.x[0]) if closed else 0.0

    def anywhere(self, x: float, y: float, heading: float | None = None) -> float:
        """Arc length of the nearest point of all, or of those about as near where the curve has that heading."""
        distances = (self._x - x) ** 2 + (self._y - y) ** 2
        if heading is not None:
            near = min(AMBIGUOUS * self._stations[-1], FARTHEST)
            other = distances + near**2 * (1.0 - np.cos(self._heading - heading))
            station = self._stations[int(other.argmin())]
            return self.between(x, y, station - 2.0 * near, station + 2.0 * near)
        i = int(distances.argmin())
        low, high = self._station(i - 1), self._station(i + 1)
        if not self._period:  # an end's straight may have to be long enough
            reach = float(np.sqrt(distances[i])) + 1.0
            low = low if i else self._stations[0] - reach
            high = high if i + 1 < len(self._stations) else self._stations[-1] + reach
        return self._descend(x, y, self._stations[i], low, high)

    def between(self, x: float, y: float, low: float, high: float) -> float:
        """Arc length of the nearest point of those from `low` to `high`."""
        first, last = self._count(low), self._count(high)
        if last <= first:
            return self._descend(x, y, 0.5 * (low + high), low, high)
        # Nodes first to last - 1 are within, counted on from lap to lap.
        if self._period:
            at = np.arange(first, last) % len(self._stations)
            distances = (self._x[at] - x) ** 2 + (self._y[at] - y) ** 2
        else:
            distances = (self._x[first:last] - x) ** 2 + (self._y[first:last] - y) ** 2
        i = first + int(distances.argmin())
        before = self._station(i - 1) if i > first else low
        after = self._station(i + 1) if i + 1 < last else high
        return self._descend(x, y, self._station(i), before, after)

    def _station(self, i: int) -> float:
        """Arc length of a node, counted on from lap to lap, or of the end of an open curve."""
        if self._period:
            lap, i = divmod(i, len(self._stations))
            return lap * self._period + self._stations[i]
        return self._stations[min(max(i, 0), len(self._stations) - 1)]

    def _count(self, s: float) -> int:
        """How many nodes lie before an arc length, those of whole laps included."""
        lap, within = divmod(s, self._period) if self._period else (0.0, s)
        return int(lap) * len(self._stations) + bisect_right(self._stations, within)

    def _descend(self, x: float, y: float, s: float, low: float, high: float) -> float:
        for _ in range(MOST):
            slope, second = self._slope(x, y, s)
            if slope < 0.0:
                low = s
            else:
                high = s
            new = s - slope / second if second > 0.0 else low - 1.0
            if not low <= new <= high:
                new = 0.5 * (low + high)
            if abs(new - s) < CLOSE:
                return new
            s = new
        return s

    def _slope(self, x: float, y: float, s: float) -> tuple[float, float]:
        """First and second derivative of half the squared distance by arc length."""
        within = s % self._period if self._period else s
        i = min(max(bisect_right(self._breaks, within) - 1, 0), len(self._rows) - 1)
        d = within - self._breaks[i]
        a5, a4, a3, a2, a1, a0, b5, b4, b3, b2, b1, b0 = self._rows[i].tolist()
        dx = (((((a5 * d + a4) * d + a3) * d) + a2) * d + a1) * d + a0 - x
        dy = (((((b5 * d + b4) * d + b3) * d) + b2) * d + b1) * d + b0 - y
        tx = (((5.0 * a5 * d + 4.0 * a4) * d + 3.0 * a3) * d + 2.0 * a2) * d + a1
        ty = (((5.0 * b5 * d + 4.0 * b4) * d + 3.0 * b3) * d + 2.0 * b2) * d + b1
        nx = ((20.0 * a5 * d + 12.0 * a4) * d + 6.0 * a3) * d + 2.0 * a2
        ny = ((20.0 * b5 * d + 12.0 * b4) * d + 6.0 * b3) * d + 2.0 * b2
        return dx * tx + dy * ty, tx * tx + ty * ty + dx * nx + dy * ny
