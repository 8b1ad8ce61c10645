"""The linearisation study's summary, tables, figures and page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.problem import Problem
from rumo.report.charts import LIMIT, REFERENCE, Line, Look, Panels, label, look
from rumo.report.kpis import SETTLED, driving_kpis, tracking_error
from rumo.report.page import Section
from rumo.report.tables import Table, number
from rumo.signals import Array
from rumo.simulation.log import signal
from rumo.status import Status
from rumo.studies.linearization.study import SWEEPS, LinearizationStudy

if TYPE_CHECKING:
    import xarray as xr

FAR = 10.0
"""A car that ends farther than this from its reference point is lost [m]."""
BACKWARDS = 0.5 * np.pi
"""So is one that has pointed farther than this away from its path [rad]."""
SWEPT = "What grows [unit in the title]"
MARKERS = {"rti": "circle", "nlp": "square", "ltv": "triangle-up"}

Logs = Mapping[str, Mapping[str, Sequence["xr.Dataset"]]]
"""By sweep and controller, in the order of the sweep's values."""


def summary(study: LinearizationStudy, logs: Logs) -> dict[str, Any]:
    """Content of `summary.json`.

    Parameters
    ----------
    study : LinearizationStudy
        What was asked for.
    logs : mapping of str to mapping of str to sequence of Dataset
        What came of it, by sweep and controller.
    """
    problem, steps = study.base.problem(), round(study.duration / study.base.sampling_time)
    sweeps: dict[str, Any] = {}
    for sweep, by_controller in logs.items():
        runs = {name: [outcome(log, problem, steps) for log in each] for name, each in by_controller.items()}
        for each in runs.values():
            for i, run in enumerate(each):
                run["cost_over_nlp"] = run["cost"] / runs["nlp"][i]["cost"] if "nlp" in runs else None
        values = [float(value) for value in study.sweeps[sweep]]
        about = {"title": SWEEPS[sweep].title, "unit": SWEEPS[sweep].unit, "values": values}
        sweeps[sweep] = about | {"controllers": runs}
    return {
        "study": "linearization",
        "seed": study.seed,
        "sampling_time_s": problem.sampling_time,
        "horizon": problem.horizon,
        "duration_s": study.duration,
        "sweeps": sweeps,
    }


def outcome(log: xr.Dataset, problem: Problem, steps: int) -> dict[str, Any]:
    """What became of a drive; None where it is too short to say.

    Parameters
    ----------
    log : Dataset
        Of the drive.
    problem : Problem
        That the controller solved.
    steps : int
        Number of samples of a whole drive.

    Returns
    -------
    dict
        Errors as in `driving_kpis`; `across_rms_after_2s_m`: their part across the path; `cost`: see
        `closed_loop_cost`; `unsolved_share`: share of steps without a solution; `violated_steps`: those whose plan
        violates a soft constraint, as the controller sees it; `step_time_us`: median; `lost`: the car has pointed
        backwards, or has ended far from its reference point, or the plant could not be integrated to the end.
    """
    kpis, error = driving_kpis(log), tracking_error(log)
    turned = np.abs(signal(log, "plant", "psi") - signal(log, "reference", "psi"))
    across = _across(log)[log["time"].to_numpy() >= SETTLED]
    statuses = [Status[str(status)] for status in log["status"].to_numpy()]
    return {
        "tracking_error_rms_m": kpis["tracking_error_rms_m"],
        "tracking_error_rms_after_2s_m": kpis["tracking_error_rms_after_2s_m"],
        "across_rms_after_2s_m": float(np.sqrt(np.mean(across**2))) if across.size else None,
        "tracking_error_max_m": float(error.max()),
        "cost": closed_loop_cost(log, problem),
        "unsolved_share": sum(not status.solved for status in statuses) / len(statuses),
        "violated_steps": statuses.count(Status.SOFT_VIOLATED),
        "step_time_us": kpis["step_time_us"]["p50"],
        "lost": bool(turned.max() > BACKWARDS or error[-1] > FAR or len(error) < steps),
    }


