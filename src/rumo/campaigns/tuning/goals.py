"""What a tuning is for: figures of merit over many drives, to be small or large, or within limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from math import inf
from types import MappingProxyType
from typing import Any

import numpy as np

from rumo.campaigns.columns import DONE, KPI, RUN, title_of, unit_of
from rumo.campaigns.task import Row
from rumo.checks import finite_number, known_names, positive_number, printable
from rumo.errors import ArgumentError, UnknownNameError

OVER: Mapping[str, Callable[[Sequence[float]], float]] = MappingProxyType(
    {
        "mean": lambda values: float(np.mean(values)),
        "median": lambda values: float(np.median(values)),
        "p95": lambda values: float(np.percentile(values, 95.0)),
        "max": max,
        "min": min,
    }
)
"""From the figures of all drives to one."""


def figure(rows: Sequence[Row], kpi: str, of: str) -> float | None:
    """A figure of merit over drives; None if one of them did not come to its end, or does not say.

    Parameters
    ----------
    rows : sequence of dict
        Of the drives.
    kpi : str
        Its key: "tracking_error_rms_after_2s_m", "input_variation_per_s.torque".
    of : str
        One of `OVER`.
    """
    values = list[float]()
    for row in rows:
        found = [row[name] for name in (KPI + kpi, RUN + kpi) if row.get(name) is not None]
        if row["outcome"] != DONE or not found or not np.isfinite(found[0]):
            return None
        values.append(float(found[0]))
    return OVER[of](values)


@dataclass(frozen=True)
class Goal:
    """A figure of merit over many drives.

    Parameters
    ----------
    name : str
        For readers: "error".
    kpi : str
        Its key.
    of : str
        Over all drives: one of `OVER`.
    """

    name: str
    kpi: str
    of: str = "mean"

    def __post_init__(self) -> None:
        printable(self.name, "name")
        known_names((self.of,), f"{self.name}.of", OVER)

    def figure(self, rows: Sequence[Row]) -> float | None:
        """Over drives; None if one of them did not come to its end, or does not say."""
        return figure(rows, self.kpi, self.of)

    @property
    def words(self) -> str:
        """For readers: "mean RMS error after 2 s [m]"."""
        return f"{self.of} {title_of(self.kpi)} [{unit_of(self.kpi) or '1'}]"

    @property
    def plain(self) -> dict[str, Any]:
        """As plain data, from which `goals_of` makes it again."""
        own = {item.name: getattr(self, item.name) for item in fields(self) if item.name != "name"}
        return {name: value for name, value in own.items() if value is not None}


@dataclass(frozen=True)
class Objective(Goal):
    """A figure of merit to be small.

    Parameters
    ----------
    name, kpi, of
        See `Goal`.
    maximise : bool
        Whether it is to be large.
    """

    maximise: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.maximise, bool):
            raise ArgumentError(f"objectives.{self.name}.maximise", repr(self.maximise), "true or false")


@dataclass(frozen=True)
class Limit(Goal):
    """A figure of merit that must not be too large, or too small.

    Parameters
    ----------
    name, kpi, of
        See `Goal`.
    at_most, at_least : float, optional
        In the figure's unit.
    times_base : float, optional
        At most so many times what it is without tuning.
    """

    at_most: float | None = None
    at_least: float | None = None
    times_base: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for argument in ("at_most", "at_least"):
            if getattr(self, argument) is not None:
                finite_number(getattr(self, argument), f"limits.{self.name}.{argument}")
        if self.times_base is not None:
            positive_number(self.times_base, f"limits.{self.name}.times_base")
        if self.at_most is None and self.at_least is None and self.times_base is None:
            raise ArgumentError(f"limits.{self.name}", "no limit", "at_most, at_least or times_base")

    def violation(self, rows: Sequence[Row], base: Sequence[Row]) -> float | None:
        """By how much drives are beyond it, relative to the limit; at most 0 within. None if they do not say."""
        value, before = self.figure(rows), self.figure(base)
        if value is None:
            return None
        upper = inf if self.at_most is None else self.at_most
        lower = -inf if self.at_least is None else self.at_least
        if self.times_base is not None and before is not None:
            upper = min(upper, self.times_base * before)
        beyond = max((value - upper) / (abs(upper) or 1.0), (lower - value) / (abs(lower) or 1.0))
        return beyond if np.isfinite(beyond) else 0.0


def goals_of(kind: type[Goal], table: Any, argument: str) -> dict[str, Any]:
    """Objectives or limits of plain data, by name."""
    if not isinstance(table, Mapping):
        raise ArgumentError(argument, repr(table), f"tables: [{argument}.NAME]")
    found = dict[str, Any]()
    for name, given in table.items():
        if not isinstance(given, Mapping):
            raise ArgumentError(f"{argument}.{name}", repr(given), 'a table such as { kpi = "fallbacks", of = "max" }')
        known = [item.name for item in fields(kind) if item.name != "name"]
        for key in given:
            if key not in known:
                raise UnknownNameError(f"{argument}.{name}.{key}", key, known)
        if "kpi" not in given:
            raise ArgumentError(f"{argument}.{name}", "no kpi", 'a table such as { kpi = "fallbacks", of = "max" }')
        found[name] = kind(name, **given)
    return found
