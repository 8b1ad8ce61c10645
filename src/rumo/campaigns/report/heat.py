"""The heat map of two settings: where runs pass, or how large a figure of merit is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rumo.campaigns.judging.columns import SETTING, inside, key_of, texts, title_of, with_unit
from rumo.campaigns.judging.results import Results
from rumo.campaigns.judging.statistics import Correlation
from rumo.campaigns.report.words import value_words
from rumo.report.charts import Axis, HeatMap
from rumo.report.contents import Item, Section
from rumo.studies.looks import label

SEVERAL = 10
"""Values of a setting that are so few have a row or a column each."""
LEAST, MOST, IN_A_CELL = 2, 8, 6.0
"""Intervals of the others, each with equally many runs: so many that cells have some of a controller's runs."""


def heat_map(content: Mapping[str, Any], results: Results) -> Section | None:
    """Over the two settings that were chosen, or on which most depends; None if fewer than two vary."""
    chosen = results.heat_map or _chosen(content, results)
    if chosen is None or (not results.criteria and results.leading is None):
        return None
    (x, x_axis), (y, y_axis) = (_axis(results, name) for name in chosen)
    value, title, label_, span = _values(results)
    panels: list[tuple[str, Any, Any]] = []
    for name in results.controllers:
        mine = results.of(name)
        shape = int(y.max()) + 1, int(x.max()) + 1
        panels.append((label(name), *_cells(x[mine], y[mine], value[mine], shape, bool(results.criteria))))
    known = np.concatenate([values[np.isfinite(values)] for _, values, _ in panels])
    if not known.size:
        return None
    found = span or (float(known.min()), float(known.max()))
    figure = HeatMap(
        key="heat-map",
        title=f"{title} over {chosen[0]} and {chosen[1]}",
        x_label="",
        y_label="",
        panels=tuple(panels),
        x=x_axis,
        y=y_axis,
        label=label_,
        span=found,
        height=2.0 + 0.3 * len(panels[0][1]),
    )
    items: list[Item] = [figure]
    if not results.heat_map and len(results.numeric) > 2:
        items.insert(0, _why(content, results, chosen))
    return Section("Where it passes" if results.criteria else "Two settings together", items)


def _chosen(content: Mapping[str, Any], results: Results) -> tuple[str, str] | None:
    """The two settings with the largest rank correlations with the leading figure."""
    if results.leading is None or len(results.varied) < 2:
        return None
    found = content["rank_correlations"][key_of(results.leading)]
    sizes = {
        name: max((abs(each["rho"]) for each in by_controller.values() if each is not None), default=0.0)
        for name, by_controller in found.items()
    }
    first, second = sorted(results.varied, key=lambda name: -sizes.get(name, 0.0))[:2]
    return first, second


def _why(content: Mapping[str, Any], results: Results, chosen: tuple[str, str]) -> str:
    """Why these two settings, which is not to say that anything depends on them."""
    assert results.leading is not None
    found = content["rank_correlations"][key_of(results.leading)]
    clear = [
        name
        for name in chosen
        if any(each is not None and Correlation(**each).clear for each in found.get(name, {}).values())
    ]
    words = f"{chosen[0]} and {chosen[1]} have the largest rank correlations with {inside(title_of(results.leading))}"
    if len(clear) == len(chosen):
        return f"{words}."
    return f"{words}; {'neither' if not clear else f'only that of {clear[0]}'} is clearly more than chance."


def _axis(results: Results, name: str) -> tuple[NDArray[np.int_], Axis]:
    """Which cell each run is in (n,), and what stands at the axis."""
    found = texts(results.rows, SETTING + name)
    distinct = set(found)
    if name in results.numeric:
        values = results.setting(name)
        if len(distinct) > SEVERAL:
            draws = max(len(rows) for rows in results.places.values())
            count = int(np.clip((draws / IN_A_CELL) ** 0.5, LEAST, MOST))
            edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, count + 1)))
            cells = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
            return cells, Axis(results.named(name), tuple(f"{edge:.3g}" for edge in edges))
        single, cells = np.unique(values, return_inverse=True)
        return cells, Axis(results.named(name), tuple(value_words(float(value)) for value in single))
    names, cells = np.unique(np.array(found, dtype=str), return_inverse=True)
    return cells, Axis(results.named(name), tuple(names.tolist()))


def _values(results: Results) -> tuple[Any, str, str, tuple[float, float] | None]:
    """What is put together in each cell, with title, label and span."""
    if results.criteria:
        one = len(results.criteria) == 1
        title = "Runs that pass" if one else "Runs that pass all criteria"
        return 100.0 * results.passed, title, "Runs [%]", (0.0, 100.0)
    assert results.leading is not None
    title = with_unit(results.leading)
    return results.values(results.leading), f"Median {title}", title, None


def _cells(x: Any, y: Any, values: Any, shape: tuple[int, int], shares: bool) -> tuple[Any, Any]:
    """Mean of shares, or median, of the runs in each cell (ny, nx), and how many there are."""
    found, counts = np.full(shape, np.nan), np.zeros(shape, dtype=int)
    known = np.isfinite(values)
    place = (y * shape[1] + x)[known]
    order = np.argsort(place, kind="stable")
    cells, begins = np.unique(place[order], return_index=True)
    for cell, within in zip(cells.tolist(), np.split(values[known][order], begins[1:]), strict=bool(cells.size)):
        at = divmod(cell, shape[1])
        found[at], counts[at] = within.mean() if shares else np.median(within), len(within)
    return found, counts
