"""From times to percentiles, ratios and a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rumo.report.contents import Report, Section
from rumo.report.machine import machine
from rumo.report.tables import Table, number
from rumo.signals import Array

WARM_UP = 10
"""Samples left out: caches are cold and the first guess is one at rest."""

PERCENTILES = {"p50": 50.0, "p99": 99.0, "p999": 99.9, "max": 100.0}
PHASES = ("prepare_us", "feedback_us", "total_us")


def report(runs: Sequence[Mapping[str, Any]]) -> Report:
    """What one run or several say, each a `summary`, with `qp_solvers` if those were measured."""
    title = f"Microseconds; {runs[0]['machine']['processor']}"
    if len(runs) > 1:
        sections = [
            Section(f"{title}; medians of preparation + feedback (ratio of the sum); {drive}", [table], brief=True)
            for drive, table in sweep_tables(runs).items()
        ]
        return Report("How fast", title, {"machine": runs[0]["machine"], "runs": list(runs)}, sections)
    (run,) = runs
    sections = [Section(f"{title}; N = {run['horizon']}, {run['scenario']}", [percentile_table(run)], brief=True)]
    if "qp_solvers" in run:
        heading = "QP solvers, cold, called from Python; microseconds"
        sections.append(Section(heading, [solver_table(run["qp_solvers"])], brief=True))
    return Report("How fast", title, run, sections)


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
            f"{content['ratios'][name][phase]['p50']:,.2f}",
        ]
        for name, values in content["controllers"].items()
        for phase in PHASES
    ]
    return Table(heads, rows, words=(0, 1))


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
            f"{values['p50'] / content['core']['p50']:,.1f}",
            number(values["solved"]),
            "-" if values["difference"] is None else f"{values['difference']:.0e}",
        ]
        for name, values in content.items()
    ]
    return Table(heads, rows)


def sweep_tables(runs: Sequence[Mapping[str, Any]]) -> dict[str, Table]:
    """Several runs, by drive: medians of preparation + feedback, and the ratio of their sum to `rti`."""
    tables: dict[str, Table] = {}
    for drive in dict.fromkeys(run["scenario"] for run in runs):
        here = [run for run in runs if run["scenario"] == drive]
        names = dict.fromkeys(name for run in here for name in run["controllers"])
        rows = [[name, *(_medians(run, name) for run in here)] for name in names]
        tables[drive] = Table(["controller", *(f"N = {run['horizon']}" for run in here)], rows)
    return tables


def _medians(run: Mapping[str, Any], name: str) -> str:
    if name not in run["controllers"]:
        return "-"
    values = run["controllers"][name]
    parts = " + ".join(_microseconds(values[phase]["p50"]) for phase in PHASES[:2])
    return f"{parts} ({run['ratios'][name]['total_us']['p50']:,.1f})"


def _microseconds(value: float) -> str:
    return f"{value:.1f}" if value < 100.0 else number(value)
