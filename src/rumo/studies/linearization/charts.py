"""The figures of the linearisation study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.report.charts import LIMIT, REFERENCE, Line, Look, Panels
from rumo.simulation.log import signal
from rumo.studies.kpis import tracking_error
from rumo.studies.linearization.summary import FAR, Logs, at_values, cost_ratios, lost_at, quantity
from rumo.studies.looks import label, look

if TYPE_CHECKING:
    import xarray as xr

SWEPT = "What grows [unit in the title]"
MARKERS = {"rti": "circle", "nlp": "square", "ltv": "triangle-up"}


def linearization_panels(content: Mapping[str, Any], logs: Logs) -> list[Panels]:
    """Cost, its ratio to the NLP's and error over each sweep, and where the cars went when LTV is first lost."""
    figures = [
        _over_sweeps(content, "cost", "Closed-loop cost", "Cost [1]", "cost"),
        Panels(
            "cost-over-nlp",
            "Closed-loop cost over the direct NLP's, where neither is lost",
            SWEPT,
            "Ratio [1]",
            tuple((quantity(sweep), _ratio_lines(sweep)) for sweep in content["sweeps"].values()),
            shared="",
        ),
        _over_sweeps(content, "error", "RMS tracking error after 2 s", "Error [m]", "tracking_error_rms_after_2s_m"),
    ]
    paths = [
        (
            f"{sweep['title']}: {at_values(sweep, lost[:1]).removeprefix('at ')}",
            _trajectories(logs[key][sweep["values"][lost[0]]]),
        )
        for key, sweep in content["sweeps"].items()
        if (lost := lost_at(sweep["controllers"].get("ltv", [])))
    ]
    if paths:
        title = "The first drives in which LTV is lost"
        figures.append(Panels("trajectories", title, "Position p_x [m]", "Position p_y [m]", tuple(paths), shared=""))
    return figures


def _look(name: str) -> Look:
    return replace(look(name), marker=MARKERS.get(name, "diamond"))


def _over_sweeps(content: Mapping[str, Any], key: str, title: str, y_label: str, kpi: str) -> Panels:
    panels: list[tuple[str, tuple[Line, ...]]] = []
    for sweep in content["sweeps"].values():
        values = np.array(sweep["values"])
        lines, lost = [], []
        for name, runs in reversed(list(sweep["controllers"].items())):
            y = np.array([np.nan if run[kpi] is None else run[kpi] for run in runs])
            lines.append(Line(label(name), values, y, _look(name)))
            lost += [(values[i], y[i]) for i in lost_at(runs)]
        # Gaps between the points leave markers without a line.
        points = np.array([row for point in lost for row in (point, (np.nan, np.nan))]).reshape(-1, 2)
        lines.insert(0, Line("Lost", points[:, 0], points[:, 1], Look(LIMIT.color, "solid", 0.0, "x")))
        panels.append((quantity(sweep), tuple(lines)))
    return Panels(key, title, SWEPT, y_label, tuple(panels), shared="", logarithmic="y")


def _ratio_lines(sweep: Mapping[str, Any]) -> tuple[Line, ...]:
    values = np.array(sweep["values"])
    lines = [
        Line(label(name), values, cost_ratios(sweep, name), _look(name))
        for name in reversed(sweep["controllers"])
        if name != "nlp" and "nlp" in sweep["controllers"]
    ]
    return (*lines, Line(label("nlp"), values, np.ones(len(values)), REFERENCE))


def _trajectories(logs: Mapping[str, xr.Dataset]) -> tuple[Line, ...]:
    lines: list[Line] = []
    longest = max(logs.values(), key=lambda log: log.sizes["time"])
    for name, log in reversed(list(logs.items())):
        error = tracking_error(log)
        far = error > FAR + error[0]
        end = int(np.argmax(far)) if far.any() else len(far)
        x, y = (signal(log, "plant", axis)[:end] for axis in ("p_x", "p_y"))
        lines.append(Line(label(name), x, y, look(name)))
    x, y = (signal(longest, "reference", name) for name in ("p_x", "p_y"))
    return (*lines, Line("Reference", x, y, REFERENCE))
