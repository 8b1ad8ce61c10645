"""When a drive passes: a figure of merit and its limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rumo.campaigns.judging.columns import DONE, KPI, RUN, column_of, done, inside, numbers, title_of, unit_of
from rumo.checks import a_name, finite_number, printable
from rumo.errors import ArgumentError, UnknownNameError

if TYPE_CHECKING:
    import pandas as pd

FIELDS = ("kpi", "at_most", "at_least")


@dataclass(frozen=True)
class Criterion:
    """A figure of merit, and the limits between which a drive passes.

    A drive that raised, crashed or ran out of time fails, and so does one of which the figure is not known.

    Parameters
    ----------
    name : str
        For readers: "close".
    kpi : str
        Key of the figure, as in `summary.json`: "tracking_error_max_after_2s_m"; of a figure with parts, with one of
        them: "input_variation_per_s.torque".
    at_most, at_least : float, optional
        The limits, themselves within; one of them or both, in the figure's unit.

    Raises
    ------
    ArgumentError
        If there is no limit, one is not a finite number, or nothing lies between them.
    """

    name: str
    kpi: str
    at_most: float | None = None
    at_least: float | None = None

    def __post_init__(self) -> None:
        a_name(self.name, "criteria")
        printable(self.kpi, self._named("kpi"), "the key of a figure of merit")
        for field in ("at_most", "at_least"):
            value = getattr(self, field)
            if value is not None:
                object.__setattr__(self, field, finite_number(value, self._named(field)))
        if self.at_most is None and self.at_least is None:
            raise ArgumentError(f"criteria.{self.name}", "no limit", "at_most, at_least, or both")
        if self.lower > self.upper:
            got = f"at_least = {self.lower:g} and at_most = {self.upper:g}"
            raise ArgumentError(f"criteria.{self.name}", got, "limits with something between them")

    def _named(self, field: str) -> str:
        return f"criteria.{self.name}.{field}"

    @classmethod
    def of(cls, name: str, table: Mapping[str, Any]) -> Criterion:
        """A criterion from plain data: {"kpi": "fallbacks", "at_most": 0}."""
        if not isinstance(table, Mapping):
            raise ArgumentError(f"criteria.{name}", repr(table), 'a table such as { kpi = "fallbacks", at_most = 0 }')
        for field in table:
            if field not in FIELDS:
                raise UnknownNameError(f"criteria.{name}", field, FIELDS)
        if "kpi" not in table:
            raise ArgumentError(f"criteria.{name}", "no kpi", 'a table such as { kpi = "fallbacks", at_most = 0 }')
        return cls(name, **table)

    @property
    def plain(self) -> dict[str, Any]:
        """As plain data, from which `of` makes it again."""
        limits = {field: getattr(self, field) for field in ("at_most", "at_least")}
        return {"kpi": self.kpi, **{field: value for field, value in limits.items() if value is not None}}

    @property
    def lower(self) -> float:
        """The least that passes."""
        return -inf if self.at_least is None else self.at_least

    @property
    def upper(self) -> float:
        """The most that passes."""
        return inf if self.at_most is None else self.at_most

    @property
    def limits(self) -> tuple[float, ...]:
        """Those that there are."""
        return tuple(limit for limit in (self.lower, self.upper) if isfinite(limit))

    @property
    def words(self) -> str:
        """What is asked, to go on from a name: "largest error after 2 s at most 0.3 m"."""
        title, unit = title_of(self.kpi), unit_of(self.kpi)
        parts = [
            f"{words} {limit:g}"
            for words, limit in (("at least", self.at_least), ("at most", self.at_most))
            if limit is not None
        ]
        return f"{inside(title)} {' and '.join(parts)}" + (f" {unit}" if unit else "")

    def why(self, row: Mapping[str, Any]) -> str:
        """Why a run fails, in a few words; nothing if it passes.

        Parameters
        ----------
        row : mapping
            Of the run: its `outcome`, and its figures of merit in columns `kpi.KEY`, those of times in `run.KEY`.
        """
        if row.get("outcome") != DONE:
            return str(row.get("outcome"))
        value = self.value(row)
        if value is None:
            return "not known"
        if value < self.lower:
            return f"{value:.4g}, less than {self.lower:g}"
        return f"{value:.4g}, more than {self.upper:g}" if value > self.upper else ""

    def value(self, row: Mapping[str, Any]) -> float | None:
        """The figure in a run; None where it is not known."""
        found = next((row[name] for name in (KPI + self.kpi, RUN + self.kpi) if row.get(name) is not None), None)
        return None if found is None or found != found else float(found)

    def values(self, rows: pd.DataFrame) -> NDArray[np.float64]:
        """The figure in each run (n,); NaN where it is not known."""
        column = column_of(self.kpi, rows.columns)
        return np.full(len(rows), np.nan) if column is None else numbers(rows, column)

    def passed(self, rows: pd.DataFrame) -> NDArray[np.bool_]:
        """Which runs pass (n,)."""
        values = self.values(rows)
        return done(rows) & (values >= self.lower) & (values <= self.upper)

    def excess(self, rows: pd.DataFrame) -> NDArray[np.float64]:
        """How far each run is beyond the nearer limit (n,), negative within; NaN where the figure is not known."""
        values = self.values(rows)
        return np.fmax(self.lower - values, values - self.upper)
