"""Tracks: a centre line, and how far it is from there to either side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers, checked, positive_number, printable
from rumo.errors import ArgumentError, ShapeError
from rumo.kernel import Curve
from rumo.references.aside import widths_about
from rumo.references.generators import Bend, bends, closing, figure_of_eight
from rumo.references.paths import Path
from rumo.signals import Array, read_only


class Bodied(Protocol):
    """Something that is as long before its centre as behind it, or not."""

    @property
    def ends(self) -> tuple[float, float]:
        """Before and behind its centre [m]."""
        ...


SAME = 1e-9
"""Places as close as this are one [m]."""
Width = float | ArrayLike | Callable[[Array], ArrayLike]


class Track:
    """A path with limits to its left and to its right.

    Parameters
    ----------
    path : Path
        Its centre line, or any other line along it.
    width_left, width_right : float, array_like (n,) or callable
        From the path to the edges [m]: a number, one at each of `path.stations`, with straight lines between, or a
        function of arc lengths. An edge on the other side of the path is at a negative width; both together are
        positive.
    name : str
        For figures and tables.

    Attributes
    ----------
    path : Path
        Its line.
    name : str
        What it is called.

    Raises
    ------
    ArgumentError
        If a width is not finite, or the track has none somewhere.
    ShapeError
        If there is not one width at each station.
    """

    def __init__(self, path: Path, width_left: Width, width_right: Width, name: str = "") -> None:
        self.path, self.name = checked(path, "path", Path), printable(name, "name")
        self._widths = _checked(width_left, path, "width_left"), _checked(width_right, path, "width_right")
        left, right = self.limits(path.nodes[:-1] if path.closed else path.nodes)
        if not (left + right > 0.0).all():
            place = path.nodes[int(np.argmin(left + right))]
            raise ArgumentError(
                "width_left + width_right", f"{(left + right).min():.3g} m at {place:.4g} m", "more than 0"
            )

    def limits(self, s: ArrayLike) -> tuple[Array, Array]:
        """Widths to the left and to the right at arc lengths [m], each of their shape."""
        s = np.asarray(s, dtype=float)
        return self.width(0, s), self.width(1, s)

    def edges(self, s: ArrayLike) -> tuple[Array, Array]:
        """Points (n, 2) of the left and the right edge beside the path's at arc lengths (n,) [m]."""
        left, right = self.limits(s)
        return self.path.offset(s, left), self.path.offset(s, -right)

    def clearance(self, s: ArrayLike, x: Array | float, y: Array | float) -> Array:
        """From positions x, y to the nearer edge beside the path's points at arc lengths s [m]; negative beyond it."""
        beside, (left, right) = self.path.at(s).left(x, y), self.limits(s)
        return np.minimum(left - beside, right + beside)

    def room(self, vehicle: Bodied) -> dict[str, Callable[[Array], Array]]:
        """Widths to the left and to the right beside the front and the rear of a vehicle, by the place of its centre.

        For `PathTracking(parameters=...)`, where a problem has `rumo.vehicles.track_limits`. Each is the least within a
        quarter of the vehicle's length, so that it cuts no corner between two stages; a number, if it is the same
        everywhere.

        Parameters
        ----------
        vehicle : VehicleParameters
            Or anything else with `ends` before and behind its centre [m].
        """
        front, rear = vehicle.ends
        ends, sides = {"front": front, "rear": rear}, ("left", "right")
        near = 0.25 * (front - rear) * np.linspace(-1.0, 1.0, 5)
        return {f"{end}_{side}": self._room(ends[end] + near, i) for end in ends for i, side in enumerate(sides)}

    def _room(self, ahead: Array, side: int) -> Callable[[Array], Array]:
        width = self._widths[side]
        return width.least(ahead) if isinstance(width, _Sampled) else _Room(self, ahead, side)

    def about(self, line: Path, spacing: float = 1.0) -> Track:
        """The same track about another line along it, such as a race line.

        Parameters
        ----------
        line : Path
            Whose normals meet the edges.
        spacing : float
            At which widths are found, with straight lines between [m].

        Raises
        ------
        ArgumentError
            If an edge is nowhere to be found, or the line outside by more than the track's width.
        """
        checked(line, "line", Path)
        s = np.linspace(0.0, line.length, int(np.ceil(line.length / positive_number(spacing, "spacing"))) + 1)
        left, right = widths_about(self, line, s)
        lost = ~np.isfinite(left + right)
        if lost.any():
            raise ArgumentError("line", f"one at {s[lost][0]:.4g} m of which no edge is found", "one along the track")
        period = line.length if line.closed else None
        return Track(line, _Sampled(s, left, period), _Sampled(s, right, period), self.name)

    def width(self, side: int, s: Array) -> Array:
        """Width to the left, side 0, or to the right, side 1, at arc lengths, of their shape [m]."""
        width = self._widths[side]
        if isinstance(width, _Sampled):
            return width(s)
        if callable(width):
            values = as_numbers(width(s), "width(s)")
            if values.shape not in ((), s.shape) or not np.isfinite(values).all():
                raise ShapeError("width(s)", f"shape {values.shape}", f"finite numbers of shape {s.shape}")
            return np.broadcast_to(values, s.shape)
        return np.full(s.shape, width)

    def even(self, side: int) -> Array | None:
        """Width to one side, () [m], if it is the same everywhere."""
        width = self._widths[side]
        return None if callable(width) else width

    def __repr__(self) -> str:
        return f"Track({self.name!r}, {self.path!r})"


