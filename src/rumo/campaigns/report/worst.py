"""The worst runs, each with its drive and the command that repeats it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.campaigns.judging.columns import column_of, title_of, unit_of
from rumo.campaigns.judging.results import Results
from rumo.campaigns.judging.summary import run_of, worst
from rumo.campaigns.report.drives import drive_figures
from rumo.campaigns.report.words import rerun_command, settings_words
from rumo.errors import RumoError
from rumo.report.contents import Beside, Command, Folded, Item, Section
from rumo.report.tables import Table, number
from rumo.studies.looks import label

OPEN = 3
"""Drives that are shown at once."""


def worst_runs(content: Mapping[str, Any], results: Results) -> Section:
    """The worst by the first criterion with their drives, those by others in tables."""
    if results.leading is None or not content["worst"]:
        return Section("The worst runs", ["No run came to a figure by which it could be the worst."])
    unit = unit_of(results.leading)
    title = f"{title_of(results.leading)} [{unit}]" if unit else title_of(results.leading)
    items: list[Item] = [worst_table(title, content["worst"], results)]
    items += [_drive(i, run, results) for i, run in enumerate(content["worst"])]
    for criterion in results.criteria:
        column = column_of(criterion.kpi, results.rows.columns)
        if column in results.figures and column != results.leading:
            runs = [run_of(results, row, column) for row in worst(results, column)]
            items.append(Folded(f"The worst by {criterion.name}", [worst_table(title_of(column), runs, results)]))
    return Section("The worst runs", items)


def worst_table(title: str, runs: list[dict[str, Any]], results: Results) -> Table:
    """A row for each, with its settings and its key."""
    rows = [
        [
            str(i + 1),
            number(run["value"]),
            label(run["controller"]),
            str(run["draw"]),
            *(_cell(run["settings"][name]) for name in results.varied),
            run["key"],
        ]
        for i, run in enumerate(runs)
    ]
    heads = [
        "",
        title.replace(", ", ",\n"),
        "Controller",
        "Draw",
        *map(_head, map(results.named, results.varied)),
        "Key",
    ]
    return Table(heads, rows, words=(2, len(heads) - 1))


def _head(setting: str) -> str:
    """A setting with its unit as the head of a column, which is to be narrow."""
    return setting.replace(" [", "\n[")


def _cell(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _drive(i: int, run: Mapping[str, Any], results: Results) -> Folded:
    unit = unit_of(str(run["kpi"]))
    heading = f"{i + 1}. {label(run['controller'])}, draw {run['draw']}: {number(run['value'])} {unit}".rstrip()
    if run["settings"]:
        heading += f" at {settings_words(run['settings'])}"
    items: list[Item] = []
    if run["ended"]:
        items.append(run["ended"])
    path = results.log_of(run["key"])
    if path is None:
        items.append("Its log was not kept; this makes it again, bit for bit:")
    else:
        items += _figures(path, run["key"])
    folder = "FOLDER" if results.folder is None else str(results.folder)
    return Folded(heading, [*items, Command(rerun_command(folder, run["key"]))], open=i < OPEN)


def _figures(path: Any, key: str) -> list[Item]:
    from rumo.simulation.log import load

    try:
        found = drive_figures(load(path), key)
    except (RumoError, OSError) as error:
        return [f"Its log cannot be read: {error}"]
    return [Beside(found)] if found else ["Its log has no samples."]
