"""What comes first: how many runs pass, and how sure that is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from rumo.campaigns.judging.columns import title_of, unit_of
from rumo.campaigns.judging.results import Results
from rumo.campaigns.report.looks import line_looks, point_looks
from rumo.campaigns.report.words import capital, percent, percents, share_words
from rumo.report.charts import Line, Panels
from rumo.report.contents import Item, Section
from rumo.report.tables import Table, number
from rumo.studies.looks import label

ALL = "all of them"
"""The row of all criteria together."""


def headline(content: Mapping[str, Any], results: Results) -> Section:
    """Shares of runs that pass each criterion, by controller."""
    if not results.criteria:
        told = "No criteria were given: nothing is judged, and the worst runs are those by the first figure of merit."
        return Section("How they drove", [told, *_medians(content, results)], brief=True)
    items: list[Item] = [*_sentences(content, results), rates_table(content)]
    return Section("How many pass", [*items, rates_panels(content)], brief=True)


def _sentences(content: Mapping[str, Any], results: Results) -> list[str]:
    return [
        f"{capital(criterion.name)}, {criterion.words}: "
        + "; ".join(
            f"{label(name)} passes in {share_words(of['criteria'][criterion.name])}"
            + (
                ""
                if np.isfinite(criterion.values(results.rows)[results.of(name)]).any()
                else ", not known in any of them"
            )
            for name, of in content["controllers"].items()
        )
        + "."
        for criterion in results.criteria
    ]


def rates(content: Mapping[str, Any]) -> dict[str, dict[str, Mapping[str, Any]]]:
    """Shares by criterion, all of them last, and controller."""
    found: dict[str, dict[str, Mapping[str, Any]]] = {}
    for name, of in content["controllers"].items():
        for criterion, share in of["criteria"].items():
            found.setdefault(criterion, {})[name] = share
    if len(found) > 1:
        found[ALL] = {name: of["all_criteria"] for name, of in content["controllers"].items()}
    return found


def rates_table(content: Mapping[str, Any]) -> Table:
    """A row for each criterion and controller."""
    rows = [
        [
            criterion,
            label(name),
            number(share["passed"]),
            number(share["runs"]),
            percent(share["share"]),
            percents(share["interval"]),
        ]
        for criterion, by_controller in rates(content).items()
        for name, share in by_controller.items()
    ]
    return Table(["", "Controller", "Passed", "Runs", "Share [%]", "95 % interval\n[%]"], rows, words=(0, 1))


def rates_panels(content: Mapping[str, Any]) -> Panels:
    """Shares with their intervals, criteria below each other."""
    found, controllers = rates(content), tuple(content["controllers"])
    lines: list[Line] = []
    points = point_looks(controllers, 6.0)
    for i, (name, look) in enumerate(line_looks(controllers).items()):
        places = -np.arange(len(found)) - 0.5 * ((i + 0.5) / len(controllers) - 0.5)
        shares = [by_controller[name] for by_controller in found.values()]
        ends = 100.0 * np.array([(*share["interval"], np.nan) for share in shares])
        centres = 100.0 * np.array([share["share"] for share in shares])
        lines.append(
            Line(
                label(name),
                ends.ravel(),
                np.repeat(places, 3),
                replace(look, dash="solid", width=1.6, marker="circle", size=1.8),
            )
        )
        lines.append(Line(label(name), centres, places, points[name]))
    return Panels(
        "pass-rates",
        "Runs that pass: share, and 95 % interval",
        "Runs [%]",
        "",
        (("", tuple(lines)),),
        height=0.5 + 0.28 * len(found) * max(1, len(controllers)) ** 0.5,
        names=tuple((float(-i), criterion) for i, criterion in enumerate(found)),
    )


def _medians(content: Mapping[str, Any], results: Results) -> list[Item]:
    if results.leading is None:
        return ["No run came to a figure of merit."]
    column = results.leading
    key, unit = column.removeprefix("kpi.").removeprefix("run."), unit_of(column)
    sentences: list[Item] = []
    for name, of in content["controllers"].items():
        found = of["kpis"][key]
        if found["known"]:
            reach = f"{number(found['p5'])} to {number(found['p95'])}"
            words = f"{label(name)}: {title_of(column)} {number(found['p50'])} {unit}".rstrip()
            sentences.append(
                f"{words} (median of {number(found['known'])}; nine of ten runs from {reach} {unit}".rstrip() + ")."
            )
    return sentences
