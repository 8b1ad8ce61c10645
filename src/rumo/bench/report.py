"""From times to percentiles, ratios and a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rumo.report.machine import machine
from rumo.report.tables import Table
from rumo.signals import Array

WARM_UP = 10
"""Samples left out: caches are cold and the first guess is one at rest."""

PERCENTILES = {"p50": 50.0, "p99": 99.0, "p999": 99.9, "max": 100.0}
PHASES = ("prepare_us", "feedback_us", "total_us")


def summary(times: Mapping[str, Array], horizon: int, scenario: str) -> dict[str, Any]:
    """Percentiles of each controller's times (n, 2) in microseconds, and their ratios to `rti`."""
    controllers = {name: _percentiles(values[WARM_UP:]) for name, values in times.items()}
    ratios = {
        name: {
            phase: {p: values[phase][p] / controllers["rti"][phase][p] for p in PERCENTILES}
            for phase in PHASES
            if controllers["rti"][phase]["p50"] > 0.0
        }
        for name, values in controllers.items()
    }
    return {
        "machine": machine(),
        "horizon": horizon,
        "scenario": scenario,
        "samples": {name: max(len(values) - WARM_UP, 0) for name, values in times.items()},
        "controllers": controllers,
        "ratios": ratios,
    }


def _percentiles(times: Array) -> dict[str, dict[str, float]]:
    columns = dict(zip(PHASES, (times[:, 0], times[:, 1], times.sum(axis=1)), strict=True))
    return {phase: _percentiles_of(values) for phase, values in columns.items()}


def _percentiles_of(values: Array) -> dict[str, float]:
    return {name: float(np.percentile(values, share)) for name, share in PERCENTILES.items()}


def percentile_table(content: Mapping[str, Any]) -> Table:
    """One run: every percentile of every phase, and the ratio of the median to `rti`."""
    heads = ["controller", "phase", *PERCENTILES, "p50 / rti"]
    rows = [
        [
            name if phase == PHASES[0] else "",
            phase.removesuffix("_us"),
            *(_microseconds(values[phase][p]) for p in PERCENTILES),
            f"{content['ratios'][name][phase]['p50']:.2f}",
        ]
        for name, values in content["controllers"].items()
        for phase in PHASES
    ]
    return Table(heads, rows)


def solver_summary(results: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Percentiles of each QP solver's times, how many programs it solved, how far its answers were from the core's."""
    return {
        name: _percentiles_of(result["us"])
        | {"solved": result["solved"], "difference": result["difference"] if result["solved"] else None}
        for name, result in results.items()
    }


def solver_table(content: Mapping[str, Any]) -> Table:
    """QP solvers: every percentile, and the ratio of the median to the core's."""
    heads = ["solver", *PERCENTILES, "p50 / core", "solved", "difference"]
    rows = [
        [
            name,
            *(_microseconds(values[p]) for p in PERCENTILES),
            f"{values['p50'] / content['core']['p50']:.1f}",
            str(values["solved"]),
            "-" if values["difference"] is None else f"{values['difference']:.0e}",
        ]
        for name, values in content.items()
    ]
    return Table(heads, rows)


def sweep_table(runs: list[dict[str, Any]]) -> Table:
    """Several runs: median of preparation + feedback, and the ratio of their sum to `rti`."""
    names = list(dict.fromkeys(name for run in runs for name in run["controllers"]))
    rows: list[list[str]] = []
    for run in runs:
        row = [run["scenario"], str(run["horizon"])]
        for name in names:
            if name not in run["controllers"]:
                row.append("")
                continue
            values = run["controllers"][name]
            parts = " + ".join(_microseconds(values[phase]["p50"]) for phase in PHASES[:2])
            row.append(f"{parts} ({run['ratios'][name]['total_us']['p50']:.1f})")
        rows.append(row)
    return Table(["drive", "N", *names], rows)


def _microseconds(value: float) -> str:
    return f"{value:.1f}" if value < 100.0 else f"{value:.0f}"
