"""What each figure shows, drawn by `figures` (print) and `plots` (interactive) alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rumo.report.kpis import tracking_error
from rumo.signals import Array
from rumo.simulation.log import signal

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Look:
    """Colour and dash of a line; dashes, widths and markers tell lines apart where colours don't.

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
_CONTROLLERS = {
    # Runs often coincide: later lines are thinner, so that earlier ones show behind them.
    "rti": Look("#0072B2", "solid", 3.0),
    "nlp": Look("#E69F00", "dash", 1.8),
    "ltv": Look("#009E73", "dashdot", 1.0),
}
LABELS = {"rti": "RTI", "nlp": "Direct NLP", "ltv": "LTV"}


def look(controller: str) -> Look:
    """Look of a controller's lines."""
    return _CONTROLLERS.get(controller, NEUTRAL)


def label(controller: str) -> str:
    """Name of a controller for readers."""
    return LABELS.get(controller, controller)


@dataclass(frozen=True)
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
    shaded : tuple of float, or None
        From when to when samples are bad [s].
    shared : str
        Axes that all have in common: "", "x", "y" or "xy".
    height : float
        Of a row of panels in print [inch].
    """

    panels: tuple[tuple[str, tuple[Line, ...]], ...]
    shaded: tuple[float, float] | None = None
    shared: str = "xy"
    height: float = 1.45

    @property
    def rows(self) -> int:
        """Rows of panels."""
        return -(-len(self.panels) // COLUMNS)

    @property
    def from_zero(self) -> bool:
        """Whether the y axes start at 0, as they do where nothing is negative."""
        return "y" not in self.logarithmic and all((line.y >= 0.0).all() for _, lines in self.panels for line in lines)


def bins(samples: Array, marker: float) -> Array:
    """Logarithmic bin edges that cover the samples and the marker."""
    low, high = min(float(samples.min()), marker), max(float(samples.max()), marker)
    first, last = np.floor(np.log10(low) * 10.0) / 10.0, np.ceil(np.log10(high) * 10.0) / 10.0
    return np.logspace(first, last, 1 + round((last - first) * 25))


def paper_charts(logs: Mapping[str, xr.Dataset]) -> list[Chart]:
    """The paper's figures, in its order, with a histogram for each controller."""
    first = next(iter(logs.values()))
    time = first["time"].to_numpy()
    dt = float(first.attrs["sampling_time_s"])
    end = dt * len(time)
    return [
        _trajectory("trajectory-first-2s", f"Trajectories, first {min(2.0, end):g} s", logs, 2.0),
        _trajectory("trajectory", f"Trajectories, {end:g} s", logs, np.inf),
        Chart(
            "wind",
            "Wind speed",
            "Time [s]",
            "Wind speed [m/s]",
            (Line("Wind", time, signal(first, "disturbance", "wind_speed"), NEUTRAL, steps=True),),
        ),
        _input("torque", "Torque on each rear wheel", "N m", logs),
        _input("steering_rate", "Steering rate", "rad/s", logs),
        Chart(
            "tracking-error",
            "Tracking error",
            "Time [s]",
            "Distance from the reference [m]",
            tuple(Line(label(name), time, tracking_error(log), look(name)) for name, log in logs.items()),
        ),
        *(_step_times(name, log, dt) for name, log in logs.items()),
    ]


def _trajectory(key: str, title: str, logs: Mapping[str, xr.Dataset], until: float) -> Chart:
    first = next(iter(logs.values()))
    shown = first["time"].to_numpy() <= until
    lines = [
        Line(
            label(name),
            signal(log, "plant", "p_x")[shown],
            signal(log, "plant", "p_y")[shown],
            look(name),
        )
        for name, log in logs.items()
    ]
    reference = Line(
        "Reference", signal(first, "reference", "p_x")[shown], signal(first, "reference", "p_y")[shown], REFERENCE
    )
    return Chart(key, title, "Position p_x [m]", "Position p_y [m]", (*lines, reference), equal=np.isfinite(until))


def _input(name: str, title: str, unit: str, logs: Mapping[str, xr.Dataset]) -> Chart:
    first = next(iter(logs.values()))
    limits = first[["input_lower", "input_upper"]].sel(input=name)
    lower, upper = float(limits["input_lower"]), float(limits["input_upper"])
    lines = [
        Line(label(key), log["time"].to_numpy(), signal(log, "applied", name), look(key), steps=True)
        for key, log in logs.items()
    ]
    # A limit far from the data would flatten the curves; the title names it all the same.
    reach = max(float(np.abs(line.y).max()) for line in lines)
    span = first["time"].to_numpy()[[0, -1]]
    for limit, words in ((lower, "Lower limit"), (upper, "Upper limit")):
        if abs(limit) <= 2.0 * reach:
            lines.append(Line(words, span, np.full(2, limit), LIMIT))
    return Chart(
        name.replace("_", "-"),
        f"{title} (limits {lower:g} and {upper:g} {unit})",
        "Time [s]",
        f"{title.split(' on ')[0]} [{unit}]",
        tuple(lines),
    )


def _step_times(name: str, log: xr.Dataset, dt: float) -> Chart:
    samples = 1e3 * log["step_time"].to_numpy()
    return Chart(
        f"step-time-{name}",
        f"Execution time of a step, {label(name)}",
        "Time [ms]",
        "Steps",
        histogram=Line(f"{label(name)}, mean {samples.mean():.3g} ms", samples, samples, look(name)),
        marker=(1e3 * dt, f"Sampling period, {1e3 * dt:g} ms"),
    )
