"""What is said of a campaign, as plain data: `summary.json`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import combinations
from typing import Any

import numpy as np

from rumo.campaigns.judging.columns import DONE, MADE_WITH, RUN, STATUS, better_of, key_of, numbers, texts
from rumo.campaigns.judging.results import Results
from rumo.campaigns.judging.statistics import discordance, holm, paired, rank_correlation, wilson
from rumo.signals import Array

WORST = 10
"""Runs that are named."""
PERCENTILES = (5.0, 50.0, 95.0, 99.0)
ENDINGS = 8
"""Kinds of failure of each outcome that are named; the others are counted."""


def summary(results: Results, pairs: Iterable[tuple[str, str]] | None = None) -> dict[str, Any]:
    """Everything that the report says, as numbers, strings, None, lists and mappings.

    Parameters
    ----------
    results : Results
        Of the campaign.
    pairs : iterable of (str, str), optional
        Controllers that are compared; each two if not given.

    Returns
    -------
    dict
        `controllers`: for each the outcomes of its runs, how many pass each criterion and all, with Wilson's interval,
        for each figure of merit how many runs know it, mean, percentiles, least and most, and which builds of the core
        drove how many. `worst`: the worst runs
        by the first criterion. `rank_correlations`: by figure, setting and controller. `comparisons`: of each two
        controllers on the same draws; of criteria with the probability `chance` of the sign test, and `corrected` by
        Holm for all of them together in which any draw differs. `failures`: what went wrong, by kind. `versions`: of
        what made the rows.
    """
    rows, compared = results.rows, combinations(results.controllers, 2) if pairs is None else pairs
    return {
        "campaign": results.name,
        "runs": len(rows),
        "draws": len(set(rows["draw"])),
        "complete": results.asked is None or len(rows) >= results.asked,
        "criteria": {criterion.name: criterion.plain for criterion in results.criteria},
        "controllers": {name: _controller(results, name) for name in results.controllers},
        "worst": [run_of(results, row, results.leading) for row in worst(results)],
        "rank_correlations": {key_of(column): correlations(results, column) for column in results.figures},
        "comparisons": _corrected([_comparison(results, *pair) for pair in compared]),
        "failures": failures(results),
        "versions": versions(results),
        "wall_time_s": _total(results, "wall_time_s"),
        "specification": dict(results.specification),
    }


def worst(results: Results, column: str | None = None) -> list[int]:
    """Rows of the worst runs by a figure; by that of the first criterion if none is given."""
    column = results.leading if column is None else column
    return [] if column is None else results.worst(column, WORST)


def _controller(results: Results, name: str) -> dict[str, Any]:
    mine = results.of(name)
    outcomes = np.array(texts(results.rows, "outcome"), dtype=str)[mine]
    named, counts = np.unique(outcomes, return_counts=True)
    statuses = [column for column in results.rows.columns if column.startswith(STATUS)]
    steps = {column.removeprefix(STATUS): float(np.nansum(results.values(column)[mine])) for column in statuses}
    judged = {criterion: passes[mine] for criterion, passes in results.passes.items()}
    return {
        "runs": int(mine.sum()),
        "outcomes": dict(zip(named.tolist(), counts.tolist(), strict=True)),
        "criteria": {criterion: share(passes) for criterion, passes in judged.items()},
        "all_criteria": share(results.passed[mine]) if judged else None,
        "kpis": {key_of(column): spread(results.values(column)[mine]) for column in results.figures},
        "statuses": {status: int(count) for status, count in steps.items() if count},
        "builds": _builds(results, name),
    }


def _builds(results: Results, name: str) -> dict[str, int]:
    """Which builds of the core, tailored or portable, drove how many of a controller's runs, as far as rows say."""
    named = zip(texts(results.rows, f"{RUN}backend"), results.of(name).tolist(), strict=True)
    return dict(sorted(Counter(build for build, mine in named if mine and build).items()))


def share(passes: Any) -> dict[str, Any]:
    """How many of the runs (n,) pass, and the interval in which their share lies."""
    found = wilson(int(passes.sum()), len(passes))
    return {"passed": int(passes.sum()), "runs": len(passes), "share": found.value, "interval": found.plain}


def spread(values: Array) -> dict[str, Any]:
    """How values (n,) are distributed; None where nothing is known."""
    known = values[np.isfinite(values)]
    names = ("mean", "min", *(f"p{p:g}" for p in PERCENTILES), "max")
    if not known.size:
        return {"known": 0, **dict.fromkeys(names)}
    found = (known.mean(), known.min(), *np.percentile(known, PERCENTILES), known.max())
    return {"known": int(known.size), **dict(zip(names, map(float, found), strict=True))}


