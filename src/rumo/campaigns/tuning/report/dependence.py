"""What the objectives depend on: how much each setting decides, and each trial over each setting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rumo.campaigns.report.looks import slim
from rumo.campaigns.report.words import percent, value_words
from rumo.campaigns.tuning.report.history import (
    BEST,
    goal_label,
    goal_title,
    key_of,
    spread_out,
    trial_points,
    values_of,
)
from rumo.report.charts import Line, Panels
from rumo.report.contents import Item, Section
from rumo.report.tables import Table, number

FEWEST = 20
"""Trials from which it is said which settings matter."""


def dependence_section(content: Mapping[str, Any]) -> Section | None:
    """Importance, points, and values of lists."""
    trials = [trial for trial in content["history"] if trial["values"]]
    if not trials:
        return None
    items: list[Item] = []
    if any(content["importance"].values()) and len(trials) >= FEWEST:
        items.append(
            "Importance is the share of what tells the best tenth of the trials from all of them that a setting "
            "decides, by PED-ANOVA; limits play no part in it."
        )
        items.append(importance_table(content))
    for i in range(len(content["objectives"])):
        panels = settings_panels(content, i)
        items += [] if panels is None else [panels]
    items += [options_table(content, trials, name) for name in content["settings"] if not _numeric(trials, name)]
    return Section("What it depends on", items) if items else None


def importance_table(content: Mapping[str, Any]) -> Table:
    """A row for each setting, most important for the first objective first."""
    found = content["importance"]
    first = next(iter(found.values()))
    names = sorted(content["settings"], key=lambda name: -first.get(name, 0.0))
    rows = [[name, *(percent(of.get(name)) for of in found.values())] for name in names]
    return Table(["Setting", *(f"Importance for\n{objective} [%]" for objective in found)], rows)


def options_table(content: Mapping[str, Any], trials: Sequence[Mapping[str, Any]], name: str) -> Table:
    """How trials did with each value of a list: how many, and the best of each objective within the limits."""
    rows: list[list[str]] = []
    goals = list(content["objectives"].values())
    for value in dict.fromkeys(value_words(trial["settings"].get(name)) for trial in trials):
        mine = [trial for trial in trials if value_words(trial["settings"].get(name)) == value]
        within = [trial for trial in mine if trial["feasible"]]
        best = [
            number((max if goal["maximise"] else min)(trial["values"][i] for trial in within)) if within else "-"
            for i, goal in enumerate(goals)
        ]
        rows.append([value, number(len(mine)), number(len(within)), *best])
    heads = [name, "Trials", "Within\nlimits", *(f"Best\n{objective}" for objective in content["objectives"])]
    return Table(heads, rows)


def settings_panels(content: Mapping[str, Any], i: int) -> Panels | None:
    """An objective over each setting that is a number; None if none is."""
    trials = [trial for trial in content["history"] if trial["values"]]
    names = [name for name in content["settings"] if _numeric(trials, name)]
    if not trials or not names:
        return None
    values = values_of(trials, i)
    panels: list[tuple[str, tuple[Line, ...]]] = []
    for name in names:
        lines = trial_points(content, trials, np.array([float(trial["settings"][name]) for trial in trials]), values)
        if content["best"]:
            best = content["best"][0]
            x, y = np.array([float(best["settings"][name])]), np.array([best["values"][i]])
            lines.append(Line("Best", slim(x), slim(y), BEST))
        panels.append((name, tuple(reversed(lines))))  # the first is in front
    logarithmic = [k for k, name in enumerate(names) if _is_log(content["settings"][name]["choice"])]
    return Panels(
        f"over-settings-{key_of(list(content['objectives'])[i])}",
        f"{goal_title(content, i)} over each setting",
        "",
        goal_label(content, i),
        tuple(panels),
        shared="y",
        height=2.1,
        logarithmic="y" if spread_out(values) else "",
        logarithmic_x=tuple(logarithmic),
    )


def _numeric(trials: Sequence[Mapping[str, Any]], name: str) -> bool:
    values = [trial["settings"].get(name) for trial in trials]
    return all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)


def _is_log(choice: Any) -> bool:
    return isinstance(choice, Mapping) and choice.get("distribution") == "log-uniform"
