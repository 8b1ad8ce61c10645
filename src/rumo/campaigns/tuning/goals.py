"""What a tuning is for: figures of merit over many drives, to be small or large, or within limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from math import inf, isfinite
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from rumo.campaigns.judging.columns import DONE, KPI, RUN, inside, key_of, title_of, unit_of
from rumo.campaigns.tasks.task import Row
from rumo.checks import a_name, finite_number, known_names, positive_number, printable
from rumo.errors import ArgumentError, UnknownNameError
from rumo.signals import Array

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
    if any(row["outcome"] != DONE for row in rows):
        return None
    values = figures_of(rows, kpi)
    return OVER[of](values.tolist()) if values.size and np.isfinite(values).all() else None


def figures_of(rows: Sequence[Row], kpi: str) -> Array:
    """A figure of merit of each drive (n,); NaN where it is not known."""
    found = ((row.get(KPI + kpi), row.get(RUN + kpi)) for row in rows)
    values = np.array([next((v for v in pair if v is not None), np.nan) for pair in found], dtype=float)
    return np.where(np.isfinite(values), values, np.nan)


def parts_known(rows: Sequence[Row], kpi: str) -> list[str]:
    """Keys that rows have of a figure of merit with parts, whatever the part."""
    head = kpi.partition(".")[0]
    names = dict.fromkeys(key_of(name) for row in rows for name in row if name.startswith((KPI, RUN)))
    return [name for name in names if name.partition(".")[0] == head]


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

    TABLE: ClassVar[str] = "goals"

    name: str
    kpi: str
    of: str = "mean"

    def __post_init__(self) -> None:
        a_name(self.name, self.TABLE)
        printable(self.kpi, self._argument("kpi"))
        known_names((self.of,), self._argument("of"), OVER)

    def _argument(self, part: str) -> str:
        return f"{self.TABLE}.{self.name}.{part}"

    def figure(self, rows: Sequence[Row]) -> float | None:
        """Over drives; None if one of them did not come to its end, or does not say."""
        return figure(rows, self.kpi, self.of)

    @property
    def words(self) -> str:
        """For readers: "mean RMS error after 2 s [m]"."""
        return f"{self.of} {inside(title_of(self.kpi))} [{unit_of(self.kpi) or '1'}]"

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

    TABLE: ClassVar[str] = "objectives"

    maximise: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.maximise, bool):
            raise ArgumentError(self._argument("maximise"), repr(self.maximise), "true or false")


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

    TABLE: ClassVar[str] = "limits"

    at_most: float | None = None
    at_least: float | None = None
    times_base: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for part in ("at_most", "at_least"):
            if getattr(self, part) is not None:
                finite_number(getattr(self, part), self._argument(part))
        if self.times_base is not None:
            positive_number(self.times_base, self._argument("times_base"))
        if self.at_most is None and self.at_least is None and self.times_base is None:
            raise ArgumentError(f"{self.TABLE}.{self.name}", "no limit", "at_most, at_least or times_base")
        if self.at_most is not None and self.at_least is not None and self.at_least > self.at_most:
            got = f"at_least = {self.at_least:g} and at_most = {self.at_most:g}"
            raise ArgumentError(f"{self.TABLE}.{self.name}", got, "limits with something between them")

    def ends(self, base: Sequence[Row]) -> tuple[float, float]:
        """The least and the largest value that holds, infinite where there is none.

        Parameters
        ----------
        base : sequence of dict
            Of the drives without tuning.
        """
        upper, before = inf if self.at_most is None else self.at_most, self.figure(base)
        if self.times_base is not None and before is not None:
            upper = min(upper, self.times_base * before)
        return -inf if self.at_least is None else self.at_least, upper

    def violation(self, rows: Sequence[Row], base: Sequence[Row]) -> float | None:
        """By how much drives are beyond it, relative to the limit; at most 0 within. None if they do not say."""
        value, (lower, upper) = self.figure(rows), self.ends(base)
        if value is None:
            return None
        beyond = [(value - upper, upper), (lower - value, lower)]
        return max((by / (abs(limit) or 1.0) for by, limit in beyond if isfinite(limit)), default=0.0)


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
