"""What is said of a case: figures, and the goals that they have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

Outcomes = Mapping[Any, Mapping[str, Any]]
"""What came of a controller's drives of a case, by variant."""


@dataclass(frozen=True)
class Goal:
    """What a figure is to reach.

    Parameters
    ----------
    limit : float
        In the figure's unit.
    at_least : bool
        Whether it is the least that is wanted; else the most that is allowed.
    """

    limit: float
    at_least: bool = False

    def met(self, value: float | None) -> bool:
        """Whether a figure reaches it; one that there is not does not."""
        return value is not None and (value >= self.limit if self.at_least else value <= self.limit)


@dataclass(frozen=True)
class Row:
    """A figure of a case.

    Parameters
    ----------
    figure : str
        What it is, in words.
    value : float or None
        None where no drive says.
    unit : str
        "" for none.
    goal : Goal, optional
        None where it is reported only.
    note : str
        What a reader needs to know of it, such as the drive it is of.
    """

    figure: str
    value: float | None
    unit: str
    goal: Goal | None = None
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether it reaches its goal; None without one."""
        return None if self.goal is None else self.goal.met(self.value)

    @property
    def content(self) -> dict[str, Any]:
        """For `summary.json`."""
        goal = None if self.goal is None else {"limit": self.goal.limit, "at_least": self.goal.at_least}
        return {
            "figure": self.figure,
            "value": self.value,
            "unit": self.unit,
            "goal": goal,
            "met": self.met,
            "note": self.note,
        }


def values(outcomes: Outcomes, name: str) -> dict[Any, float]:
    """A figure of all drives that have it, by variant."""
    return {variant: float(each[name]) for variant, each in outcomes.items() if each.get(name) is not None}


def largest(outcomes: Outcomes, name: str) -> tuple[float | None, str]:
    """The largest value of a figure of the drives that have it, and the variant it is of; None if one has it not."""
    found = values(outcomes, name)
    if not found or len(found) < len(outcomes):
        return None, listed(variant for variant in outcomes if variant not in found)
    worst = max(found, key=lambda variant: found[variant])
    return found[worst], listed([worst])


def median(outcomes: Outcomes, name: str) -> float | None:
    """Of a figure of all drives, where those that do not have it count as infinite; None if that is infinite."""
    found = values(outcomes, name)
    middle = float(np.median([found.get(variant, np.inf) for variant in outcomes])) if outcomes else np.inf
    return middle if np.isfinite(middle) else None


def share(outcomes: Outcomes, wanted: str) -> tuple[float, str]:
    """Share of the drives with an outcome in percent, and in words which have another."""
    others = [variant for variant, each in outcomes.items() if each["outcome"] != wanted]
    note = f"{len(outcomes) - len(others)} of {len(outcomes)}"
    return 100.0 * (1.0 - len(others) / len(outcomes)), f"{note}, not {listed(others)}" if others else note


def listed(items: Iterable[Any]) -> str:
    """Names one after the other."""
    return ", ".join(f"{item:g}" if isinstance(item, float) else str(item) for item in items)