def closed_loop_cost(log: xr.Dataset, problem: Problem) -> float:
    """The problem's objective along the trajectory that was driven.

    Squared errors of the tracked outputs at each sample but the first, and squared increments of the inputs that were
    applied, with the weights of stage 1. Headings are not wrapped: a car that has turned once around pays for it.
    The price of soft constraints is left out; the plant's tyres have no friction circle to violate.
    """
    errors = np.column_stack([signal(log, "plant", name) - signal(log, "reference", name) for name in problem.outputs])
    moves = np.diff(log["applied"].to_numpy(), axis=0)
    return float((errors[1:] ** 2 @ problem.output_weights[0]).sum() + (moves**2 @ problem.move_weights[0]).sum())


def _across(log: xr.Dataset) -> Array:
    """Distance of the plant from the reference's tangent at each sample (K,) [m]."""
    psi = signal(log, "reference", "psi")
    dx, dy = (signal(log, "plant", name) - signal(log, "reference", name) for name in ("p_x", "p_y"))
    return dy * np.cos(psi) - dx * np.sin(psi)


def findings(content: Mapping[str, Any]) -> list[str]:
    """A sentence or two for each sweep of a summary: who is lost where, what the RTI loses, where LTV is better."""
    return [_finding(sweep) for sweep in content["sweeps"].values()]


def _finding(sweep: Mapping[str, Any]) -> str:
    runs = sweep["controllers"]
    lost = "; ".join(f"{label(name)} is lost {_at(sweep, _lost(each)) or 'nowhere'}" for name, each in runs.items())
    text = f"{sweep['title']}: {lost}."
    for name in ("rti", "ltv"):
        ratios = _ratios(sweep, name)
        if np.isfinite(ratios).any():
            extremes = dict.fromkeys((int(np.nanargmin(ratios)), int(np.nanargmax(ratios))))
            span = " to ".join(f"{_percent(ratios[i])} {_at(sweep, [i])}" for i in extremes)
            text += f" Where neither is lost, {label(name)} costs {span} than the direct NLP."
    if {"rti", "ltv"} <= set(runs):
        pairs = [(runs["ltv"][i], runs["rti"][i]) for i in range(len(sweep["values"]))]
        closer = [i for i, (ltv, rti) in enumerate(pairs) if not ltv["lost"] and (rti["lost"] or _closer(ltv, rti))]
        if closer:
            text += f" LTV tracks closer than RTI {_at(sweep, closer)}."
    return text


