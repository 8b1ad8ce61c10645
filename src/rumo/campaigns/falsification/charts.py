"""Figures of a falsification: drives of what was found, and how the search came there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rumo.campaigns.falsification.falsify import Falsified
from rumo.campaigns.judging.columns import title_of, unit_of, with_unit
from rumo.campaigns.report.drives import drive_figures
from rumo.campaigns.report.looks import slim
from rumo.campaigns.report.spread import wide
from rumo.campaigns.report.words import value_words
from rumo.errors import RumoError
from rumo.report.charts import LIMIT, Chart, Figure, Line, Look, Panels
from rumo.report.contents import Beside, Folded, Item, Section
from rumo.report.tables import Table, number
from rumo.signals import Array

VIOLATES = Look("#D55E00", "", 1.0, "x", 4.5)
HOLDS = Look("#56B4E9", "", 1.0, "circle", 3.6)
SO_FAR = Look("#009E73", "solid", 1.8)
SMALLEST = Look("#000000", "", 1.0, "star", 9.0)
SIZE = "Size [1]"

Trials = Sequence[Mapping[str, Any]]


def drives_section(falsified: Falsified) -> Section | None:
    """The drive with what was found, and that without; None if nothing was."""
    if falsified.found is None:
        return None
    shown = _drive(falsified, falsified.found.row["key"])
    items: list[Item] = [Beside(shown)] if shown else ["The log of its drive was not kept."]
    if without := _drive(falsified, falsified.found.without["key"]):
        items.append(Folded("Without a disturbance", [Beside(without)]))
    return Section("The drive with it", items)


def _drive(falsified: Falsified, key: str) -> list[Figure]:
    from rumo.simulation.log import load

    path = falsified.log_of(key)
    try:
        return [] if path is None else drive_figures(load(path), key)
    except (RumoError, OSError):
        return []


def search_section(content: Mapping[str, Any], falsified: Falsified) -> Section:
    """Sizes over trials and settings, and figures of merit over sizes."""
    trials, done = content["trials"], [trial for trial in content["history"] if trial["violated"] is not None]
    failed = f", {number(trials['failed'])} failed" if trials["failed"] else ""
    items: list[Item] = [
        f"{number(trials['done'])} trials by {content['sampler']}: {number(trials['violating'])} "
        f"{violate(trials['violating'])} something, {number(trials['holding'])} hold{failed}."
    ]
    if content["found"] is not None:
        items.append(
            "From the smallest of them on, the way to no disturbance was halved; where several settings have a size, "
            "that of each alone as well."
        )
    if done:
        items += [_over_trials(done, content), *_figures(done, content, falsified)]
        panels = _over_settings(done, content)
        items += [] if panels is None else [panels]
        items += [_options(done, name) for name in content["settings"] if not _numeric(done, name)]
    return Section("How it was looked for", items)


def violate(count: int) -> str:
    """What so many trials do."""
    return "violates" if count == 1 else "violate"


def _points(trials: Trials, x: Array, y: Array) -> list[Line]:
    """Trials as points x, y (n,), those that violate something apart from the others."""
    violates = np.array([bool(trial["violated"]) for trial in trials], dtype=bool)
    known = np.isfinite(x) & np.isfinite(y)
    lines = [("Holds", HOLDS, known & ~violates), ("Violates", VIOLATES, known & violates)]
    return [Line(name, slim(x[which]), slim(y[which]), look) for name, look, which in lines if which.any()]


def _of(trials: Trials, name: str) -> Array:
    return np.array([trial[name] for trial in trials], dtype=float)


def _over_trials(trials: Trials, content: Mapping[str, Any]) -> Chart:
    at, size = _of(trials, "number"), _of(trials, "size")
    lines = _points(trials, at, size)
    violating = np.array([trial["size"] if trial["violated"] else np.inf for trial in trials])
    if np.isfinite(violating).any():
        first = int(np.argmax(np.isfinite(violating)))
        so_far = np.minimum.accumulate(violating)[first:]
        lines.append(Line("Smallest so far", slim(at[first:]), slim(so_far), SO_FAR, steps=True))
    if content["found"] is not None:
        lines.append(Line("Found", slim(at[-1:]), np.array([content["found"]["size"]]), SMALLEST))
    return Chart("size-over-trials", "Size of each disturbance that was tried", "Trial", SIZE, tuple(lines), height=2.9)


def _figures(trials: Trials, content: Mapping[str, Any], falsified: Falsified) -> list[Item]:
    """Each criterion's figure over size, with its limits."""
    size, panels = _of(trials, "size"), list[tuple[str, tuple[Line, ...]]]()
    span, every = np.array([0.0, float(size.max())]), list[Array]()
    for name, criterion in falsified.falsification.criteria.items():
        values = np.array([np.nan if (v := trial["values"][name]) is None else v for trial in trials], dtype=float)
        lines = [Line("Limit", span, np.full(2, limit), LIMIT) for limit in criterion.limits]
        lines += _points(trials, size, values)
        found = content["found"]
        if found is not None and found["criteria"][name]["value"] is not None:
            value = np.array([found["criteria"][name]["value"]])
            lines.append(Line("Found", np.array([found["size"]]), value, SMALLEST))
        panels.append((with_unit(criterion.kpi), tuple(lines)))
        every.append(values)
    if len(panels) == 1:
        (_, lines), values = panels[0], every[0]
        key, scale = next(iter(falsified.falsification.criteria.values())).kpi, "y" if wide(values) else ""
        name = f"{title_of(key)} [{unit_of(key) or '1'}]"
        return [
            Chart("figure-over-size", f"{title_of(key)} over size", SIZE, name, lines, logarithmic=scale, height=2.9)
        ]
    return [
        Panels("figures-over-size", "What criteria judge, over size", SIZE, "", tuple(panels), shared="x", height=2.1)
    ]


def _over_settings(trials: Trials, content: Mapping[str, Any]) -> Panels | None:
    """Sizes over each setting that is a number; None if none is, but one that is the size itself."""
    sized = [name for name, of in content["settings"].items() if of["nothing"] is not None]
    names = [name for name in content["settings"] if _numeric(trials, name) and sized != [name]]
    if not names:
        return None
    size, panels, found = _of(trials, "size"), list[tuple[str, tuple[Line, ...]]](), content["found"]
    for name in names:
        lines = _points(trials, np.array([float(trial["settings"][name]) for trial in trials]), size)
        if found is not None:
            x, y = np.array([float(found["settings"][name])]), np.array([found["size"]])
            lines.append(Line("Found", x, y, SMALLEST))
        panels.append((name, tuple(reversed(lines))))  # the first of a panel is in front
    return Panels("size-over-settings", "Size over each setting", "", SIZE, tuple(panels), shared="y", height=2.1)


def _numeric(trials: Trials, name: str) -> bool:
    values = [trial["settings"][name] for trial in trials]
    return all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)


def _options(trials: Trials, name: str) -> Table:
    """How trials did with each value of a list."""
    rows: list[list[str]] = []
    for value in dict.fromkeys(value_words(trial["settings"][name]) for trial in trials):
        mine = [trial for trial in trials if value_words(trial["settings"][name]) == value]
        sizes = [trial["size"] for trial in mine if trial["violated"]]
        rows.append([value, number(len(mine)), number(len(sizes)), number(min(sizes)) if sizes else "-"])
    return Table([name, "Trials", "Violate", "Smallest size"], rows)
