"""Paths by their shape."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rumo.checks import as_list, finite_number, positive_number, whole_number
from rumo.errors import ArgumentError
from rumo.references.paths import Path
from rumo.signals import Array


@dataclass(frozen=True)
class Bend:
    """An arc with a clothoid before and after, along which the curvature grows from 0 and falls back.

    Parameters
    ----------
    radius : float
        Of the arc [m].
    angle : float
        By which it turns with its clothoids, positive to the left [rad].
    clothoid : float
        Length of each clothoid [m]; together they turn by `clothoid / radius`, which must be less than the angle.
    """

    radius: float
    angle: float
    clothoid: float

    def __post_init__(self) -> None:
        positive_number(self.radius, "radius")
        finite_number(self.angle, "angle")
        positive_number(self.clothoid, "clothoid")
        if not self.clothoid < self.radius * abs(self.angle):
            most = f"less than {self.radius * abs(self.angle):.4g} m, which is all of the turn"
            raise ArgumentError("clothoid", repr(self.clothoid), most)


def straight(length: float) -> Path:
    """A straight of a length [m] along +x from the origin."""
    return Path.from_curvature((0.0, positive_number(length, "length")), (0.0, 0.0))


def circle(radius: float, *, left: bool = True) -> Path:
    """A circle of a radius [m], closed, from the origin along +x, to the left or to the right."""
    bend = (1.0 if left else -1.0) / positive_number(radius, "radius")
    return Path.from_curvature((0.0, 2.0 * np.pi * radius), (bend, bend), closed=True)


def clothoid(length: float, curvature: float, start: float = 0.0) -> Path:
    """A curvature that goes evenly from `start` to `curvature` [1/m] over a length [m]."""
    ends = finite_number(start, "start"), finite_number(curvature, "curvature")
    return Path.from_curvature((0.0, positive_number(length, "length")), ends)


def bends(segments: Sequence[float | Bend], *, closed: bool = False) -> Path:
    """Straights and bends one after the other, from the origin along +x.

    Parameters
    ----------
    segments : sequence of float or Bend
        A number is the length of a straight [m].
    closed : bool
        Whether it ends as it began, which is for the segments to achieve: see `closing`.

    Raises
    ------
    ArgumentError
        If there is no segment, or a length is not positive.
    """
    return Path.from_curvature(*_curvature(as_list(segments, "segments", "lengths and bends")), closed=closed)


def closing(segments: Sequence[float | Bend], first: int, second: int) -> list[float | Bend]:
    """The segments with two straights made as long as it takes to end where the path begins.

    Parameters
    ----------
    segments : sequence of float or Bend
        They turn by one full turn, or by another whole number, in all.
    first, second : int
        Which of them are made longer or shorter: straights that are not parallel.

    Raises
    ------
    ArgumentError
        If no lengths close it.
    """
    parts = list(segments)
    path = bends(parts)
    ends = np.cumsum([_length(part) for part in parts])
    directions = [path.at(ends[i] - 0.5 * _length(parts[i])).heading for i in (first, second)]
    end = path.at(path.length)
    matrix = np.array([np.cos(directions), np.sin(directions)])
    if abs(np.linalg.det(matrix)) < 1e-6:
        raise ArgumentError("first, second", f"{first}, {second}, which are parallel", "straights that are not")
    for i, change in zip((first, second), np.linalg.solve(matrix, [-end.x, -end.y]).tolist(), strict=True):
        part = parts[i]
        if isinstance(part, Bend) or part + change <= 0.0:
            raise ArgumentError(f"segments[{i}]", repr(part), "a straight, longer or shorter by what it takes to close")
        parts[i] = part + change
    return parts


def figure_of_eight(radius: float = 30.0, clothoid: float = 15.0, crossing: float = 0.5 * np.pi) -> Path:
    """A closed path to the left and to the right that crosses itself in the middle, where it begins.

    Parameters
    ----------
    radius, clothoid : float
        Of its bends [m].
    crossing : float
        Angle at which it crosses itself [rad].
    """
    angle = positive_number(crossing, "crossing")
    if not angle < np.pi:
        raise ArgumentError("crossing", repr(crossing), "less than half a turn [rad]")
    bend = Bend(radius, np.pi + angle, clothoid)
    chord = bends([bend])
    end = chord.at(chord.length)
    # Both straights of a loop are as long, so that it is symmetric and comes back to where it began.
    both = np.array([1.0 + np.cos(bend.angle), np.sin(bend.angle)])
    length = -float((np.array([end.x, end.y]) @ both) / (both @ both))
    if length <= 0.0:
        raise ArgumentError("clothoid", repr(clothoid), "shorter: the bends alone are too long for a loop")
    return bends([length, bend, 2.0 * length, Bend(radius, -bend.angle, clothoid), length], closed=True)


def sine(amplitude: float = 3.0, wavelength: float = 60.0, periods: int = 4) -> Path:
    """A sine wave `y = a sin(2 pi x / w)` of some periods."""
    a, w = finite_number(amplitude, "amplitude"), positive_number(wavelength, "wavelength")
    n = whole_number(periods, "periods", 1)
    return _graph(lambda x: a * np.sin(2.0 * np.pi * x / w), n * w, w / 200.0)


def slalom(spacing: float = 18.0, amplitude: float = 1.6, gates: int = 8, approach: float = 30.0) -> Path:
    """A sine about cones in a row, with a straight before and after into which it is blended.

    Parameters
    ----------
    spacing : float
        Of the cones, half a wave [m]; they stand at (approach + spacing i, 0).
    amplitude : float
        Distance from them at which they are passed, the first one on the left [m].
    gates : int
        How many cones there are.
    approach : float
        Length before the first cone and after the last [m], at least the spacing.
    """
    gap, a = positive_number(spacing, "spacing"), finite_number(amplitude, "amplitude")
    n, lead = whole_number(gates, "gates", 2), positive_number(approach, "approach")
    if lead < gap:
        raise ArgumentError("approach", repr(approach), f"at least the spacing of {gap:g} m")
    last = lead + gap * (n - 1)

    def y(x: Array) -> Array:
        outside = np.maximum(np.maximum(lead - x, x - last) / gap, 0.0)
        fade = np.clip(1.0 - outside, 0.0, 1.0)
        smooth = fade**3 * (10.0 - 15.0 * fade + 6.0 * fade**2)  # twice differentiable
        return a * np.cos(np.pi * (x - lead) / gap) * smooth

    return _graph(y, last + lead, gap / 100.0)


def cones_of_slalom(spacing: float = 18.0, gates: int = 8, approach: float = 30.0) -> Array:
    """Positions (gates, 2) of the cones of `slalom` [m]."""
    return np.column_stack([approach + spacing * np.arange(gates), np.zeros(gates)])


def _graph(y: Callable[[Array], Array], length: float, spacing: float) -> Path:
    x = np.linspace(0.0, length, int(np.ceil(length / spacing)) + 1)
    return Path(np.column_stack([x, y(x)]))


def _curvature(segments: Sequence[float | Bend]) -> tuple[list[float], list[float]]:
    """Stations [m] and the curvature there [1/m]."""
    stations, curvature = [0.0], [0.0]
    for i, part in enumerate(segments):
        if isinstance(part, Bend):
            bend = np.sign(part.angle) / part.radius
            arc = part.radius * abs(part.angle) - part.clothoid
            for length, value in ((part.clothoid, bend), (arc, bend), (part.clothoid, 0.0)):
                stations.append(stations[-1] + length)
                curvature.append(float(value))
        else:
            stations.append(stations[-1] + positive_number(part, f"segments[{i}]"))
            curvature.append(0.0)
    return stations, curvature


def _length(part: float | Bend) -> float:
    return part.radius * abs(part.angle) + part.clothoid if isinstance(part, Bend) else part