@dataclass(frozen=True, eq=False)
class _Room:
    """The least width to one side of a track at distances from a place."""

    track: Track
    ahead: Array
    side: int

    def __call__(self, s: Array) -> Array:
        even = self.track.even(self.side)
        if even is not None:
            return even
        return np.minimum.reduce(self.track.width(self.side, s[:, None] + self.ahead), axis=1)


class _Sampled:
    """A width by straight lines between samples; as at the ends beyond them, or periodic."""

    def __init__(self, s: Array, width: Array, period: float | None) -> None:
        lap = None
        if period is None:
            s, width = np.r_[s[0] - 1.0, s, s[-1] + 1.0], np.r_[width[0], width, width[-1]]
        else:
            s, first = np.unique(s % period, return_index=True)
            apart = np.diff(np.r_[s, s[0] + period]) > SAME
            s, width = s[apart], width[first][apart]
            s, width, lap = np.r_[s, s[0] + period], np.r_[width, width[0]], np.zeros(1)
        self._s, self._period = s, period
        self._lines = Curve(s, np.stack([np.diff(width) / np.diff(s), width[:-1]])[:, :, None], lap)

    def __call__(self, s: Array) -> Array:
        return self._lines(s)[0]

    def least(self, ahead: Array) -> _Sampled:
        """The least at distances (k,) ahead of a place: straight lines as well, which end where two of them cross."""
        if self._period is None:
            s = np.unique(self._s[:, None] - ahead)
        else:
            s = np.unique((self._s[:-1, None] - ahead) % self._period)
            s = np.r_[s, s[0] + self._period]
        width = self(s[:, None] + ahead)
        between = width[:, :, None] - width[:, None]
        before, after = between[:-1], between[1:]
        piece, *pair = np.nonzero(before * after < 0.0)
        share = before[piece, *pair] / (before[piece, *pair] - after[piece, *pair])
        s = np.unique(np.r_[s, s[piece] + share * np.diff(s)[piece]])
        return _Sampled(s, np.minimum.reduce(self(s[:, None] + ahead), axis=1), self._period)


def _checked(width: Width, path: Path, argument: str) -> Array | Callable[[Array], ArrayLike]:
    if callable(width):
        return width
    values = as_numbers(width, argument)
    if values.shape not in ((), path.stations.shape):
        expected = f"a number, or shape {path.stations.shape}: one at each of path.stations"
        raise ShapeError(argument, f"shape {values.shape}", expected)
    if not np.isfinite(values).all():
        raise ArgumentError(argument, "NaN or infinity", "finite widths [m]")
    return _Sampled(path.stations, values, path.length if path.closed else None) if values.ndim else read_only(values)


def oval() -> Track:
    """Two straights of 200 m and two bends of 40 m of radius; 10 m wide."""
    bend = Bend(40.0, np.pi, 30.0)
    return Track(bends([100.0, bend, 200.0, bend, 100.0], closed=True), 5.0, 5.0, "oval")


def club() -> Track:
    """Some two kilometres of straights, fast and slow bends, a hairpin of 13 m and a chicane; 10 m wide."""
    turn = np.deg2rad
    segments = [
        320.0,
        Bend(45.0, turn(90.0), 30.0),
        60.0,
        Bend(40.0, turn(-45.0), 18.0),
        10.0,
        Bend(60.0, turn(90.0), 35.0),
        140.0,
        Bend(13.0, turn(160.0), 14.0),
        60.0,
        Bend(35.0, turn(-115.0), 25.0),
        150.0,
        Bend(25.0, turn(30.0), 10.0),
        Bend(25.0, turn(-60.0), 10.0),
        Bend(25.0, turn(30.0), 10.0),
        100.0,
        Bend(30.0, turn(90.0), 20.0),
        80.0,
        Bend(60.0, turn(90.0), 40.0),
        250.0,
    ]
    return Track(bends(closing(segments, 14, 16), closed=True), 5.0, 5.0, "club")


def eight() -> Track:
    """A figure of eight of 30 m of radius that crosses itself at a right angle; 8 m wide."""
    return Track(figure_of_eight(30.0, 15.0), 4.0, 4.0, "eight")


TRACKS: dict[str, Callable[[], Track]] = {"oval": oval, "club": club, "eight": eight}
"""Tracks that need no file, by name."""
