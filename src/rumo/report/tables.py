"""Tables of a study, for terminal and page alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rumo.report.charts import label


@dataclass(frozen=True)
class Table:
    """Heads and rows of text; the first column names the row."""

    heads: list[str]
    rows: list[list[str]]


def number(value: float | str | None) -> str:
    """A figure for readers: three significant digits, a dash for none."""
    if value is None:
        return "-"
    return str(value) if isinstance(value, str | int) else f"{value:#.3g}".rstrip(".")


def controllers_table(controllers: Mapping[str, Any]) -> Table:
    """How each controller drove, from a summary: a column for each."""
    runs = list(controllers.values())
    statuses = list(dict.fromkeys(status for run in runs for status in run["status_counts"]))
    rows = [
        ["RMS error [m]", *(number(run["tracking_error_rms_m"]) for run in runs)],
        ["RMS error after 2 s [m]", *(number(run["tracking_error_rms_after_2s_m"]) for run in runs)],
        ["Largest error after 2 s [m]", *(number(run["tracking_error_max_after_2s_m"]) for run in runs)],
        *(
            [f"Step time, {words} [us]", *(f"{run['step_time_us'][key]:.0f}" for run in runs)]
            for key, words in (("mean", "mean"), ("p50", "median"), ("p99", "99 %"), ("max", "largest"))
        ),
        ["Deadline misses", *(str(run["deadline_misses"]) for run in runs)],
        *([f"Steps {status}", *(str(run["status_counts"].get(status, 0)) for run in runs)] for status in statuses),
    ]
    return Table(["", *map(label, controllers)], rows)


def claims_table(claims: Sequence[Mapping[str, Any]]) -> Table:
    """What the paper claims beside our figures, from a summary."""
    rows = [
        [item["claim"], number(item["printed"]), number(item["ours"]), "" if item["unit"] == "1" else item["unit"]]
        for item in claims
    ]
    return Table(["Claim", "Printed", "Ours", "Unit"], rows)
