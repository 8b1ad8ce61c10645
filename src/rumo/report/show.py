"""A quick look at any log."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.report.charts import LIMIT, NEUTRAL, REFERENCE, Look
from rumo.report.figures import DASHES, STYLE
from rumo.signals import Array
from rumo.simulation.log import names, signal
from rumo.status import Status

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

COLUMNS = 2
PLANT = Look("#0072B2", "solid", 1.5)
ESTIMATED = Look("#E69F00", "dash", 1.2)
APPLIED = Look("#009E73", "solid", 1.5)
COMMANDED = Look("#CC79A7", "dash", 1.2)
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
    """A signal: its curves, of which the first say how far the axis reaches, and its limits."""

    title: str
    curves: list[_Curve] = field(default_factory=list[_Curve])
    limits: tuple[float, ...] = ()


def show(log: xr.Dataset) -> Figure:
    """Draw a run over time.

    Every state of the plant and of the controller's model, as it is, as measured and as estimated, every tracked output
    with its reference, every input, and path constraints, all with their limits; and the status of each step.

    Parameters
    ----------
    log : xarray.Dataset
        From `rumo.simulate`, or a `Recorder` of yours.

    Returns
    -------
    matplotlib.figure.Figure
        Shown at once in a notebook or an interactive session; elsewhere, `figure.savefig(...)`.
    """
    import matplotlib.pyplot as plt

    time, panels = log["time"].to_numpy(), _panels(log)
    rows = -(-len(panels) // COLUMNS)
    largest = max((_size(curve.values) for panel in panels for curve in panel.curves), default=0.0)
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(9.0, 1.35 * rows + 1.9), layout="constrained")
        grid = figure.add_gridspec(rows + 1, COLUMNS, height_ratios=[*[1.0] * rows, 0.25 + 0.17 * len(_statuses(log))])
        shared: Any = None
        for i, panel in enumerate(panels):
            axes = shared = figure.add_subplot(grid[i // COLUMNS, i % COLUMNS], sharex=shared)
            _draw(axes, time, panel, largest)
            axes.tick_params(labelbottom=i >= len(panels) - COLUMNS)
            axes.set_xlim(time[0], time[-1] if len(time) > 1 else None)
        _draw_statuses(figure.add_subplot(grid[rows, :], sharex=shared), log)
        labels = {
            label: handle
            for axes in figure.axes
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
        }
        shown = [label for label in LEGEND if label in labels]
        figure.legend([labels[label] for label in shown], shown, loc="outside lower center", ncols=len(LEGEND))
        figure.suptitle(str(log.attrs.get("title", "")))
    if plt.isinteractive():
        plt.show()
    return figure


def _panels(log: xr.Dataset) -> list[_Panel]:
    states, outputs = [*names(log, "plant_state")], names(log, "output")
    own = [name for name in names(log, "state") if name not in states]
    further = [name for name in outputs if name not in states and name not in own]
    panels = [_of_state(log, name, "plant_state" if name in states else "state") for name in [*states, *own]]
    panels += [_of_output(log, name) for name in further]
    panels += [_of_input(log, name) for name in names(log, "input")]
    bounds = {f"{name}_{side}" for name in names(log, "state") for side in ("upper", "lower")}
    return panels + [_of_constraint(log, name) for name in names(log, "constraint") if name not in bounds]


def _of_state(log: xr.Dataset, name: str, dim: str) -> _Panel:
    panel = _Panel(_title(log, dim, name))
    true = _values(log, "plant" if dim == "plant_state" else "true_states", name)
    _add(panel, "Plant", true, PLANT)
    _add(panel, "Reference", _values(log, "reference", name), REFERENCE)
    measured, estimated = _values(log, "received", name), _values(log, "estimated", name)
    measured = _values(log, "measured", name) if measured is None else measured
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
    return panel


def _of_input(log: xr.Dataset, name: str) -> _Panel:
    panel, applied, delay = _Panel(_title(log, "input", name)), _values(log, "applied", name), int(log.attrs["delay"])
    commanded = _values(log, "commanded", name)
    _add(panel, "Applied", applied, APPLIED, steps=True)
    _add(panel, "Reference", _values(log, "reference", name), REFERENCE)
    if (
        commanded is not None
        and applied is not None
        and not _same(commanded[: len(commanded) - delay], applied[delay:])
    ):
        _add(panel, "Commanded", commanded, COMMANDED, steps=True)
    return _limited(panel, log, "input", name)


def _of_constraint(log: xr.Dataset, name: str) -> _Panel:
    panel = _Panel(_title(log, "constraint", name), limits=(0.0,))
    _add(panel, "Plant", _values(log, "true_constraints", name), PLANT)
    return panel


def _title(log: xr.Dataset, dim: str, name: str) -> str:
    unit = str(log[f"{dim}_unit"].sel({dim: name}).item())
    return name if unit == "1" else f"{name} [{unit}]"


def _values(log: xr.Dataset, variable: str, name: str) -> Array | None:
    """A signal; None if this log does not have it."""
    if variable not in log or name not in names(log, str(log[variable].dims[-1])):
        return None
    values = signal(log, variable, name)
    return values if np.isfinite(values).any() else None


def _same(values: Array | None, others: Array | None) -> bool:
    return values is None or (others is not None and np.array_equal(values, others, equal_nan=True))


def _add(panel: _Panel, name: str, values: Array | None, look: Look, steps: bool = False, dots: bool = False) -> None:
    if values is not None:
        panel.curves.append(_Curve(name, values, look, steps, dots))


def _limited(panel: _Panel, log: xr.Dataset, dim: str, name: str) -> _Panel:
    found = [
        f"{dim}_{side}" for side in ("lower", "upper") if f"{dim}_{side}" in log.coords and name in names(log, dim)
    ]
    for side in found:
        values = log[side].sel({dim: name}).to_numpy()
        if len(np.unique(values)) > 1:
            panel.curves.append(_Curve("Limit", np.where(np.isinf(values), np.nan, values), LIMIT, steps=True))
        elif np.isfinite(values).all():
            panel.limits += (float(values.flat[0]),)
    return panel


def _size(values: Array) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def _draw(axes: Any, time: Array, panel: _Panel, largest: float) -> None:
    for curve in reversed(panel.curves):
        look = curve.look
        if curve.dots:
            axes.plot(time, curve.values, ".", color=look.color, markersize=2.0, label=curve.name)
            continue
        style = {"color": look.color, "linestyle": DASHES[look.dash], "linewidth": look.width, "label": curve.name}
        axes.plot(time, curve.values, drawstyle="steps-post" if curve.steps else "default", **style)
    axes.set_title(panel.title, loc="left", fontsize=9)
    low, high = _reach(panel, largest)
    span, far = high - low, list[str]()
    for limit in panel.limits:
        if low - span <= limit <= high + span:
            axes.axhline(limit, color=LIMIT.color, linestyle=DASHES[LIMIT.dash], linewidth=1.0, label="Limit")
            low, high = min(low, limit), max(high, limit)
        else:
            far.append(f"{limit:.4g}")
    axes.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    if far:  # they would flatten the curves
        axes.set_title(
            f"limit{'s' if len(far) > 1 else ''} {', '.join(far)}", loc="right", fontsize=8, color=LIMIT.color
        )


def _reach(panel: _Panel, largest: float) -> tuple[float, float]:
    """Lowest and highest value to show: all that is true or wanted, and what is measured not too far from that."""
    low, high = 0.0, 0.0
    for i, curve in enumerate(panel.curves):
        values = curve.values[np.isfinite(curve.values)]
        least, most = float(values.min()), float(values.max())
        if i == 0:
            low, high = least, most
        elif curve.name in ("Measured", "Estimated") and high > low:
            low, high = min(low, max(least, 2.0 * low - high)), max(high, min(most, 2.0 * high - low))
        else:
            low, high = min(low, least), max(high, most)
    limit, size = min(map(abs, panel.limits), default=0.0), max(abs(low), abs(high))
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


def _draw_statuses(axes: Any, log: xr.Dataset) -> None:
    time, found, statuses = log["time"].to_numpy(), log["status"].to_numpy().astype(str), _statuses(log)
    solved = {status.name for status in Status if status.solved}
    for height, status in enumerate(reversed(statuses)):
        color = PLANT.color if status in solved else LIMIT.color
        axes.plot(time[found == status], np.full((found == status).sum(), height), "|", color=color, markersize=6.0)
    axes.set_yticks(range(len(statuses)), reversed(statuses), fontsize=7)
    axes.set_ylim(-0.6, len(statuses) - 0.4)
    axes.set_xlabel("Time [s]")
    axes.set_title("Status of each step", loc="left", fontsize=9)
    axes.grid(axis="y", visible=False)
