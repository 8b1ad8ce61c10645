"""How the search went: each trial, the best so far, and what came of several objectives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rumo.campaigns.judging.columns import inside, title_of, unit_of
from rumo.campaigns.report.looks import slim
from rumo.campaigns.report.words import capital, value_words
from rumo.report.charts import LIMIT, REFERENCE, Chart, Line, Look
from rumo.report.contents import Item, Section
from rumo.report.tables import Table, number
from rumo.signals import Array

WITHIN = Look("#0072B2", "", 1.0, "circle", 3.2)
BEYOND = Look("#B0B7BF", "", 1.0, "x", 2.8)
SO_FAR = Look("#009E73", "solid", 2.0)
BEST = Look("#D55E00", "", 1.0, "star", 12.0)
FRONT = Look(LIMIT.color, "solid", 1.4, "circle", 6.0)
BEFORE = Look("#000000", "", 1.0, "diamond", 6.5)
WIDE = 8.0
MOST = 20
"""Of the settings that none beats, in the table."""


def history_section(content: Mapping[str, Any]) -> Section:
    """Values over trials, and of several objectives over each other."""
    trials, found = content["trials"], content["history"]
    items: list[Item] = [
        f"{number(trials['done'])} trials by {content['sampler']}: {number(trials['feasible'])} within the limits, "
        f"{number(trials['done'] - trials['feasible'] - trials['failed'])} beyond, {number(trials['failed'])} failed."
    ]
    if any(trial["values"] for trial in found):
        names = list(content["objectives"])
        items += [_history(content, i) for i in range(len(names))]
        if len(names) > 1:
            items += [_front(content, i, j) for i in range(len(names)) for j in range(i + 1, len(names))]
            items += [_front_table(content)]
    return Section("How the search went", items)


def goal_title(content: Mapping[str, Any], i: int) -> str:
    """An objective for a title: "Calm, mean variation a second, steering_rate [1/s]"."""
    name, each = list(content["objectives"].items())[i]
    return f"{capital(name)}, {each['of']} {inside(title_of(each['kpi']))} [{unit_of(each['kpi']) or '1'}],"


def goal_label(content: Mapping[str, Any], i: int) -> str:
    """An objective for an axis: "Calm [1/s]"."""
    name, each = list(content["objectives"].items())[i]
    return f"{capital(name)} [{unit_of(each['kpi']) or '1'}]"


def values_of(trials: Sequence[Mapping[str, Any]], i: int) -> Array:
    """An objective of trials (n,), NaN where they failed."""
    return np.array([trial["values"][i] if trial["values"] else np.nan for trial in trials], dtype=float)


def spread_out(values: Array) -> bool:
    """Whether values need a logarithmic axis, as far as they are known: bad trials may be many times as bad."""
    known = values[np.isfinite(values)]
    return bool(known.size and known.min() > 0.0 and known.max() > WIDE * known.min())


def trial_points(content: Mapping[str, Any], trials: Sequence[Mapping[str, Any]], x: Array, y: Array) -> list[Line]:
    """Trials as points x, y (n,), those beyond a limit apart from the others."""
    within = np.array([trial["feasible"] for trial in trials], dtype=bool)
    beyond = np.isfinite(x) & np.isfinite(y) & ~within
    lines = [Line("Beyond a limit", slim(x[beyond]), slim(y[beyond]), BEYOND)] if beyond.any() else []
    name = "Within the limits" if content["limits"] else "Trial"
    return [*lines, Line(name, slim(x[within]), slim(y[within]), WITHIN)]


def _history(content: Mapping[str, Any], i: int) -> Chart:
    trials, name = content["history"], list(content["objectives"])[i]
    values, at = values_of(trials, i), np.array([trial["number"] for trial in trials], dtype=float)
    lines = trial_points(content, trials, at, values)
    within = np.array([trial["feasible"] for trial in trials], dtype=bool)
    if within.any():
        best = np.maximum if content["objectives"][name]["maximise"] else np.minimum
        so_far = best.accumulate(values[within])
        x, y = np.r_[at[within], at[-1]], np.r_[so_far, so_far[-1]]
        lines.append(Line("Best so far", slim(x), slim(y), SO_FAR, steps=True))
    before = np.full(2, content["objectives"][name]["tuning"]["before"], dtype=float)
    lines.append(Line("Without tuning", slim(at[[0, -1]]), slim(before), REFERENCE))
    return Chart(
        f"history-{key_of(name)}",
        f"{goal_title(content, i)} of each trial",
        "Trial",
        goal_label(content, i),
        tuple(lines),
        logarithmic="y" if spread_out(values) else "",
    )


def _front(content: Mapping[str, Any], i: int, j: int) -> Chart:
    trials, names, goals = content["history"], list(content["objectives"]), list(content["objectives"].values())
    x, y = values_of(trials, i), values_of(trials, j)
    lines = trial_points(content, trials, x, y)
    if content["best"]:
        front = values_of(content["best"], i), values_of(content["best"], j)
        order = np.argsort(front[0], kind="stable")
        look = FRONT if len(names) == 2 else replace(FRONT, dash="")
        lines.append(Line("Beaten by none", slim(front[0][order]), slim(front[1][order]), look))
        lines.append(Line("In best.toml", slim(front[0][:1]), slim(front[1][:1]), BEST))
    before = np.array([[goals[k]["tuning"]["before"]] for k in (i, j)], dtype=float)
    lines.append(Line("Without tuning", slim(before[0]), slim(before[1]), BEFORE))
    return Chart(
        f"front-{key_of(names[i])}-{key_of(names[j])}",
        f"{capital(names[j])} over {names[i]} of each trial, and those that no other beats in both",
        goal_label(content, i),
        goal_label(content, j),
        tuple(lines),
        logarithmic=("x" if spread_out(x) else "") + ("y" if spread_out(y) else ""),
    )


def _front_table(content: Mapping[str, Any]) -> Table:
    """What none beats: values and settings, that of best.toml first."""
    names = list(content["settings"])
    rows = [
        [str(trial["number"]), *map(number, trial["values"]), *(value_words(trial["settings"][name]) for name in names)]
        for trial in content["best"][:MOST]
    ]
    return Table(["Trial", *content["objectives"], *(name.rpartition(".")[2] for name in names)], rows)


def key_of(name: str) -> str:
    """A name of a user's as part of a figure's."""
    return "".join(letter if letter.isalnum() else "-" for letter in name)