def _closer(run: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    key = "tracking_error_rms_after_2s_m"
    return run[key] is not None and other[key] is not None and run[key] < other[key]


def _percent(ratio: float) -> str:
    percent = 100.0 * abs(ratio - 1.0)
    return f"{percent:.{0 if percent >= 10.0 else 1}f} % {'more' if ratio >= 1.0 else 'less'}"


def _at(sweep: Mapping[str, Any], which: Sequence[int]) -> str:
    """ "at 4, 5 m", or nothing."""
    values = ", ".join(f"{sweep['values'][i]:g}" for i in which)
    return f"at {values} {sweep['unit']}".removesuffix(" 1") if which else ""


def _lost(runs: Sequence[Mapping[str, Any]]) -> list[int]:
    return [i for i, run in enumerate(runs) if run["lost"]]


def _ratios(sweep: Mapping[str, Any], name: str) -> Array:
    """Cost over the NLP's, NaN where either is lost or the NLP is not solved in every step."""
    runs, nlp = sweep["controllers"].get(name, []), sweep["controllers"].get("nlp", [])
    return np.array(
        [
            np.nan if run["lost"] or best["lost"] or best["unsolved_share"] else run["cost_over_nlp"]
            for run, best in zip(runs, nlp, strict=False)
        ]
    )


def overview_table(content: Mapping[str, Any]) -> Table:
    """How each controller came through each sweep."""
    rows: list[list[str]] = []
    for sweep in content["sweeps"].values():
        for name, runs in sweep["controllers"].items():
            ratios = _ratios(sweep, name)
            rows.append(
                [
                    f"{sweep['title']}, {label(name)}",
                    _at(sweep, _lost(runs)).removeprefix("at ") or "-",
                    number(float(np.nanmax(ratios))) if np.isfinite(ratios).any() else "-",
                    f"{100.0 * np.mean([run['unsolved_share'] for run in runs]):.2g}",
                    str(sum(run["violated_steps"] for run in runs)),
                    f"{np.median([run['step_time_us'] for run in runs]):.0f}",
                ]
            )
    heads = ["", "Lost at", "Largest cost\nover NLP's", "Unsolved\nsteps [%]", "Steps that\nviolate", "Step [us]"]
    return Table(heads, rows)


def sweep_table(sweep: Mapping[str, Any]) -> Table:
    """Cost and RMS error after 2 s [m] of each drive of a sweep, from a summary's entry of it."""
    heads = [_quantity(sweep)]
    rows = [[f"{value:g}"] for value in sweep["values"]]
    for key, words in (("cost", "cost"), ("tracking_error_rms_after_2s_m", "RMS [m]")):
        for name, runs in sweep["controllers"].items():
            heads.append(f"{label(name)}\n{words}")
            for row, run in zip(rows, runs, strict=True):
                row.append("lost" if run["lost"] else number(run[key]))
    return Table(heads, rows)


def _quantity(sweep: Mapping[str, Any]) -> str:
    return f"{sweep['title']} [{sweep['unit']}]"


def linearization_panels(content: Mapping[str, Any], logs: Logs) -> list[Panels]:
    """Cost, its ratio to the NLP's and error over each sweep, and where the cars went when LTV is first lost."""
    figures = [
        _over_sweeps(content, "cost", "Closed-loop cost", "Cost [1]", "cost"),
        Panels(
            "cost-over-nlp",
            "Closed-loop cost over the direct NLP's, where neither is lost",
            SWEPT,
            "Ratio [1]",
            tuple((_quantity(sweep), _ratio_lines(sweep)) for sweep in content["sweeps"].values()),
            shared="",
        ),
        _over_sweeps(content, "error", "RMS tracking error after 2 s", "Error [m]", "tracking_error_rms_after_2s_m"),
    ]
    paths = [
        (f"{sweep['title']}: {_at(sweep, lost[:1]).removeprefix('at ')}", _trajectories(logs[key], lost[0]))
        for key, sweep in content["sweeps"].items()
        if (lost := _lost(sweep["controllers"].get("ltv", [])))
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
            lost += [(values[i], y[i]) for i in _lost(runs)]
        # Gaps between the points leave markers without a line.
        points = np.array([row for point in lost for row in (point, (np.nan, np.nan))]).reshape(-1, 2)
        lines.insert(0, Line("Lost", points[:, 0], points[:, 1], Look(LIMIT.color, "solid", 0.0, "x")))
        panels.append((_quantity(sweep), tuple(lines)))
    return Panels(key, title, SWEPT, y_label, tuple(panels), shared="", logarithmic="y")


def _ratio_lines(sweep: Mapping[str, Any]) -> tuple[Line, ...]:
    values = np.array(sweep["values"])
    lines = [
        Line(label(name), values, _ratios(sweep, name), _look(name))
        for name in reversed(sweep["controllers"])
        if name != "nlp" and "nlp" in sweep["controllers"]
    ]
    return (*lines, Line(label("nlp"), values, np.ones(len(values)), REFERENCE))


def _trajectories(by_controller: Mapping[str, Sequence[xr.Dataset]], i: int) -> tuple[Line, ...]:
    lines: list[Line] = []
    longest = max((each[i] for each in by_controller.values()), key=lambda log: log.sizes["time"])
    for name, each in reversed(list(by_controller.items())):
        far = tracking_error(each[i]) > FAR + tracking_error(each[i])[0]
        end = int(np.argmax(far)) if far.any() else len(far)
        lines.append(
            Line(label(name), signal(each[i], "plant", "p_x")[:end], signal(each[i], "plant", "p_y")[:end], look(name))
        )
    x, y = (signal(longest, "reference", name) for name in ("p_x", "p_y"))
    return (*lines, Line("Reference", x, y, REFERENCE))


def linearization_sections(content: Mapping[str, Any], figures: Sequence[Panels]) -> list[Section]:
    """What the page shows: the findings, the overview, the figures, and a table for each sweep, from `summary`."""
    sweeps = [Section(_quantity(sweep), [sweep_table(sweep)]) for sweep in content["sweeps"].values()]
    return [Section("Findings", [*findings(content), overview_table(content)]), Section("Figures", figures), *sweeps]
