"""A quick look at any log."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.errors import ArgumentError
from rumo.report.charts import LIMIT, NEUTRAL, REFERENCE, Look
from rumo.report.figures import DASHES, STYLE, forget_unless_windows
from rumo.signals import Array
from rumo.simulation.log import names, signal
from rumo.status import Status

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

COLUMNS = 2
PANEL, STATUS = 1.35, 0.25
"""Height of a row of panels, and of a status [in]."""
LINE = 50
"""So many characters fit above a panel."""
BESIDE = 4
"""So many statuses find room beside a last panel that stands alone."""
PLANT = Look("#0072B2", "solid", 1.5)
ESTIMATED = Look("#E69F00", "dash", 1.2)
APPLIED = Look("#009E73", "solid", 1.5)
COMMANDED = Look("#CC79A7", "dash", 1.2)
MEASURED = ("received", "measured", "received_outputs", "measured_outputs")
LEGEND = ("Plant", "Estimated", "Measured", "Reference", "Applied", "Commanded", "Limit")
FLAT = 1e-4
"""A signal that varies less, over its size or that of its limits, is drawn as one that stays where it is."""
NOTHING = 1e-9
"""So is one that varies less over the largest number in the log: it is rounding."""


@dataclass
class _Curve:
    name: str
    values: Array
    look: Look
    steps: bool = False
    dots: bool = False


@dataclass
class _Panel:
    """A signal: its curves, of which the first say how far the axis reaches, and its limits at each sample."""

    title: str
    curves: list[_Curve] = field(default_factory=list[_Curve])
    limits: list[Array] = field(default_factory=list[Array])


def show(log: xr.Dataset) -> Figure:
    """Draw a run over time.

    Every state of the plant and of the controller's model, as it is, as measured and as estimated, every tracked output
    with its reference, everything else that is measured, every input, and path constraints, all with their limits; and
    the status of each step. Signals of which the log knows nothing are left out. Commands are drawn where they differ
    from what was applied, at the time for which they were computed.

    Parameters
    ----------
    log : xarray.Dataset
        From `rumo.simulate`, or a `Recorder` of yours.

    Returns
    -------
    matplotlib.figure.Figure
        Shown at once in a notebook or an interactive session; elsewhere, `plt.show()` or `figure.savefig(...)`.
    """
    import matplotlib.pyplot as plt

    if "status" not in getattr(log, "data_vars", ()):
        raise ArgumentError("log", repr(log), "a log from rumo.simulate or a rumo.Recorder")
    times, panels, statuses = _times(log), _panels(log), _statuses(log)
    largest = max((_size(curve.values) for panel in panels for curve in panel.curves), default=0.0)
    rows, beside = -(-len(panels) // COLUMNS), len(panels) % COLUMNS > 0 and len(statuses) <= BESIDE
    with plt.rc_context(STYLE):
        heights = [*[PANEL] * rows, *([] if beside else [0.45 + STATUS * len(statuses)])]
        figure = plt.figure(figsize=(9.0, sum(heights) + 0.7), layout="constrained")
        grid = figure.add_gridspec(len(heights), COLUMNS, height_ratios=heights)
        shared: Any = None
        for i, panel in enumerate(panels):
            axes = shared = figure.add_subplot(grid[i // COLUMNS, i % COLUMNS], sharex=shared)
            _draw(axes, times, panel, largest)
            axes.tick_params(labelbottom=i >= len(panels) - (1 if beside else COLUMNS))
            if beside and i == len(panels) - 1:
                axes.set_xlabel("Time [s]")
        last = figure.add_subplot(grid[-1, -1] if beside else grid[-1, :], sharex=shared)
        _draw_statuses(last, times, log["status"].to_numpy().astype(str), statuses, BESIDE if beside else 0)
        last.set_xlim(times[0], times[-1] if statuses else None)
        labels = {
            label: handle
            for axes in figure.axes
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        shown = [label for label in LEGEND if label in labels]
        handles = [labels[label] for label in shown]
        figure.legend(handles, shown, loc="outside lower center", ncols=len(LEGEND), markerscale=2.5)
        figure.suptitle(str(log.attrs.get("title", "")))
    if plt.isinteractive():
        plt.show()
    else:
        forget_unless_windows(figure)
    return figure


def _panels(log: xr.Dataset) -> list[_Panel]:
    states, outputs = [*names(log, "plant_state")], names(log, "output")
    own = [name for name in names(log, "state") if name not in states]
    further = [name for name in outputs if name not in states and name not in own]
    measured = [name for name in names(log, "measured_output") if name not in (*states, *outputs)]
    panels = [_of_state(log, name, "plant_state" if name in states else "state") for name in [*states, *own]]
    panels += [_of_output(log, name) for name in further]
    panels += [_of_measurement(log, name) for name in measured]
    panels += [_of_input(log, name) for name in names(log, "input")]
    bounds = {f"{name}_{side}" for name in names(log, "state") for side in ("upper", "lower")}
    panels += [_of_constraint(log, name) for name in names(log, "constraint") if name not in bounds]
    return [panel for panel in panels if panel.curves]


def _of_state(log: xr.Dataset, name: str, dim: str) -> _Panel:
    panel = _Panel(_title(log, dim, name))
    true = _values(log, "plant" if dim == "plant_state" else "true_states", name)
    _add(panel, "Plant", true, PLANT)
    _add(panel, "Reference", _values(log, "reference", name), REFERENCE)
    measured, estimated = _measured(log, name), _values(log, "estimated", name)
    if not _same(estimated, true):
        _add(panel, "Estimated", None if _same(estimated, measured) else estimated, ESTIMATED)
        _add(panel, "Measured", measured, NEUTRAL, dots=True)
    return _limited(panel, log, "state", name)


def _of_output(log: xr.Dataset, name: str) -> _Panel:
    panel, true = _Panel(_title(log, "output", name)), _values(log, "true_outputs", name)
    _add(panel, "Plant", true, PLANT)
    _add(panel, "Reference", _values(log, "reference", name), REFERENCE)
    estimated = _values(log, "estimated_outputs", name)
    _add(panel, "Estimated", None if _same(estimated, true) else estimated, ESTIMATED)
    _add(panel, "Measured", _measured(log, name), NEUTRAL, dots=True)
    return panel


def _of_measurement(log: xr.Dataset, name: str) -> _Panel:
    panel = _Panel(_title(log, "measured_output", name))
    _add(panel, "Measured", _measured(log, name), NEUTRAL, dots=True)
    return panel


def _of_input(log: xr.Dataset, name: str) -> _Panel:
    panel, applied, delay = _Panel(_title(log, "input", name)), _values(log, "applied", name), int(log.attrs["delay"])
    commanded = _values(log, "commanded", name)
    if commanded is not None:
        commanded = np.r_[np.full(delay, np.nan), commanded][: len(commanded)]
    _add(panel, "Applied", applied, APPLIED, steps=True)
    _add(panel, "Reference", _values(log, "reference", name), REFERENCE)
    if applied is None or (commanded is not None and not _same(commanded[delay:], applied[delay:])):
        _add(panel, "Commanded", commanded, COMMANDED, steps=True)
    return _limited(panel, log, "input", name)


def _of_constraint(log: xr.Dataset, name: str) -> _Panel:
    panel = _Panel(_title(log, "constraint", name), limits=[np.zeros(log.sizes["time"])])
    _add(panel, "Plant", _values(log, "true_constraints", name), PLANT)
    return panel


def _title(log: xr.Dataset, dim: str, name: str) -> str:
    unit = str(log[f"{dim}_unit"].sel({dim: name}).item())
    return name if unit == "1" else f"{name} [{unit}]"


def _values(log: xr.Dataset, variable: str, name: str) -> Array | None:
    """A signal; None if this log does not have it."""
    if variable not in log or not log.sizes["time"] or name not in names(log, str(log[variable].dims[-1])):
        return None
    values = signal(log, variable, name)
    return values if np.isfinite(values).any() else None


def _measured(log: xr.Dataset, name: str) -> Array | None:
    """A signal as it arrived; as measured, if the log knows no more."""
    found = (_values(log, variable, name) for variable in MEASURED)
    return next((values for values in found if values is not None), None)


def _same(values: Array | None, others: Array | None) -> bool:
    return values is None or (others is not None and np.array_equal(values, others, equal_nan=True))


def _add(panel: _Panel, name: str, values: Array | None, look: Look, steps: bool = False, dots: bool = False) -> None:
    if values is not None and np.isfinite(values).any():
        panel.curves.append(_Curve(name, values, look, steps, dots))


def _limited(panel: _Panel, log: xr.Dataset, dim: str, name: str) -> _Panel:
    found = [
        f"{dim}_{side}" for side in ("lower", "upper") if f"{dim}_{side}" in log.coords and name in names(log, dim)
    ]
    for side in found:
        values = log[side].sel({dim: name}).to_numpy()
        if np.isfinite(values).any():
            values = np.where(np.isinf(values), np.nan, values)
            panel.limits.append(np.broadcast_to(values, log.sizes["time"]))
    return panel


def _size(values: Array) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def _times(log: xr.Dataset) -> Array:
    """Of the samples, and the end of the last [s]."""
    time = log["time"].to_numpy()
    return np.append(time, float(log.attrs["sampling_time_s"]) + (time[-1] if len(time) else 0.0))


def _draw(axes: Any, times: Array, panel: _Panel, largest: float) -> None:
    for curve in reversed(panel.curves):
        look = curve.look
        style = {"color": look.color, "linestyle": DASHES[look.dash], "linewidth": look.width, "label": curve.name}
        if curve.steps:
            axes.plot(times, np.append(curve.values, curve.values[-1]), drawstyle="steps-post", **style)
        elif curve.dots:
            axes.plot(times[:-1], curve.values, ".", color=look.color, markersize=2.0, label=curve.name)
        else:
            alone = len(times) == 2  # a line would not be seen
            axes.plot(times[:-1], curve.values, marker="." if alone else "", clip_on=not alone, **style)
    axes.set_title(panel.title, loc="left", fontsize=9)
    low, high = _reach(panel, largest)
    span, far = high - low, list[str]()
    for limit in panel.limits:
        near = limit[(low - span <= limit) & (limit <= high + span)]
        if near.size:
            style = {"color": LIMIT.color, "linestyle": DASHES[LIMIT.dash], "linewidth": 1.0, "label": "Limit"}
            axes.plot(times, np.append(limit, limit[-1]), drawstyle="steps-post", **style)
            low, high = min(low, float(near.min())), max(high, float(near.max()))
        else:
            far.append(" to ".join(f"{value:.4g}" for value in dict.fromkeys((np.nanmin(limit), np.nanmax(limit)))))
    axes.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    if far:  # they would flatten the curves
        note = f"limit{'s' if len(far) > 1 else ''} {', '.join(far)}"
        if len(panel.title) + len(note) > LINE:
            axes.set_title(f"{panel.title}\n{note}", loc="left", fontsize=9)
        else:
            axes.set_title(note, loc="right", fontsize=8, color=LIMIT.color)


def _reach(panel: _Panel, largest: float) -> tuple[float, float]:
    """Lowest and highest value to show: all that is true or wanted, and of the rest what is not too far from that."""
    low, high = 0.0, 0.0
    for i, curve in enumerate(panel.curves):
        values = curve.values[np.isfinite(curve.values)]
        least, most = float(values.min()), float(values.max())
        if i == 0:
            low, high = least, most
        elif curve.name in ("Measured", "Estimated") and high > low:
            near = values[(2.0 * low - high <= values) & (values <= 2.0 * high - low)]
            low, high = float(near.min(initial=low)), float(near.max(initial=high))
        else:
            low, high = min(low, least), max(high, most)
    limit = min((float(np.nanmin(np.abs(values))) for values in panel.limits), default=0.0)
    size = max(abs(low), abs(high))
    if high - low > max(FLAT * limit, FLAT * size if size > NOTHING * largest else 0.0, NOTHING * largest):
        return low, high
    middle = 0.5 * (low + high)
    half = max(0.1 * limit, 0.1 * size if size > NOTHING * largest else 0.0) or 1.0
    return middle - half, middle + half


def _statuses(log: xr.Dataset) -> list[str]:
    """Those that occur, from the best to the worst."""
    order = [status.name for status in Status]
    return sorted(
        {str(status) for status in log["status"].to_numpy()}, key=lambda s: order.index(s) if s in order else 99
    )


def _draw_statuses(axes: Any, times: Array, found: np.ndarray, statuses: list[str], least: int) -> None:
    """A bar for each status over the samples that have it, its name above, in a room for `least` of them."""
    solved = {status.name for status in Status if status.solved}
    for height, status in enumerate(reversed(statuses)):
        color = PLANT.color if status in solved else LIMIT.color
        changes = np.diff(np.r_[0, found == status, 0])
        runs = zip(times[np.flatnonzero(changes == 1)], times[np.flatnonzero(changes == -1)], strict=True)
        bars = [(start, end - start) for start, end in runs]
        axes.broken_barh(bars, (height + 0.1, 0.3), facecolor=color, edgecolor=color, linewidth=0.8)  # seen if short
    axes.set_yticks(np.arange(len(statuses)) + 0.68, reversed(statuses), fontsize=7, ha="left", va="center")
    axes.tick_params(axis="y", length=0.0, pad=-4.0)
    axes.set_ylim(min(0, len(statuses) - least), max(len(statuses), 1))
    axes.set_axisbelow(True)
    axes.set_xlabel("Time [s]")
    axes.set_title("Status of each step" if statuses else "No step was recorded", loc="left", fontsize=9)
    axes.grid(axis="y", visible=False)
