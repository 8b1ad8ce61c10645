"""Small figures of a drive, from its log: where it went, and how far it was from where it should have been."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rumo.campaigns.report.looks import slim
from rumo.report.charts import REFERENCE, Chart, Figure, Line, Look
from rumo.signals import Array
from rumo.simulation.log import names, signal
from rumo.simulation.variables import SKIPPED
from rumo.status import Status
from rumo.studies.kpis import SETTLED, tracking_error

if TYPE_CHECKING:
    import xarray as xr

DROVE = Look("#0072B2", "solid", 1.4)
AT_WORST = Look("#D55E00", "", 1.0, "x", 6.0)
UNSOLVED = Look("#CC79A7", "", 1.0, "circle", 3.0)
SAMPLES = 240
"""Of a curve, at most."""
HEIGHT = 1.7
"""Of a figure in print [inch]."""
LONG = 5.0
"""A path that is so many times as long as it is wide is drawn with axes of their own scales."""
SOLVED = (SKIPPED, *(status.name for status in Status if status.solved))


def drive_figures(log: xr.Dataset, key: str) -> list[Figure]:
    """What a drive looked like; nothing of a log without samples."""
    if log.sizes["time"] < 2:
        return []
    outputs, states = names(log, "output"), names(log, "plant_state")
    placed = {"p_x", "p_y"} <= {*states}
    found: list[Figure] = [_place(log, key, reference={"p_x", "p_y"} <= {*outputs})] if placed else []
    if placed and {"p_x", "p_y"} <= {*outputs}:
        values = {"Distance from the reference [m]": tracking_error(log)}
    else:
        values = {f"{name} [{_unit(log, name)}]": _less(log, name) for name in outputs[: 2 - len(found)]}
        values = {f"Off the reference: {title}": of for title, of in values.items() if np.isfinite(of).any()}
    return [*found, *(_over_time(log, f"{key}-{i}", title, of) for i, (title, of) in enumerate(values.items()))]


def _place(log: xr.Dataset, key: str, *, reference: bool) -> Chart:
    x, y = signal(log, "plant", "p_x"), signal(log, "plant", "p_y")
    lines: list[Line] = []
    worst: list[Line] = []
    if reference:
        error = tracking_error(log)
        to = signal(log, "reference", "p_x"), signal(log, "reference", "p_y")
        shown = _shown(error)
        lines.append(Line("Reference", slim(to[0][shown]), slim(to[1][shown]), REFERENCE))
        settled = np.where(log["time"].to_numpy() >= SETTLED, error, np.nan)  # as figures of merit have it
        late = bool(np.isfinite(settled).any())
        at = int(np.nanargmax(settled if late else error)) if np.isfinite(error).any() else 0
        name = f"Farthest off after {SETTLED:g} s" if late else "Farthest off"
        worst.append(Line(name, slim(x[at : at + 1]), slim(y[at : at + 1]), AT_WORST))
    shown = _shown(np.hypot(x, y))
    lines.append(Line("Plant", slim(x[shown]), slim(y[shown]), DROVE))
    spans = float(np.ptp(x[np.isfinite(x)])), float(np.ptp(y[np.isfinite(y)]))
    return Chart(
        f"place-{key}",
        "Where it went",
        "p_x [m]",
        "p_y [m]",
        (*lines, *worst),
        equal=max(spans) < LONG * max(min(spans), 1e-9),
        height=HEIGHT,
    )


def _over_time(log: xr.Dataset, key: str, title: str, values: Array) -> Chart:
    time, shown = log["time"].to_numpy(), _shown(np.abs(values))
    unsolved = np.flatnonzero(~np.isin(log["status"].to_numpy().astype(str), SOLVED))
    if len(unsolved) > SAMPLES:
        unsolved = unsolved[np.linspace(0, len(unsolved) - 1, SAMPLES).astype(int)]
    lines = [Line("Plant", slim(time[shown]), slim(values[shown]), DROVE)]
    if len(unsolved):
        lines.append(Line("Not solved", slim(time[unsolved]), slim(values[unsolved]), UNSOLVED))
    words, _, unit = title.partition(" [")
    return Chart(f"over-time-{key}", words, "Time [s]", f"[{unit}", tuple(lines), height=HEIGHT)


def _shown(size: Array) -> NDArray[np.int_]:
    """Samples that are drawn: evenly spread, the largest of each stretch among them."""
    count = len(size)
    if count <= SAMPLES:
        return np.arange(count)
    filled = np.where(np.isfinite(size), size, -np.inf)
    parts = np.array_split(np.arange(count), SAMPLES - 2)
    return np.unique([0, *(int(part[np.argmax(filled[part])]) for part in parts), count - 1])


def _less(log: xr.Dataset, name: str) -> Array:
    variable = "true_outputs" if "true_outputs" in log else "estimated_outputs"
    if variable not in log or name not in names(log, str(log[variable].dims[-1])):
        return np.full(log.sizes["time"], np.nan)
    return signal(log, variable, name) - signal(log, "reference", name)


def _unit(log: xr.Dataset, name: str) -> str:
    return str(log["output_unit"].sel(output=name).item()) if "output_unit" in log.variables else "1"
