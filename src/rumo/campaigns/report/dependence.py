"""What figures of merit depend on: every run over every setting that varies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rumo.campaigns.judging.columns import SETTING, column_of, key_of, texts, title_of, with_unit
from rumo.campaigns.judging.results import Results
from rumo.campaigns.judging.statistics import Correlation, wilson
from rumo.campaigns.report.looks import point_looks, slim
from rumo.campaigns.report.spread import differing, judged_columns, same_words, wide
from rumo.campaigns.report.words import percent, percents, value_words
from rumo.report.charts import LIMIT, Line, Panels
from rumo.report.contents import Folded, Item, Section
from rumo.report.tables import Table
from rumo.signals import Array
from rumo.studies.looks import label

POINTS = 600
"""Of a controller in a panel, at most; the worst are among them."""
BUDGET, FOLDED = 18_000, 9_000
"""Points of all panels, for figures with criteria and for the others: the page stays one that is opened at once."""
ENDS = 10
"""Runs with the largest values that are never thinned out."""
PANELS = 48
"""Of all other figures together, those over settings on which most depends; each has one at least."""
SIDEWAYS = 0.5
"""Of the distance between values of a grid: in such a band stand the points of each."""
FEW = 8
"""Values of a setting that are so few are told one by one."""


def dependences(content: Mapping[str, Any], results: Results) -> Section:
    """Rank correlations, points, and shares by value."""
    if not results.varied:
        return Section("What it depends on", ["No setting varies but seeds: there is nothing to depend on."])
    items: list[Item] = []
    leading = judged_columns(results)
    judged = differing(results, leading)
    others = [column for column in differing(results, results.figures) if column not in judged]
    if results.numeric and judged:
        items.append(
            "Spearman's rank correlation says how steadily a figure rises (1) or falls (-1) with a setting; it is in "
            "brackets where chance alone gives one as large in more than one of a hundred campaigns of this size."
        )
        items.append(correlation_table(content, results, judged))
        if any(len(np.unique(results.setting(name))) <= FEW for name in results.numeric):
            items.append("In the figures, runs with the same value of a setting stand beside each other about it.")
        items += [points(results, column, BUDGET // len(judged), results.numeric) for column in judged]
    items += same_words(results, leading)
    if results.criteria:
        items += [table for name in results.varied if (table := shares_table(results, name))]
    if others and results.numeric:
        inside: list[Item] = [correlation_table(content, results, others)]
        shown = {column: _most(content, results, column, PANELS // len(others)) for column in others}
        inside += [points(results, column, FOLDED // len(others), shown[column]) for column in others]
        items.append(Folded(f"{len(others)} other figures of merit", inside))
    return Section("What it depends on", items)


def correlation_table(content: Mapping[str, Any], results: Results, columns: list[str]) -> Table:
    """A row for each setting, most important first; a column for each figure and controller."""
    found = {column: content["rank_correlations"][key_of(column)] for column in columns}
    several = len(results.controllers) > 1
    heads = [
        f"{title_of(column)}" + (f",\n{label(name)}" if several else "")
        for column in columns
        for name in results.controllers
    ]

    rows = [
        [
            results.named(name),
            *(_rho(found[column][name][driver]) for column in columns for driver in results.controllers),
        ]
        for name in sorted(results.numeric, key=lambda name: -_size(found[columns[0]][name]))
    ]
    return Table(["Setting", *heads], rows)


def _rho(found: Mapping[str, float] | None) -> str:
    if found is None:
        return "-"
    correlation = Correlation(**found)
    return f"{correlation.rho:+.2f}" if correlation.clear else f"({correlation.rho:+.2f})"


def points(results: Results, column: str, budget: int, settings: Sequence[str]) -> Panels:
    """A figure over settings that vary, a point for each run; thinned out by chance, the same each time."""
    looks, values = point_looks(results.controllers), results.values(column)
    most = max(40, min(POINTS, budget // (len(settings) * len(results.controllers))))
    limits = [
        limit
        for each in results.criteria
        if column_of(each.kpi, results.rows.columns) == column
        for limit in each.limits
    ]
    shown = {name: _thinned(np.flatnonzero(results.of(name) & np.isfinite(values)), values, most) for name in looks}
    panels: list[tuple[str, tuple[Line, ...]]] = []
    for name in settings:
        setting = results.setting(name)
        span = np.array([np.nanmin(setting), np.nanmax(setting)])
        beside = _beside(setting, results.controllers)
        lines = [
            Line(label(who), slim(setting[rows] + beside[who][rows]), slim(values[rows]), looks[who])
            for who, rows in shown.items()
        ]
        panels.append(
            (results.named(name), (*(Line("Limit", span, np.full(2, limit), LIMIT) for limit in limits), *lines))
        )
    return Panels(
        f"over-settings-{key_of(column).replace('.', '-')}",
        f"{with_unit(column)} over {'each setting' if len(settings) == len(results.numeric) else ', '.join(settings)}"
        + _thinning(shown, results),
        "",
        with_unit(column),
        tuple(panels),
        shared="y",
        height=2.1,
        logarithmic="y" if wide(values) else "",
        logarithmic_x=tuple(i for i, name in enumerate(settings) if _logarithmic(results.setting(name))),
    )


def _most(content: Mapping[str, Any], results: Results, column: str, count: int) -> list[str]:
    """The settings on which a figure depends most, in the order of all."""
    found = content["rank_correlations"][key_of(column)]
    first = sorted(results.numeric, key=lambda name: -_size(found[name]))[: max(count, 1)]
    return [name for name in results.numeric if name in first]


def _size(by_controller: Mapping[str, Any]) -> float:
    return max((abs(each["rho"]) for each in by_controller.values() if each is not None), default=0.0)


def _beside(setting: Array, controllers: tuple[str, ...]) -> dict[str, Array]:
    """How far each point (n,) is put aside, by controller: those of a grid would cover each other."""
    grid = np.unique(setting)
    if len(grid) > FEW:
        return dict.fromkeys(controllers, np.zeros(len(setting)))
    width = SIDEWAYS * float(np.diff(grid).min()) / len(controllers)
    noise = np.random.default_rng(0).uniform(-0.4, 0.4, len(setting))
    centre = 0.5 * (len(controllers) - 1)
    return {name: width * (i - centre + noise) for i, name in enumerate(controllers)}


def _thinned(rows: NDArray[np.int_], values: Any, most: int) -> NDArray[np.int_]:
    if len(rows) <= most:
        return rows
    in_order = rows[np.argsort(values[rows], kind="stable")]
    rest = np.random.default_rng(0).choice(in_order[:-ENDS], most - ENDS, replace=False)
    return np.r_[rest, in_order[-ENDS:]]


def _thinning(shown: Mapping[str, NDArray[np.int_]], results: Results) -> str:
    count = sum(map(len, shown.values()))
    return (
        "" if count >= 0.9 * len(results.rows) else f", {count:,} of {len(results.rows):,} runs, the largest among them"
    )


def _logarithmic(setting: Any) -> bool:
    """Whether values of a setting, of one sign, are spread over orders of magnitude, as by a log-uniform choice."""
    return bool(setting.min() > 0.0 and setting.max() > 8.0 * setting.min())


def shares_table(results: Results, name: str) -> Table | None:
    """Which share of runs passes all criteria at each value of a setting that has few; None where it has many."""
    values = texts(results.rows, SETTING + name)
    found = sorted(set(values), key=lambda text: (isinstance(_number(text), str), _number(text)))
    if len(found) > FEW:
        return None
    of = np.array(values, dtype=str)
    rows = [
        [
            value_words(_number(value)),
            *(cell for who in results.controllers for cell in _cells(results, (of == value) & results.of(who))),
        ]
        for value in found
    ]
    heads = [head for who in results.controllers for head in (f"{label(who)}\npasses [%]", "95 % interval\n[%]")]
    return Table([results.named(name), *heads], rows)


def _cells(results: Results, rows: NDArray[np.bool_]) -> list[str]:
    share = wilson(int(results.passed[rows].sum()), int(rows.sum()))
    return [percent(share.value), percents(share.plain)]


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
