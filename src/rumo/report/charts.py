"""What each figure shows, drawn by `figures` (print) and `plots` (interactive) alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rumo.signals import Array

FEW_DECADES = 2.5
"""Up to which powers of ten are too few for the ticks of a logarithmic axis."""


@dataclass(frozen=True)
class Look:
    """Colour and dash of a line, "" for its markers alone; these and widths tell lines apart where colours don't.

    Markers, on each point: circle, square, diamond, cross, x, triangle-up, triangle-down, star; or "" for none.
    `size` is theirs [pt].
    """

    color: str
    dash: str
    width: float = 1.6
    marker: str = ""
    size: float = 5.0


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


@dataclass(frozen=True, eq=False)
class Colored:
    """A curve of points x, y (n,) in the colours of values (n,), and what these are, with a unit, for the scale."""

    x: Array
    y: Array
    values: Array
    label: str


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
    markers : tuple of (float, str)
        Vertical lines at values of the histogram, and what they say.
    colored : Colored or None
        A curve below the others.
    equal : bool
        The same scale on both axes.
    height : float
        In print [inch].
    """

    lines: tuple[Line, ...] = field(default_factory=tuple)
    histogram: Line | None = None
    markers: tuple[tuple[float, str], ...] = ()
    colored: Colored | None = None
    equal: bool = False
    height: float = 3.6


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
    logarithmic_x : tuple of int
        Panels whose x axis is logarithmic, where not all are.
    """

    panels: tuple[tuple[str, tuple[Line, ...]], ...]
    shaded: tuple[float, float, str] | None = None
    shared: str = "xy"
    height: float = 1.45
    across: int = COLUMNS
    names: tuple[tuple[float, str], ...] = ()
    logarithmic_x: tuple[int, ...] = ()

    @property
    def points(self) -> bool:
        """Whether there are points only, which have nothing in common with those above and below them."""
        return all(not line.look.dash for _, lines in self.panels for line in lines if len(line.x) > 2)

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


@dataclass(frozen=True)
class Axis:
    """An axis of a heat map: what stands below its cells, or between them.

    Attributes
    ----------
    label : str
        With a unit.
    ticks : tuple of str
        One for each cell; or one more than there are cells, for the edges between them.
    """

    label: str
    ticks: tuple[str, ...]

    def places(self, cells: int) -> Array:
        """Where the ticks stand, with the cells' centres at 0, 1, 2..."""
        return np.arange(len(self.ticks)) - (0.5 if len(self.ticks) > cells else 0.0)


@dataclass(frozen=True, kw_only=True)
class HeatMap(Content):
    """Values over two axes, as colours, in panels side by side.

    Attributes
    ----------
    panels : tuple of (str, Array, Array)
        Title, values (ny, nx), NaN where there are none, and how many runs each is of (ny, nx).
    x, y : Axis
        Of all panels.
    label : str
        What the values are, with a unit.
    span : tuple of float
        Values with the first and the last colour.
    height : float
        In print [inch].
    """

    panels: tuple[tuple[str, Array, Array], ...]
    x: Axis
    y: Axis
    label: str
    span: tuple[float, float]
    height: float = 3.6


Figure = Chart | Panels | HeatMap
"""What can be drawn."""

MARKS = ("dash", "dot", "dashdot")
"""Of a histogram's markers, in their order."""
SMALLEST = 1e-300
"""Width of a span that has none."""
SCALE = "viridis"
"""Of colours: as bright as the values are high, for everybody."""


def bins(samples: Array, markers: Sequence[tuple[float, str]]) -> Array:
    """Logarithmic bin edges that cover the samples and the markers."""
    every = np.r_[samples, [value for value, _ in markers]]
    low, high = float(every.min()), float(every.max())
    first, last = np.floor(np.log10(low) * 10.0) / 10.0, np.ceil(np.log10(high) * 10.0) / 10.0
    return np.logspace(first, last, 1 + round((last - first) * 25))


def on_color(value: float, span: tuple[float, float]) -> str:
    """Colour of text on a colour of the scale: white on dark ones."""
    share = (value - span[0]) / max(span[1] - span[0], SMALLEST)
    return "#ffffff" if share < 0.6 else "#000000"
