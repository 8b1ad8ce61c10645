"""How figures of merit are distributed over the runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from rumo.campaigns.judging.columns import better_of, column_of, inside, key_of, title_of, unit_of, with_unit
from rumo.campaigns.judging.results import Results
from rumo.campaigns.report.looks import line_looks, slim
from rumo.campaigns.report.words import value_words
from rumo.report.charts import LIMIT, Line, Panels
from rumo.report.contents import Folded, Item, Section
from rumo.report.tables import Table, number
from rumo.signals import Array
from rumo.studies.looks import label

POINTS, FEWEST, BUDGET = 160, 60, 6000
"""Of a distribution's curve, at most and at least, and of all curves of a figure; the tails keep each run."""
TAIL = 20
"""Runs at each end that all have a point."""
WIDE = 30.0
"""Values of one sign that are so many times as large as others are drawn on a logarithmic axis."""


def spreads(content: Mapping[str, Any], results: Results) -> Section:
    """A table and curves: those of criteria first, the others folded."""
    judged = judged_columns(results)
    others = [column for column in results.figures if column not in judged]
    items: list[Item] = _spread("distribution", content, results, judged) if judged else []
    if others:
        folded = _spread("distribution-others", content, results, others)
        items.append(Folded(f"{len(others)} other figures of merit", folded))
    return Section("Distributions", items or ["Nothing is known of any run."])


def _spread(key: str, content: Mapping[str, Any], results: Results, columns: list[str]) -> list[Item]:
    """A table of figures that differ from run to run, and their curves; in words those that do not."""
    found = differing(results, columns)
    items: list[Item] = [spread_table(content, found), curves(key, results, found)] if found else []
    return [*items, *same_words(results, columns)]


def differing(results: Results, columns: Iterable[str]) -> list[str]:
    """Those of some figures that are not the same in all runs."""
    return [column for column in columns if column not in results.constant]


def same_words(results: Results, columns: Iterable[str]) -> list[Item]:
    """A sentence of those that are; nothing if there are none."""
    found: dict[str, list[str]] = {}
    for column in columns:
        if column in results.constant:
            values = results.values(column)
            value = f"{value_words(float(values[np.isfinite(values)][0]))} {unit_of(column)}".rstrip()
            found.setdefault(value, []).append(inside(title_of(column)))
    said = "; ".join(f"{', '.join(titles)}: {value}" for value, titles in found.items())
    return [f"The same in all runs: {said}."] if said else []


def judged_columns(results: Results) -> list[str]:
    """Columns of figures that have criteria, and of which something is known; the first there is, if none has."""
    found = [column_of(each.kpi, results.rows.columns) for each in results.criteria]
    known = [column for column in dict.fromkeys(found) if column in results.figures]
    return [column for column in known if column] or list(results.figures[:1])


def spread_table(content: Mapping[str, Any], columns: list[str]) -> Table:
    """Percentiles by figure and controller."""
    rows: list[list[str]] = []
    for column in columns:
        for i, (name, of) in enumerate(content["controllers"].items()):
            found = of["kpis"][key_of(column)]
            figures = [number(found[part]) for part in ("mean", "p5", "p50", "p95", "p99")]
            worst = number(found["min" if better_of(column) == "more" else "max"])
            title = f"{title_of(column)} [{unit_of(column)}]" if unit_of(column) else title_of(column)
            rows.append([title if i == 0 else "", label(name), number(found["known"]), *figures, worst])
    heads = ["", "Controller", "Runs", "Mean", "5 %", "Median", "95 %", "99 %", "Worst"]
    return Table(heads, rows, words=(0, 1))


def curves(key: str, results: Results, columns: list[str]) -> Panels:
    """For each figure a panel with the share of runs that are below, by controller, and the limits of criteria."""
    looks = line_looks(results.controllers)
    most = max(FEWEST, min(POINTS, BUDGET // (len(columns) * len(looks))))
    panels: list[tuple[str, tuple[Line, ...]]] = []
    for column in columns:
        lines = [
            Line(label(name), *_curve(results.values(column)[results.of(name)], most), looks[name], steps=True)
            for name in results.controllers
        ]
        limits = [
            Line("Limit", np.full(2, limit), np.array([0.0, 100.0]), LIMIT)
            for each in results.criteria
            if column_of(each.kpi, results.rows.columns) == column
            for limit in each.limits
        ]
        panels.append((with_unit(column), (*(line for line in lines if line.x.size), *limits)))
    return Panels(
        key,
        "Share of runs that stay below a value; those of which it is not known do not",
        "",
        "Runs [%]",
        tuple(panels),
        shared="y",
        height=1.9,
        logarithmic_x=tuple(i for i, column in enumerate(columns) if wide(results.values(column))),
    )


def wide(values: Array) -> bool:
    """Whether values, as far as they are known, need a logarithmic axis."""
    known = values[np.isfinite(values)]
    if not known.size or known.min() <= 0.0:
        return False
    return bool(known.max() > WIDE * np.median(known) or known.max() > 100.0 * known.min())


def _curve(values: Array, most: int) -> tuple[Array, Array]:
    """Values in order, and how many of all runs are as low in percent, thinned out between the tails."""
    known = np.sort(values[np.isfinite(values)])
    places = np.arange(known.size)
    if known.size > most:
        middle = np.linspace(TAIL, known.size - 1 - TAIL, most - 2 * TAIL).astype(int)
        places = np.unique(np.r_[places[:TAIL], middle, places[-TAIL:]])
    if not places.size:
        return known, known
    return slim(known[np.r_[0, places]]), slim(100.0 * np.r_[0, places + 1] / values.size)
