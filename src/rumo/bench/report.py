"""From times to percentiles, ratios and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rumo.bench.measuring import medians
from rumo.bench.runners import Outcome
from rumo.report.contents import Report, Section
from rumo.report.machine import machine
from rumo.report.tables import Table, number
from rumo.signals import Array
from rumo.simulation.replay import Recording

WARM_UP = 10
"""Samples left out: caches are cold and the first guess is one at rest."""

PERCENTILES = {"p50": 50.0, "p99": 99.0, "p999": 99.9, "max": 100.0}
PHASES = ("prepare_us", "feedback_us", "total_us")
GROWTH = (50, 200)
"""Horizons between which a sweep says how a step grows."""


def summary(replays: Mapping[str, Sequence[Outcome]], recording: Recording, scenario: str) -> dict[str, Any]:
    """Percentiles of each runner's times in microseconds, and their ratios to those of `rti` on the same samples.

    `difference` is how far commands are from those of the recorded drive, the largest in units of the inputs' ranges;
    `failed` are samples that were not solved, and `remarks` what runners say, such as a QP solver.
    """
    times = {name: medians(outcomes) for name, outcomes in replays.items()}
    ratios = {name: _ratios(values, times["rti"][: len(values)]) for name, values in times.items()}
    last = {name: outcomes[-1] for name, outcomes in replays.items()}
    return {
        "machine": machine(),
        "horizon": recording.problem.horizon,
        "scenario": scenario,
        "samples": {name: max(len(values) - WARM_UP, 0) for name, values in times.items()},
        "controllers": {name: percentiles_of_phases(values) for name, values in times.items()},
        "ratios": ratios,
        "difference": {
            name: _difference(outcome.commands, recording)
            for name, outcome in last.items()
            if outcome.commands is not None
        },
        "failed": {name: outcome.failed for name, outcome in last.items() if outcome.commands is not None},
        "remarks": {name: outcome.remark for name, outcome in last.items() if outcome.remark},
    }


def _difference(commands: Array, recording: Recording) -> float:
    """The command of a sample is what is applied a delay later: the next sample is told."""
    n = min(len(commands), len(recording) - 1)
    driven = recording.applied[WARM_UP + 1 : n + 1, -1] / recording.problem.input_scales
    return float(np.abs(commands[WARM_UP:n] - driven).max())


def _ratios(values: Array, ours: Array) -> dict[str, dict[str, float]]:
    theirs, rti = percentiles_of_phases(values), percentiles_of_phases(ours)
    return {
        phase: {p: theirs[phase][p] / rti[phase][p] for p in PERCENTILES} for phase in PHASES if rti[phase]["p50"] > 0.0
    }


def percentiles_of_phases(times: Array) -> dict[str, dict[str, float]]:
    """Of times (n, 2), without those of the first samples."""
    kept = times[WARM_UP:]
    columns = dict(zip(PHASES, (kept[:, 0], kept[:, 1], kept.sum(axis=1)), strict=True))
    return {phase: percentiles(values) for phase, values in columns.items()}


def percentiles(values: Array) -> dict[str, float]:
    """Those that tables show."""
    return {name: float(np.percentile(values, share)) for name, share in PERCENTILES.items()}


def report(runs: Sequence[Mapping[str, Any]]) -> Report:
    """What one run or several say, each a `summary`, with `qp_solvers` if those were measured."""
    title = f"Microseconds; {runs[0]['machine']['processor']}"
    if len(runs) > 1:
        sections = [
            Section(f"{phase.removesuffix('_us')}, {drive}; microseconds", [_phase_table(here, phase)], brief=True)
            for drive, here in _drives(runs).items()
            for phase in reversed(PHASES)
        ]
        grown = growth_table(runs)
        if grown.rows:
            sections.append(Section(f"p50 at N = {GROWTH[1]} over N = {GROWTH[0]}", [grown], brief=True))
        sections.append(Section("Solvers", [solved_table(runs)], brief=True))
        return Report("How fast", title, {"machine": runs[0]["machine"], "runs": list(runs)}, sections)
    (run,) = runs
    sections = [Section(f"{title}; N = {run['horizon']}, {run['scenario']}", [percentile_table(run)], brief=True)]
    if run["difference"]:
        sections.append(Section("Solvers", [solved_table(runs)], brief=True))
    if "qp_solvers" in run:
        heading = "QP solvers, cold, called from Python; microseconds"
        sections.append(Section(heading, [solver_table(run["qp_solvers"])], brief=True))
    return Report("How fast", title, run, sections)


def percentile_table(content: Mapping[str, Any]) -> Table:
    """One run: every percentile of every phase, and the ratio of the median to `rti`."""
    rows = [
        [
            name if phase == PHASES[0] else "",
            phase.removesuffix("_us"),
            *_figures(content, name, phase),
        ]
        for name in content["controllers"]
        for phase in PHASES
    ]
    return Table(["controller", "phase", *PERCENTILES, "p50 / rti"], rows, words=(0, 1))


def _phase_table(runs: Sequence[Mapping[str, Any]], phase: str) -> Table:
    """A drive and a phase: every percentile of every controller and horizon, and the ratio of the median to `rti`."""
    names = dict.fromkeys(name for run in runs for name in run["controllers"])
    rows = [
        [name if i == 0 else "", number(run["horizon"]), *_figures(run, name, phase)]
        for name in names
        for i, run in enumerate(run for run in runs if name in run["controllers"])
    ]
    return Table(["controller", "N", *PERCENTILES, "p50 / rti"], rows)


def _figures(run: Mapping[str, Any], name: str, phase: str) -> list[str]:
    values, ratios = run["controllers"][name][phase], run["ratios"][name].get(phase)
    return [*(microseconds(values[p]) for p in PERCENTILES), "-" if ratios is None else f"{ratios['p50']:,.2f}"]


def growth_table(runs: Sequence[Mapping[str, Any]]) -> Table:
    """By controller and drive: how many times longer the median step takes on the longer horizon."""
    totals = {
        (name, run["scenario"], run["horizon"]): values["total_us"]["p50"]
        for run in runs
        for name, values in run["controllers"].items()
    }
    drives, short, long = list(_drives(runs)), *GROWTH

    def grown(name: str, drive: str) -> str:
        pair = totals.get((name, drive, short)), totals.get((name, drive, long))
        return f"{pair[1] / pair[0]:.1f}" if pair[0] and pair[1] else "-"

    rows = [[name, *(grown(name, drive) for drive in drives)] for name in dict.fromkeys(key[0] for key in totals)]
    return Table(["controller", *drives], [row for row in rows if set(row[1:]) != {"-"}])


def solved_table(runs: Sequence[Mapping[str, Any]]) -> Table:
    """What other solvers did: the QP solver chosen, samples not solved, commands beside those of the drive."""
    rows = [
        [
            name,
            run["scenario"],
            number(run["horizon"]),
            run["remarks"].get(name, "-"),
            number(run["failed"][name]),
            f"{difference:.0e}",
        ]
        for run in runs
        for name, difference in run["difference"].items()
    ]
    return Table(["controller", "drive", "N", "QP solver", "failed", "difference"], rows, words=(0, 1, 3))


def solver_summary(results: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Percentiles of each QP solver's times, how many programs it solved, how far its answers were from the core's."""
    return {
        name: percentiles(result["us"])
        | {"solved": result["solved"], "difference": result["difference"] if result["solved"] else None}
        for name, result in results.items()
    }


def solver_table(content: Mapping[str, Any]) -> Table:
    """QP solvers: every percentile, and the ratio of the median to the core's."""
    heads = ["solver", *PERCENTILES, "p50 / core", "solved", "difference"]
    rows = [
        [
            name,
            *(microseconds(values[p]) for p in PERCENTILES),
            f"{values['p50'] / content['core']['p50']:,.1f}",
            number(values["solved"]),
            "-" if values["difference"] is None else f"{values['difference']:.0e}",
        ]
        for name, values in content.items()
    ]
    return Table(heads, rows)


def microseconds(value: float) -> str:
    """A time for readers."""
    return f"{value:.1f}" if value < 100.0 else number(value)


def _drives(runs: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    drives: dict[str, list[Mapping[str, Any]]] = {}
    for run in runs:
        drives.setdefault(run["scenario"], []).append(run)
    return drives