def run_of(results: Results, row: int, column: str | None) -> dict[str, Any]:
    """A run, and a figure of it."""
    run = results.rows.iloc[row]
    key = str(run["key"])
    value = None if column is None else float(results.values(column)[row])
    settings = {name: plain(run[f"setting.{name}"]) for name in results.varied}
    return {
        "key": key,
        "controller": str(run["controller"]),
        "draw": int(run["draw"]),
        "kpi": None if column is None else key_of(column),
        "value": value,
        "settings": settings,
        "ended": plain(run.get("ended")),
        "log": results.log_of(key) is not None,
    }


def plain(value: Any) -> Any:
    """A cell as plain data; None where it has nothing."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if value is None or value != value else value


def correlations(results: Results, column: str) -> dict[str, dict[str, Any]]:
    """Rank correlation of a figure with each setting that varies, by setting and controller; None where unknown."""
    values, found = results.values(column), dict[str, dict[str, Any]]()
    for name in results.numeric:
        setting = results.setting(name)
        found[name] = {}
        for controller in results.controllers:
            mine = results.of(controller)
            correlation = rank_correlation(setting[mine], values[mine])
            found[name][controller] = None if correlation is None else vars(correlation)
    return found


def _comparison(results: Results, first: str, second: str) -> dict[str, Any]:
    one, other = results.pairs(first, second)
    return {
        "first": first,
        "second": second,
        "draws": len(one),
        "criteria": {
            name: {**vars(discordance(passes[one], passes[other]))} for name, passes in results.passes.items()
        },
        "kpis": {key_of(column): _difference(column, results, one, other) for column in results.figures},
    }


def _corrected(comparisons: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Comparisons, whose tests of criteria are corrected for each other."""
    tests = differing(comparisons)
    for found in comparisons:
        for each in found["criteria"].values() if found["draws"] else ():
            each["corrected"] = each["chance"]
    for each, corrected in zip(tests, holm([each["chance"] for each in tests]), strict=True):
        each["corrected"] = corrected
    return comparisons


def differing(comparisons: Iterable[Mapping[str, Any]]) -> list[Any]:
    """Tests of criteria that could have found something: without a draw that only one passes, none can, or errs."""
    tests = [each for found in comparisons for each in found["criteria"].values()]
    return [each for each in tests if each["first"] + each["second"]]


def _difference(column: str, results: Results, one: Any, other: Any) -> dict[str, Any]:
    values = results.values(column)
    found = paired(values[one], values[other])
    better = {"less": (found.less, found.more), "more": (found.more, found.less)}.get(better_of(column), (None, None))
    return {
        "pairs": found.pairs,
        "mean": found.mean.value,
        "interval": found.mean.plain,
        "median": found.median,
        "largest": found.largest,
        "first_better": better[0],
        "second_better": better[1],
    }


def failures(results: Results) -> list[dict[str, Any]]:
    """What went wrong, by controller, outcome and message without its numbers, the most frequent first."""
    outcomes, errors, ended = (texts(results.rows, name) for name in ("outcome", "error", "ended"))
    keys = texts(results.rows, "key")
    kinds: dict[tuple[str, str, str], list[int]] = {}
    for row, (controller, outcome, error, end) in enumerate(
        zip(results.driver.tolist(), outcomes, errors, ended, strict=True)
    ):
        words = end if outcome == DONE else error
        if outcome == DONE and (not end or end.startswith(ARRIVED)):
            continue
        kinds.setdefault((controller, outcome if outcome != DONE else "lost", kind_of(words)), []).append(row)
    found = [
        {
            "controller": controller,
            "outcome": outcome,
            "runs": len(rows),
            "message": (ended if outcome == "lost" else errors)[min(rows, key=keys.__getitem__)],
            "key": min(keys[row] for row in rows),
        }
        for (controller, outcome, _), rows in kinds.items()
    ]
    return sorted(found, key=lambda kind: (-kind["runs"], kind["outcome"], kind["controller"], kind["key"]))


ARRIVED = "Arrived"
"""With which the sentence about the end of a drive begins that came where it was to."""


def kind_of(message: str) -> str:
    """A message without its numbers, and only its first line: those of the same cause are the same."""
    return re.sub(r"[-+]?\d[\d.,]*(e[-+]?\d+)?", "#", message.strip().partition("\n")[0])


def versions(results: Results) -> dict[str, dict[str, int]]:
    """How many runs were made by which versions, and on which machines."""
    found: dict[str, dict[str, int]] = {}
    for name in MADE_WITH:
        named, counts = np.unique([text or "-" for text in texts(results.rows, RUN + name)], return_counts=True)
        if RUN + name in results.rows.columns:
            found[name] = dict(zip(named.tolist(), counts.tolist(), strict=True))
    return found


def _total(results: Results, name: str) -> float | None:
    column = RUN + name
    return float(np.nansum(numbers(results.rows, column))) if column in results.rows.columns else None
