"""Two campaigns: what is different between them, and what it does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rumo.campaigns.comparison.together import Together, differing, together
from rumo.campaigns.judging.columns import key_of, title_of, unit_of
from rumo.campaigns.judging.results import Results
from rumo.campaigns.judging.statistics import difference_interval
from rumo.campaigns.judging.summary import run_of, summary, versions
from rumo.campaigns.report.failures import flattened
from rumo.campaigns.report.headline import headline
from rumo.campaigns.report.pairs import compared_items, pairs_panels, several_words, signed
from rumo.campaigns.report.spread import spreads
from rumo.campaigns.report.sureness import sureness
from rumo.campaigns.report.words import ends, value_words
from rumo.report.contents import Item, Report, Section
from rumo.report.tables import Table, counts, number

CHANGED = 10
"""Draws that are named, of those that differ most."""


def compare_campaigns(first: Results, second: Results, names: tuple[str, str] = ("first", "second")) -> Report:
    """Sentences, tables and figures of what differs between two campaigns, and its summary.

    Parameters
    ----------
    first, second : Results
        Of the campaigns; of each at least one row.
    names : tuple of str
        What they are called.

    Raises
    ------
    ArgumentError
        If they have no controller in common, and several.
    """
    both = together(first, second, names)
    content = summary(both.results, both.pairs)
    content |= {
        "campaign": None,
        "compared": list(names),
        "differs": {name: list(values) for name, values in _differs(first, second).items()},
        "unpaired": [] if not both.alone else [_unpaired(both.results, *pair) for pair in both.pairs],
    }
    sections = [
        headline(content, both.results),
        _settings(content, names),
        _differences(content, both),
        _changed(both, names),
        spreads(content, both.results),
        sureness(content, both.results, (first.specification, second.specification)),
    ]
    lead = f"{number(len(first.rows))} runs of {names[0]} beside {number(len(second.rows))} of {names[1]}."
    return Report(f"{names[0]} and {names[1]}", lead, content, [each for each in sections if each is not None])


def _differs(first: Results, second: Results) -> dict[str, tuple[Any, Any]]:
    settings = differing(flattened(first.specification), flattened(second.specification))
    made = differing(*({name: counts(found) for name, found in versions(each).items()} for each in (first, second)))
    return {**settings, **{f"run.{name}": values for name, values in made.items()}}


def _differences(content: Mapping[str, Any], both: Together) -> Section:
    items: list[Item] = []
    for found in content["comparisons"]:
        items += compared_items(found, (found["first"], found["second"]), "draws")
    items += several_words(content)
    if both.alone:
        names = ", ".join(both.alone)
        items = [f"Only one campaign has the setting {names}: draws are not paired, and differences are less sure."]
        items += [_unpaired_table(found) for found in content["unpaired"]]
    elif both.results.leading is not None and any(found["draws"] for found in content["comparisons"]):
        items.append(pairs_panels(both.results, both.results.leading, both.pairs))
    return Section("What it does", items, brief=True)


def _unpaired(results: Results, first: str, second: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for column in results.figures:
        values = results.values(column)
        difference = difference_interval(values[results.of(first)], values[results.of(second)])
        found[key_of(column)] = {"mean": difference.value, "interval": difference.plain}
    return {"first": first, "second": second, "kpis": found}


def _unpaired_table(found: Mapping[str, Any]) -> Table:
    rows = [
        [
            f"{title_of(key)} [{unit_of(key)}]" if unit_of(key) else title_of(key),
            signed(each["mean"]),
            ends(each["interval"]),
        ]
        for key, each in found["kpis"].items()
    ]
    return Table([f"{found['first']} less {found['second']}", "Difference\nof means", "95 % interval"], rows)


def _changed(both: Together, names: tuple[str, str]) -> Section | None:
    """The draws of which the leading figure has changed most, with the keys of both runs."""
    results = both.results
    if results.leading is None or both.alone:
        return None
    values, rows = results.values(results.leading), list[list[str]]()
    for pair, driver in zip(both.pairs, both.drivers, strict=True):
        one, other = results.pairs(*pair)
        size = np.abs(values[one] - values[other])
        known = np.flatnonzero(size > 0.0)
        for place in known[np.argsort(-size[known], kind="stable")][:CHANGED].tolist():
            runs = [run_of(results, int(row), results.leading) for row in (one[place], other[place])]
            settings = [value_words(runs[0]["settings"][name]) for name in results.varied]
            figures = [*(number(run["value"]) for run in runs), signed(runs[0]["value"] - runs[1]["value"])]
            rows.append([driver, *figures, *settings, *(run["key"] for run in runs)])
    if not rows:
        return None
    title, several = title_of(results.leading), len(both.pairs) > 1
    heads = ["Controller", *names, "Difference", *results.varied, *(f"Key of\n{name}" for name in names)]
    table = Table(heads, rows, words=(0, len(heads) - 2, len(heads) - 1))
    if not several:
        table = Table(heads[1:], [row[1:] for row in rows], words=(len(heads) - 3, len(heads) - 2))
    return Section("Draws that differ most", [f"{title}{f' [{unit_of(results.leading)}]'}.".replace(" []", ""), table])


def _settings(content: Mapping[str, Any], names: tuple[str, str]) -> Section:
    rows = [[name, *map(_shown, values)] for name, values in content["differs"].items()]
    if not rows:
        return Section("What is different", ["Nothing that the campaigns were told, and no version."], brief=True)
    return Section("What is different", [Table(["", *names], rows, words=(0, 1, 2))], brief=True)


def _shown(value: Any) -> str:
    return "-" if value is None else value_words(value)
