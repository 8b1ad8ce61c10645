"""What all drives of an estimator came to, question by question."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

import numpy as np

from rumo.studies.estimation.contenders import CONTENDERS
from rumo.studies.estimation.outcome import DRIVE
from rumo.studies.estimation.questions import QUESTIONS
from rumo.studies.kpis import KPIS

MEDIANS = ("beyond", "nis", "nis_expected", *(KPIS[name].key for name in DRIVE), "update_time_us")
FIRST = next(iter(CONTENDERS))


class Drive(Protocol):
    """What came of a drive."""

    @property
    def outcome(self) -> Mapping[str, Any]:
        """See `rumo.studies.estimation.outcome.outcome`."""
        ...


Results = Mapping[str, Mapping[str, Mapping[int, Drive]]]
"""By question, estimator and seed."""


def by_question(results: Results) -> dict[str, Any]:
    """What came of the drives by question and estimator: see `together`.

    `update_time_ratio` is how many times the update of `FIRST` an update takes, of the same question.
    """
    found: dict[str, Any] = {}
    for question, estimators in results.items():
        every = {name: together(drive.outcome for drive in drives.values()) for name, drives in estimators.items()}
        first = every.get(FIRST, {}).get("update_time_us")
        for each in every.values():
            each["update_time_ratio"] = each["update_time_us"] / first if first else None
        asked = QUESTIONS[question]
        found[question] = {"title": asked.title, "meaning": asked.meaning, "estimators": every}
    return found


def together(outcomes: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """What came of drives that differ by their seed.

    Returns
    -------
    dict
        `drives` and `lost`: how many. `rmse`, by signal, and what is in `MEDIANS`: medians. `position_worst_m`: the
        largest root mean square error of the position. `settled_s`: the longest; None if a drive never did.
        `farthest`: the largest.
    """
    every = list(outcomes)
    signals = dict.fromkeys(name for each in every for name in each["rmse"])
    settled = [each["settled_s"] for each in every]
    worst = [each["rmse"]["position"] for each in every if each["rmse"]["position"] is not None]
    return {
        "drives": len(every),
        "lost": sum(each["lost"] for each in every),
        "rmse": {name: _median(each["rmse"].get(name) for each in every) for name in signals},
        "position_worst_m": max(worst, default=None),
        "settled_s": None if None in settled else max(settled, default=None),
        "farthest": max((each["farthest"] for each in every if each["farthest"] is not None), default=None),
        **{name: _median(each[name] for each in every) for name in MEDIANS},
    }


def _median(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None
