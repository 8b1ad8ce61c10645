"""What went wrong, and what the rows were made with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.campaigns.judging.results import Results
from rumo.campaigns.report.words import value_words
from rumo.report.contents import Item, Section
from rumo.report.tables import Table, counts, number
from rumo.studies.looks import label

WORDS = {
    "raised": "raised an error",
    "crashed": "ended its process",
    "timeout": "ran out of time",
    "lost": "did not arrive",
}
SHOWN = 30
"""Kinds of failure in the table."""
LONGEST = 300
"""Letters of a message; the row has all of it."""


def failures_section(content: Mapping[str, Any]) -> Section:
    """Failures by kind, each with a key, and statuses of steps."""
    found = content["failures"]
    items: list[Item] = []
    if found:
        rows = [
            [
                label(each["controller"]),
                WORDS.get(str(each["outcome"]), str(each["outcome"])),
                number(each["runs"]),
                _short(str(each["message"])),
                str(each["key"]),
            ]
            for each in found[:SHOWN]
        ]
        heads = ["Controller", "The run", "Runs", "Such as", "Key"]
        items.append(Table(heads, rows, words=(0, 1, 3, 4)))
        if len(found) > SHOWN:
            items.append(f"{len(found) - SHOWN} more kinds are in summary.json.")
    else:
        items.append("Every run came to its end.")
    for name, of in content["controllers"].items():
        steps = {status: count for status, count in of["statuses"].items() if count}
        if steps:
            items.append(f"Steps by status, {label(name)}: {counts(steps)}.")
    return Section("What went wrong", items)


def _short(message: str) -> str:
    first = message.strip().partition("\n")[0]
    return first if len(first) <= LONGEST else first[:LONGEST] + "..."


def made_with(content: Mapping[str, Any], results: Results) -> Section:
    """Settings, versions, machines and time."""
    items: list[Item] = []
    settings = flattened(content["specification"])
    if settings:
        items.append(
            Table(
                ["Setting", "Value"], [[name, _short(value_words(value))] for name, value in settings.items()], (0, 1)
            )
        )
    rows = [
        [name, counts(found) if len(found) > 1 else next(iter(found))] for name, found in content["versions"].items()
    ]
    if rows:
        items.append(Table(["Made with", ""], rows, words=(0, 1)))
    if content["wall_time_s"]:
        total = content["wall_time_s"]
        items.append(f"The runs took {number(total)} s in all, {number(total / content['runs'])} s each.")
    return Section("Settings and versions", items or ["Nothing is known of them."])


def flattened(mapping: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Tables of plain data, with a dotted name for each of their entries."""
    found: dict[str, Any] = {}
    for name, value in mapping.items():
        if isinstance(value, Mapping) and value and not prefix:
            found |= flattened(value, f"{prefix}{name}.")
        else:
            found[f"{prefix}{name}"] = value
    return found
