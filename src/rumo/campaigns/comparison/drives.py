"""Two drives, from their logs: figures of merit side by side, and what they did over time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.campaigns.comparison.together import differing
from rumo.campaigns.judging.columns import inside
from rumo.campaigns.report.pairs import signed
from rumo.campaigns.report.words import value_words
from rumo.report.charts import REFERENCE, Chart, Figure, Line, Look, Panels
from rumo.report.contents import Report, Section
from rumo.report.tables import Table, number
from rumo.simulation.log import names, signal
from rumo.studies.kpis import KPIS, Driven, kpis, tracking_error

if TYPE_CHECKING:
    import xarray as xr

FIRST, SECOND = Look("#0072B2", "solid", 1.2), Look("#E69F00", "dash", 2.6)
DIFFERENCE = Look("#009E73", "solid", 1.6)
SHARED = 8
"""Signals of a kind that are drawn, at most."""


def compare_drives(first: xr.Dataset, second: xr.Dataset, called: tuple[str, str] = ("first", "second")) -> Report:
    """Tables and figures of what differs between two drives, and its summary.

    Parameters
    ----------
    first, second : xarray.Dataset
        Their logs.
    called : tuple of str
        What they are called.
    """
    logs = dict(zip(called, (first, second), strict=True))
    found = [_flat(kpis(Driven(log))) for log in (first, second)]
    figures = {
        name: [each.get(name) for each in found]
        for name in dict.fromkeys((*found[0], *found[1]))
        if any(each.get(name) is not None for each in found)
    }
    attributes = differing(
        *({str(name): _plain(value) for name, value in log.attrs.items()} for log in (first, second))
    )
    same = _same_time(first, second)
    content = {
        "compared": list(called),
        "differs": {name: list(values) for name, values in attributes.items()},
        "kpis": figures,
    }
    rows = [
        [name, *("-" if value is None else value_words(value) for value in pair)] for name, pair in attributes.items()
    ]
    table = Table(["", *called], rows, words=(0, 1, 2))
    charts: list[Figure] = [*_places(logs), *over_time(logs), *(_differences(first, second, called) if same else [])]
    sections = [
        Section("Figures of merit", _figures(figures, called), brief=True),
        Section("What is different", [table] if rows else ["Nothing that the logs say of themselves."], brief=True),
        Section("Over time", charts or ["The drives have no signals in common."]),
    ]
    last = [float(log["time"].to_numpy()[-1]) if log.sizes["time"] else 0.0 for log in (first, second)]
    lead = f"{called[0]}, {last[0]:.4g} s, beside {called[1]}, {last[1]:.4g} s."
    return Report(f"{called[0]} and {called[1]}", lead, content, sections)


def _flat(found: Mapping[str, Any]) -> dict[str, Any]:
    """Figures of merit, those with parts once for each."""
    flat: dict[str, Any] = {}
    for key, value in found.items():
        parts = value.items() if isinstance(value, Mapping) else [("", value)]
        flat |= {f"{key}.{part}" if part else key: each for part, each in parts}
    return flat


def _figures(figures: Mapping[str, list[Any]], called: tuple[str, str]) -> list[str | Table]:
    """A table of those that differ, and names of the others."""
    by_key = {kpi.key: kpi for kpi in KPIS.values()}
    rows: list[list[str]] = []
    same: list[str] = []
    for name, (one, other) in figures.items():
        key, _, part = name.partition(".")
        kpi = by_key[key]
        title = f"{kpi.title}, {part}" if part else kpi.title
        if one == other:
            same.append(inside(title))
            continue
        less = "-" if one is None or other is None else signed(one - other)
        rows.append([title, number(one), number(other), less, "" if kpi.unit == "1" else kpi.unit])
    table = Table(["", *called, "Difference", "Unit"], rows, words=(0, 4))
    return [*([table] if rows else []), *([f"The same in both: {'; '.join(same)}."] if same else [])]


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _common(logs: Iterable[xr.Dataset], dim: str) -> list[str]:
    first, *others = (names(log, dim) for log in logs)
    return [name for name in first if all(name in other for other in others)]


def _places(logs: Mapping[str, xr.Dataset]) -> list[Chart]:
    """Where both went, if they have places."""
    if not {"p_x", "p_y"} <= {*_common(logs.values(), "plant_state")}:
        return []
    first = next(iter(logs.values()))
    lines = [
        Line(name, signal(log, "plant", "p_x"), signal(log, "plant", "p_y"), look)
        for (name, log), look in zip(logs.items(), (FIRST, SECOND), strict=True)
    ]
    if {"p_x", "p_y"} <= {*names(first, "output")}:
        lines.append(Line("Reference", signal(first, "reference", "p_x"), signal(first, "reference", "p_y"), REFERENCE))
    spans = [np.ptp(np.concatenate([of for line in lines for of in [getattr(line, axis)]])) for axis in ("x", "y")]
    equal = bool(max(spans) < 5.0 * max(min(spans), 1e-9))
    return [Chart("place", "Where they went", "p_x [m]", "p_y [m]", tuple(lines), equal=equal)]


def over_time(logs: Mapping[str, xr.Dataset]) -> list[Figure]:
    """Distances from the reference, states of the plant and inputs, as far as both have them."""
    found: list[Figure] = []
    if all({"p_x", "p_y"} <= {*names(log, "output")} & {*names(log, "plant_state")} for log in logs.values()):
        errors = _lines(logs, tracking_error)
        found.append(Chart("distance", "Distance from the reference", "Time [s]", "Distance [m]", errors))
    for dim, variable, title in (("plant_state", "plant", "States of the plant"), ("input", "applied", "Inputs")):
        panels = [
            (
                f"{name} [{_unit(logs, dim, name)}]",
                _lines(logs, lambda log, variable=variable, name=name: signal(log, variable, name), dim == "input"),
            )
            for name in _common(logs.values(), dim)[:SHARED]
        ]
        if panels:
            found.append(Panels(variable, title, "Time [s]", "", tuple(panels), shared="x"))
    return found


def _lines(logs: Mapping[str, xr.Dataset], of: Any, steps: bool = False) -> tuple[Line, ...]:
    return tuple(
        Line(name, log["time"].to_numpy(), of(log), look, steps)
        for (name, log), look in zip(logs.items(), (FIRST, SECOND), strict=False)
    )


def _differences(first: xr.Dataset, second: xr.Dataset, called: tuple[str, str]) -> list[Panels]:
    """First less second, as long as both go on."""
    count = min(first.sizes["time"], second.sizes["time"])
    time = first["time"].to_numpy()[:count]
    panels: list[tuple[str, tuple[Line, ...]]] = []
    for dim, variable in (("plant_state", "plant"), ("input", "applied")):
        for name in _common((first, second), dim)[:SHARED]:
            less = signal(first, variable, name)[:count] - signal(second, variable, name)[:count]
            unit = _unit({"": first}, dim, name)
            panels.append((f"{name} [{unit}]", (Line("Difference", time, less, DIFFERENCE, dim == "input"),)))
    title = f"{called[0]} less {called[1]}"
    return [Panels("difference", title, "Time [s]", "", tuple(panels), shared="x")] if panels else []


def _same_time(first: xr.Dataset, second: xr.Dataset) -> bool:
    """Whether the samples of both are at the same times, as far as both go."""
    one, other = (log["time"].to_numpy() for log in (first, second))
    count = min(len(one), len(other))
    return count > 1 and bool(np.allclose(one[:count], other[:count], rtol=0.0, atol=1e-9))


def _unit(logs: Mapping[str, xr.Dataset], dim: str, name: str) -> str:
    log = next(iter(logs.values()))
    variable = f"{dim}_unit"
    return str(log[variable].sel({dim: name}).item()) if variable in log.variables else "1"
