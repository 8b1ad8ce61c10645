"""Who loses the car where, and what it costs the others."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rumo.report.contents import Section
from rumo.report.tables import Table, number
from rumo.studies.linearization.charts import linearization_panels
from rumo.studies.linearization.summary import Logs, at_values, cost_ratios, lost_at, quantity
from rumo.studies.looks import label

NOTHING = "nothing more"


def sections(content: Mapping[str, Any], logs: Logs) -> list[Section]:
    """What is shown of a summary, and of the logs by sweep, value and controller."""
    return [
        Section(
            "Who is lost where, and what the others cost", [overview_table(content), *findings(content)], brief=True
        ),
        Section("Figures", linearization_panels(content, logs) if content["sweeps"] else []),
        *(Section(quantity(sweep), [sweep_table(sweep)]) for sweep in content["sweeps"].values()),
    ]


def findings(content: Mapping[str, Any]) -> list[str]:
    """A sentence or two for each sweep of a summary: who is lost where, what the RTI loses, where LTV is better."""
    return [_finding(sweep) for sweep in content["sweeps"].values()]


def _finding(sweep: Mapping[str, Any]) -> str:
    runs = sweep["controllers"]
    lost = "; ".join(
        f"{label(name)} is lost {at_values(sweep, lost_at(each)) or 'nowhere'}" for name, each in runs.items()
    )
    text = f"{sweep['title']}: {lost}."
    for name in ("rti", "plain", "ltv"):
        ratios = cost_ratios(sweep, name)
        if np.isfinite(ratios).any():
            extremes = dict.fromkeys((int(np.nanargmin(ratios)), int(np.nanargmax(ratios))))
            costs = {i: _percent(ratios[i]) for i in extremes}
            span = " to ".join(f"{percent} {at_values(sweep, [i])}" for i, percent in costs.items()) + " than"
            if set(costs.values()) == {NOTHING}:
                span = "as much as"
            text += f" Where neither is lost, {label(name)} costs {span} the direct NLP."
    if {"rti", "ltv"} <= set(runs):
        pairs = [(runs["ltv"][i], runs["rti"][i]) for i in range(len(sweep["values"]))]
        closer = [i for i, (ltv, rti) in enumerate(pairs) if not ltv["lost"] and (rti["lost"] or _closer(ltv, rti))]
        if closer:
            text += f" LTV tracks closer than RTI {at_values(sweep, closer)}."
    return text


def _closer(run: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    key = "tracking_error_rms_after_2s_m"
    return run[key] is not None and other[key] is not None and run[key] < other[key]


def _percent(ratio: float) -> str:
    percent = 100.0 * abs(ratio - 1.0)
    text = f"{percent:.{0 if percent >= 10.0 else 1}f}"
    return NOTHING if text == "0.0" else f"{text} % {'more' if ratio >= 1.0 else 'less'}"


def overview_table(content: Mapping[str, Any]) -> Table:
    """How each controller came through each sweep."""
    rows: list[list[str]] = []
    for sweep in content["sweeps"].values():
        for name, runs in sweep["controllers"].items():
            ratios = cost_ratios(sweep, name)
            rows.append(
                [
                    sweep["title"] if name == next(iter(sweep["controllers"])) else "",
                    label(name),
                    at_values(sweep, lost_at(runs)).removeprefix("at ") or "-",
                    number(float(np.nanmax(ratios))) if np.isfinite(ratios).any() else "-",
                    f"{100.0 * np.mean([run['unsolved_share'] for run in runs]):.2g}",
                    str(sum(run["violated_steps"] for run in runs)),
                    number(float(np.median([run["step_time_us"] for run in runs]))),
                ]
            )
    heads = ["", "", "Lost at", "Largest cost\nover NLP's", "Unsolved\nsteps [%]", "Steps that\nviolate", "Step [us]"]
    return Table(heads, rows, words=(0, 1, 2))


def sweep_table(sweep: Mapping[str, Any]) -> Table:
    """Cost and RMS error after 2 s [m] of each drive of a sweep, from a summary's entry of it."""
    heads = [quantity(sweep)]
    rows = [[f"{value:g}"] for value in sweep["values"]]
    for key, words in (("cost", "cost"), ("tracking_error_rms_after_2s_m", "RMS [m]")):
        for name, runs in sweep["controllers"].items():
            heads.append(f"{label(name)}\n{words}")
            for row, run in zip(rows, runs, strict=True):
                row.append("lost" if run["lost"] else number(run[key]))
    return Table(heads, rows)
