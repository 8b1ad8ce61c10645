"""What is said of a tuning, as plain data: `summary.json`."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

import numpy as np

from rumo.campaigns.judging.columns import SETTING
from rumo.campaigns.judging.statistics import paired
from rumo.campaigns.judging.summary import kind_of, plain
from rumo.campaigns.searching.search import Trial
from rumo.campaigns.searching.space import options_of
from rumo.campaigns.tasks.task import Row
from rumo.campaigns.tuning.course import Tuned
from rumo.campaigns.tuning.goals import Goal, Limit, Objective, figures_of

NEAR = 0.02
"""Of a range: what is nearer to its end is at it."""


def summary(tuned: Tuned, name: str) -> dict[str, Any]:
    """Everything that the report says, as numbers, strings, None, lists and mappings.

    Returns
    -------
    dict
        `trials`: how many were asked for, are done, within the limits, and failed. `objectives` and `limits`, by name:
        their value before and after, over the drives of the trials (`tuning`) and over those of the check (`check`),
        there with the mean difference of the same drive and its interval. `settings`: before and after, and whether
        they are at the end of what may be chosen. `best`: those that none beats. `importance`: by objective and
        setting. `failures`: drives that did not come to their end. `history`: all trials. `specification`: what was
        asked.
    """
    tuning, trials = tuned.tuning, tuned.trials
    failed = [trial for trial in trials if not trial.values]
    return {
        "tuning": name,
        "complete": tuned.stopped is None,
        "controller": tuning.controller,
        "sampler": tuning.sampler,
        "trials": {
            "asked": tuning.trials,
            "done": len(trials),
            "feasible": sum(trial.feasible for trial in trials),
            "failed": len(failed),
        },
        "objectives": {each.name: _objective(tuned, each) for each in tuning.objectives.values()},
        "limits": {each.name: _limit(tuned, each) for each in tuning.limits.values()},
        "settings": _settings(tuned),
        "best": [_trial(trial) for trial in tuned.best],
        "importance": {objective: dict(of) for objective, of in tuned.importance.items()},
        "failures": failures(tuned.failed),
        "history": [_trial(trial) for trial in trials],
        "specification": tuning.plain,
    }


def _objective(tuned: Tuned, objective: Objective) -> dict[str, Any]:
    return {
        "kpi": objective.kpi,
        "of": objective.of,
        "maximise": objective.maximise,
        "tuning": _change(objective, tuned.base, tuned.after),
        "check": None if tuned.judged is None else _paired(objective, tuned.judged.before, tuned.judged.after),
    }


def _limit(tuned: Tuned, limit: Limit) -> dict[str, Any]:
    found = {"kpi": limit.kpi, "of": limit.of, "tuning": _held(limit, tuned.base, tuned.after), "check": None}
    if tuned.judged is not None:
        before, after = tuned.judged.before, tuned.judged.after
        found["check"] = _paired(limit, before, after) | _held(limit, before, after)
    return found


def _change(goal: Goal, before: Sequence[Row], after: Sequence[Row]) -> dict[str, Any]:
    first, last = goal.figure(before), goal.figure(after) if after else None
    ratio = last / first if first and last is not None else None
    return {"drives": len(before), "before": first, "after": last, "ratio": ratio}


def _paired(goal: Goal, before: Sequence[Row], after: Sequence[Row]) -> dict[str, Any]:
    """Before and after, and the mean of what the same drive has more or less after."""
    found = paired(figures_of(after, goal.kpi), figures_of(before, goal.kpi))
    return {
        **_change(goal, before, after),
        "pairs": found.pairs,
        "difference": found.mean.value,
        "interval": found.mean.plain,
        "less": found.less,
        "more": found.more,
    }


def _held(limit: Limit, before: Sequence[Row], after: Sequence[Row]) -> dict[str, Any]:
    low, high = limit.ends(before)
    return {
        **_change(limit, before, after),
        "at_least": low if isfinite(low) else None,
        "at_most": high if isfinite(high) else None,
        "held_before": _holds(limit, before, before),
        "held_after": _holds(limit, after, before) if after else None,
    }


def _holds(limit: Limit, rows: Sequence[Row], base: Sequence[Row]) -> bool:
    beyond = limit.violation(rows, base)
    return beyond is not None and beyond <= 0.0


def _settings(tuned: Tuned) -> dict[str, Any]:
    tuning, best = tuned.tuning, tuned.best[0].settings if tuned.best else {}
    before = tuning.begun_with
    return {
        name: {
            "before": before.get(name),
            "after": best.get(name),
            "choice": choice.plain,
            "at_end": name in best and _at_end(choice, best[name]),
        }
        for name, choice in tuning.search.items()
    }


def _at_end(choice: Any, value: Any) -> bool:
    """Whether a value is so near to an end of what may be chosen that better ones may be beyond."""
    if options_of(choice) is not None:
        return False
    low, high = choice.ends
    if choice.name == "log-uniform":
        low, high, value = np.log([low, high, value])
    return bool(min(value - low, high - value) <= NEAR * (high - low))


def _trial(trial: Trial) -> dict[str, Any]:
    return {
        "number": trial.number,
        "settings": dict(trial.settings),
        "values": list(trial.values),
        "beyond": dict(trial.constraints),
        "feasible": trial.feasible,
    }


def failures(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Drives that did not come to their end, by outcome and message without its numbers, the most frequent first."""
    kinds: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        kinds.setdefault((row["outcome"], kind_of(str(row.get("error") or ""))), []).append(row)
    found = [_failure(min(of, key=lambda row: row["key"]), len(of)) for of in kinds.values()]
    return sorted(found, key=lambda each: (-each["drives"], each["outcome"], each["key"]))


def _failure(row: Row, drives: int) -> dict[str, Any]:
    settings = {name.removeprefix(SETTING): plain(value) for name, value in row.items() if name.startswith(SETTING)}
    return {
        "outcome": row["outcome"],
        "message": str(row.get("error") or "").strip().partition("\n")[0],
        "drives": drives,
        "key": row["key"],
        "settings": {name: value for name, value in settings.items() if value is not None},
    }
