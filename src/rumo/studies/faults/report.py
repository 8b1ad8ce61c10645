"""What is shown of drives through faults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rumo.report.charts import Line, Look, Panels
from rumo.report.contents import Section
from rumo.report.tables import Table, number
from rumo.studies.faults.summary import WHOLE
from rumo.studies.looks import label

MARKS = ("circle", "square", "triangle-up", "diamond", "star", "cross")
COLORS = ("#0072B2", "#E69F00", "#D55E00", "#009E73", "#CC79A7", "#56B4E9")
"""For each number of bad samples, in turn."""


def sections(content: Mapping[str, Any]) -> list[Section]:
    """What is shown of a summary."""
    controllers = content["controllers"]
    tables = [Section(label(name), [faults_table(outcomes)], brief=True) for name, outcomes in controllers.items()]
    figures = [error_panels(controllers)] if any(controllers.values()) else []
    return [*tables, Section("Figure", figures)] if figures else tables


def faults_table(outcomes: Mapping[str, Mapping[str, Any]]) -> Table:
    """How a controller came through each fault, from a summary's entry of it."""
    counts = _counts([outcomes])
    rows = [
        [
            run["title"],
            *(_metres(run["largest_error_m"].get(count)) for count in counts),
            f"{run['lost']}/{run['drives']}",
            number(run["bad_commands"]),
            number(run["exceptions"]),
            _back(run),
            f"{run['told']}/{run['drives']}",
        ]
        for run in outcomes.values()
    ]
    errors = [f"Error [m],\n{_words(count)}" for count in counts]
    return Table(["", *errors, "Lost", "Bad\ncommands", "Raised", "Back\nafter [s]", "Told"], rows)


def error_panels(controllers: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> Panels:
    """The largest error by fault, for each controller a panel, for each number of bad samples a mark."""
    titles = {fault: run["title"] for outcomes in controllers.values() for fault, run in outcomes.items()}
    rows = {fault: -i for i, fault in enumerate(titles)}
    looks = {
        count: Look(COLORS[i % len(COLORS)], "", 1.0, MARKS[i % len(MARKS)])
        for i, count in enumerate(_counts(controllers.values()))
    }

    def marks(outcomes: Mapping[str, Mapping[str, Any]], count: str) -> Line:
        errors = {rows[fault]: run["largest_error_m"].get(count) for fault, run in outcomes.items()}
        known = {row: error for row, error in errors.items() if error is not None}
        return Line(_words(count), np.array(list(known.values())), np.array(list(known), dtype=float), looks[count])

    return Panels(
        "largest-error",
        "Largest distance from the reference, from the first bad sample on",
        "Distance [m]",
        "",
        tuple(
            (label(name), tuple(marks(outcomes, count) for count in looks)) for name, outcomes in controllers.items()
        ),
        height=0.6 + 0.19 * len(rows),
        across=3,
        names=tuple((float(row), titles[fault]) for fault, row in rows.items()),
        logarithmic="x",
    )


def _counts(controllers: Any) -> list[str]:
    """Numbers of bad samples that there are, the whole drive last."""
    found = {count for outcomes in controllers for run in outcomes.values() for count in run["largest_error_m"]}
    return sorted(found, key=lambda count: (count == WHOLE, 0 if count == WHOLE else int(count)))


def _words(count: str) -> str:
    return "whole drive" if count == WHOLE else f"{count} sample{'' if count == '1' else 's'}"


def _back(run: Mapping[str, Any]) -> str:
    if run["recovery_s"] is not None:
        return f"{run['recovery_s']:.2f}"
    return "-" if set(run["largest_error_m"]) == {WHOLE} or run["exceptions"] else "never"


def _metres(error: float | None) -> str:
    return "-" if error is None else f"{error:.2f}" if error < 99.95 else f"{error:.0f}"
