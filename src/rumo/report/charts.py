"""What each figure shows, drawn by `figures` (print) and `plots` (interactive) alike."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rumo.signals import Array


@dataclass(frozen=True)
class Look:
    """Colour and dash of a line, "" for its markers alone; these and widths tell lines apart where colours don't.

    Markers, on each point: circle, square, diamond, cross, x, triangle-up, triangle-down, star; or "" for none.
    """

    color: str
    dash: str
    width: float = 1.6
    marker: str = ""


# Okabe and Ito's palette, made to be told apart by colour-blind readers.
REFERENCE = Look("#555555", "dot", 1.4)
NEUTRAL = Look("#56B4E9", "solid")
LIMIT = Look("#D55E00", "dash", 1.2)


@dataclass(frozen=True, eq=False)
class Line:
    """A curve: points x, y (n,), a name for the legend, a look; `steps` holds each value until the next."""

    name: str
    x: Array
    y: Array
    look: Look
    steps: bool = False


@dataclass(frozen=True)
class Content:
    """What all figures have.

    Attributes
    ----------
    key : str
        File name without ending.
    title, x_label, y_label : str
        Labels with units.
    logarithmic : str
        Axes with a logarithmic scale: "", "x", "y" or "xy".
    """

    key: str
    title: str
    x_label: str
    y_label: str
    logarithmic: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class Chart(Content):
    """Lines or a histogram on one pair of axes.

    Attributes
    ----------
    lines : tuple of Line
        Curves.
    histogram : Line or None
        Its y values are binned on a logarithmic axis instead of drawn as a curve.
    marker : tuple of float and str, or None
        A vertical line at a value, and what it says.
    equal : bool
        The same scale on both axes.
    """

    lines: tuple[Line, ...] = field(default_factory=tuple)
    histogram: Line | None = None
    marker: tuple[float, str] | None = None
    equal: bool = False


COLUMNS = 2
"""Of small multiples."""


@dataclass(frozen=True)
class Panels(Content):
    """Small multiples, each with a title and lines.

    Attributes
    ----------
    panels : tuple of (str, tuple of Line)
        Title and curves of each.
    shaded : tuple of float, float and str, or None
        A region of the x axis, from where to where, and what it says.
    shared : str
        Axes that all have in common: "", "x", "y" or "xy".
    height : float
        Of a row of panels in print [inch].
    across : int
        Panels in a row, at most.
    names : tuple of (float, str)
        What stands at places of the y axis, in place of numbers.
    """

    panels: tuple[tuple[str, tuple[Line, ...]], ...]
    shaded: tuple[float, float, str] | None = None
    shared: str = "xy"
    height: float = 1.45
    across: int = COLUMNS
    names: tuple[tuple[float, str], ...] = ()

    @property
    def columns(self) -> int:
        """Columns of panels; one alone has all the width."""
        return min(self.across, len(self.panels))

    @property
    def rows(self) -> int:
        """Rows of panels."""
        return -(-len(self.panels) // self.columns)

    @property
    def from_zero(self) -> bool:
        """Whether the y axes start at 0, as they do where nothing is negative."""
        return "y" not in self.logarithmic and all((line.y >= 0.0).all() for _, lines in self.panels for line in lines)


def bins(samples: Array, marker: float) -> Array:
    """Logarithmic bin edges that cover the samples and the marker."""
    low, high = min(float(samples.min()), marker), max(float(samples.max()), marker)
    first, last = np.floor(np.log10(low) * 10.0) / 10.0, np.ceil(np.log10(high) * 10.0) / 10.0
    return np.logspace(first, last, 1 + round((last - first) * 25))
