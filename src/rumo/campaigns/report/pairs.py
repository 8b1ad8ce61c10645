"""Two controllers on the same draws: what is hard in a draw for both of them is taken out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations
from typing import Any

import numpy as np

from rumo.campaigns.judging.columns import inside, key_of, title_of, unit_of, with_unit
from rumo.campaigns.judging.results import Results
from rumo.campaigns.judging.statistics import CONFIDENCE
from rumo.campaigns.judging.summary import differing
from rumo.campaigns.report.looks import COLORS, slim
from rumo.campaigns.report.spread import wide
from rumo.campaigns.report.words import ends, percent
from rumo.report.charts import REFERENCE, Line, Look, Panels
from rumo.report.contents import Folded, Item, Section
from rumo.report.tables import Table, number
from rumo.studies.looks import label

POINTS = 800
"""Draws in a panel, at most."""
FEW = 8
"""Figures of merit that are shown without a click."""
BETTER = ("first_better", "second_better")
MARK = Look(COLORS[0], "", 1.0, "circle", 3.4)


def pairs(content: Mapping[str, Any], results: Results) -> Section | None:
    """Each two controllers; None if there is one alone."""
    if not content["comparisons"]:
        return None
    items: list[Item] = []
    for found in content["comparisons"]:
        names = label(found["first"]), label(found["second"])
        items += compared_items(found, names, "draws")
    items += several_words(content)
    if results.leading is not None:
        items.append(pairs_panels(results, results.leading, combinations(results.controllers, 2)))
    return Section("Controllers on the same draws", items, brief=True)


def compared_items(found: Mapping[str, Any], names: tuple[str, str], what: str) -> list[Item]:
    """Sentences and tables of runs of two kinds that are paired."""
    if not found["draws"]:
        return [f"{names[0]} and {names[1]} have no {what} in common."]
    items: list[Item] = [*_sentences(found, names, what)]
    if found["criteria"]:
        items.append(discordance_table(found, names))
    differences: list[Item] = []
    if any(not _same(each) for each in found["kpis"].values()):
        differences.append(differences_table(found, names))
    same = [inside(title_of(key)) for key, each in found["kpis"].items() if each["pairs"] and _same(each)]
    if same:
        differences.append(f"The same in all {what} of {names[0]} and {names[1]}: {'; '.join(same)}.")
    if len(found["kpis"]) > FEW:
        return [*items, Folded("All figures of merit", differences)]
    return items + differences


def _same(each: Mapping[str, Any]) -> bool:
    """Whether there is no difference in any pair."""
    return not each["pairs"] or each["mean"] == each["median"] == each["largest"] == 0.0


def _sentences(found: Mapping[str, Any], names: tuple[str, str], what: str) -> list[str]:
    for key, each in found["kpis"].items():
        if each["interval"] is None or _same(each) or each["first_better"] is None:
            continue
        unit = f" {unit_of(key)}" if unit_of(key) else ""
        low, high = each["interval"]
        better = [f"{name} is better in {percent(each[part])} %" for name, part in zip(names, BETTER, strict=True)]
        inside_it = low <= 0.0 <= high
        sure = (
            "which includes 0: these draws do not show which is better on average"
            if inside_it
            else "which leaves out 0"
        )
        return [
            f"{names[0]} less {names[1]}, {inside(title_of(key))}: {signed(each['mean'])}{unit} on average of "
            f"{number(each['pairs'])} {what}, 95 % interval {ends(each['interval'])}{unit}, {sure}. "
            f"{' of them, '.join(better)}."
        ]
    return []


def several_words(content: Mapping[str, Any]) -> list[Item]:
    """What stands of several comparisons that were made at once, and what is not corrected; nothing of a single one."""
    compared = [found for found in content["comparisons"] if found["draws"]]
    tests = [(found, name, each) for found in compared for name, each in found["criteria"].items()]
    items, count = list[Item](), len(differing(compared))
    if count > 1:
        stand = [
            f"{name} ({label(found['first'])}, {label(found['second'])})"
            for found, name, each in tests
            if each["corrected"] < 1.0 - CONFIDENCE
        ]
        items.append(
            f"Of the {number(count)} comparisons of who passes in which any draw differs, corrected for their number "
            f"by Holm's method at 5 %, {'these stand: ' + ', '.join(stand) if stand else 'none stands'}."
        )
    intervals = sum(
        each["interval"] is not None and not _same(each) for found in compared for each in found["kpis"].values()
    )
    if intervals > 1:
        items.append(
            f"The {number(intervals)} intervals of differences are each one of 95 %, not corrected for their number: "
            "where nothing differs, one in twenty would leave out 0 all the same."
        )
    return items


def discordance_table(found: Mapping[str, Any], names: tuple[str, str]) -> Table:
    """How many draws both pass, one of them alone, or neither."""
    rows = [
        [name, *(number(each[part]) for part in ("both", "first", "second", "neither")), chance(each["chance"])]
        for name, each in found["criteria"].items()
    ]
    heads = ["Criterion", "Both pass", f"{names[0]}\nalone", f"{names[1]}\nalone", "Neither", "So unequal\nby chance"]
    return Table(heads, rows)


def chance(share: float) -> str:
    """A probability for readers."""
    return "< 0.001" if share < 1e-3 else f"{share:.3f}"


def differences_table(found: Mapping[str, Any], names: tuple[str, str]) -> Table:
    """Differences of figures of merit, those of criteria first."""
    rows = [
        [
            f"{title_of(key)} [{unit_of(key)}]" if unit_of(key) else title_of(key),
            number(each["pairs"]),
            signed(each["mean"]),
            ends(each["interval"]),
            signed(each["median"]),
            percent(each["first_better"]),
            percent(each["second_better"]),
        ]
        for key, each in found["kpis"].items()
        if not _same(each)
    ]
    heads = [
        f"{names[0]} less {names[1]}",
        "Pairs",
        "Mean",
        "95 % interval",
        "Median",
        f"{names[0]}\nbetter [%]",
        f"{names[1]}\nbetter [%]",
    ]
    return Table(heads, rows)


def signed(value: float | None) -> str:
    """A difference, with its sign."""
    return "-" if value is None else ("+" if value > 0.0 else "") + number(value)


def pairs_panels(results: Results, column: str, couples: Iterable[tuple[str, str]]) -> Panels:
    """Each draw as a point: what it is with one controller over what it is with the other."""
    values = results.values(column)
    panels: list[tuple[str, tuple[Line, ...]]] = []
    for first, second in couples:
        one, other = (values[rows] for rows in results.pairs(first, second))
        known = np.flatnonzero(np.isfinite(one) & np.isfinite(other))
        if len(known) > POINTS:
            known = np.sort(np.random.default_rng(0).choice(known, POINTS, replace=False))
        x, y = slim(other[known]), slim(one[known])
        both = np.r_[x, y]
        span = np.array([both.min(), both.max()]) if both.size else np.empty(0)
        lines = (Line("Both the same", span, span, REFERENCE), Line("A draw", x, y, MARK))
        panels.append((f"{label(first)} over {label(second)}", lines))
    return Panels(
        f"pairs-{key_of(column).replace('.', '-')}",
        f"{with_unit(column)} of each draw, by two controllers",
        with_unit(column),
        with_unit(column),
        tuple(panels),
        shared="xy",
        height=2.6,
        logarithmic="xy" if wide(values) else "",
    )
