"""What is said of a falsification, as plain data: `summary.json`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.campaigns.falsification.falsify import FOUND, Falsified, Tried
from rumo.campaigns.falsification.shrinking import Found
from rumo.campaigns.falsification.specification import Falsification
from rumo.campaigns.tasks.task import Row


def summary(falsified: Falsified, name: str) -> dict[str, Any]:
    """Everything that the report says, as numbers, strings, None, lists and mappings.

    Parameters
    ----------
    falsified : Falsified
        What came of it.
    name : str
        Of the falsification, for its page.

    Returns
    -------
    dict
        `trials`: how many were asked for and done, of these how many violate something, hold, or failed. `found`:
        the smallest disturbance, what it violates and by how much, and the largest size that holds on the way, or
        None. `nearest`: where nothing was found, the trial that came nearest to a limit. `without`: figures of the
        drive without a disturbance. `history`: all trials. `settings`: what may be chosen, and what has a size.
    """
    what, trials = falsified.falsification, falsified.trials
    violating = sum(bool(trial.violated) for trial in trials)
    failed = [trial for trial in trials if trial.violated is None]
    holding = [trial for trial in trials if trial.violated == ()]
    nearest = max(holding, key=lambda trial: what.way(trial.row, falsified.undisturbed), default=None)
    return {
        "falsification": name,
        "controller": what.controller,
        "sampler": what.sampler,
        "complete": falsified.stopped is None,
        "criteria": {key: criterion.plain for key, criterion in what.criteria.items()},
        "settings": {
            key: {"choice": choice.plain, "nothing": what.size.get(key)} for key, choice in what.search.items()
        },
        "largest_size": len(what.size) ** 0.5,
        "trials": {
            "asked": what.trials,
            "done": len(trials),
            "violating": violating,
            "holding": len(holding),
            "failed": len(failed),
        },
        "without": _judged(what, falsified.found.without if falsified.found else falsified.undisturbed),
        "found": None if falsified.found is None else _found(what, falsified.found, trials),
        "nearest": None if violating or nearest is None else _tried(what, nearest),
        "history": [{"number": i, **_tried(what, trial)} for i, trial in enumerate(trials)],
        "failures": [
            {"key": trial.row["key"], "outcome": trial.row["outcome"], "error": trial.row["error"]} for trial in failed
        ],
        "specification": what.plain,
    }


def _tried(what: Falsification, trial: Tried) -> dict[str, Any]:
    return {
        "key": trial.row["key"],
        "size": trial.size,
        "violated": None if trial.violated is None else list(trial.violated),
        "settings": dict(trial.settings),
        "values": {name: each["value"] for name, each in _judged(what, trial.row).items()},
    }


def _found(what: Falsification, found: Found, trials: tuple[Tried, ...]) -> dict[str, Any]:
    smaller = [trial for trial in trials if trial.violated == () and trial.size < found.size]
    return {
        "key": found.row["key"],
        "size": found.size,
        "settings": dict(found.settings),
        "violated": list(found.violated),
        "criteria": _judged(what, found.row),
        "holds_at": found.holds_at,
        "held": None if found.held is None else _judged(what, found.held),
        "held_key": None if found.held is None else found.held["key"],
        "smaller_that_hold": len(smaller),
        "scenario": FOUND,
        "outcome": found.row["outcome"],
        "error": found.row.get("error"),
        "ended": found.row.get("ended"),
    }


def _judged(what: Falsification, row: Row) -> dict[str, Mapping[str, Any]]:
    """By criterion: its figure in a drive, and why it is violated; nothing if it is not."""
    return {
        name: {"value": criterion.value(row), "why": criterion.why(row)} for name, criterion in what.criteria.items()
    }
