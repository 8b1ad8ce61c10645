"""What came of a campaign: its rows, and what they are to be judged by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rumo.campaigns.judging.columns import (
    BY_KEY,
    KPI,
    RUN,
    SETTING,
    better_of,
    column_of,
    is_seed,
    key_of,
    kpi_of,
    numbers,
    texts,
)
from rumo.campaigns.judging.criteria import Criterion
from rumo.errors import ArgumentError, UnknownNameError
from rumo.scenarios import BASES, Recipe
from rumo.signals import Array

if TYPE_CHECKING:
    import pandas as pd

NEEDED = ("key", "draw", "controller", "outcome")
"""Columns that rows have at least."""


@dataclass(frozen=True, eq=False)
class Results:
    """What came of a campaign.

    Parameters
    ----------
    rows : pandas.DataFrame
        One for each run, with columns `key`, `draw`, `controller`, `outcome`, `setting.NAME`, `kpi.KEY`, and so on.
    criteria : tuple of Criterion
        By which runs are judged; the first decides which are the worst. Without any, the first figure of merit does.
    controllers : tuple of str
        In the order in which they are shown; those of the rows if not given.
    heat_map : tuple of str, optional
        Two settings whose heat map is shown, in place of the two on which most depends.
    name : str
        Of the campaign, for its page.
    folder : Path, optional
        With `logs/KEY.nc` of some of the runs.
    specification : mapping
        What the campaign was told, as plain data, for its page.
    asked : int, optional
        How many runs there are to be: with fewer, something has ended the campaign early.

    Raises
    ------
    ArgumentError
        If columns are missing, or there is no such setting of the heat map.
    """

    rows: pd.DataFrame
    criteria: tuple[Criterion, ...] = ()
    controllers: tuple[str, ...] = ()
    heat_map: tuple[str, str] | None = None
    name: str = "campaign"
    folder: Path | None = None
    specification: Mapping[str, Any] = field(default_factory=dict[str, Any])
    asked: int | None = None

    def __post_init__(self) -> None:
        for column in NEEDED:
            if column not in self.rows.columns:
                raise ArgumentError("rows", f"a table without {column!r}", "the rows of a campaign")
        found = dict.fromkeys(texts(self.rows, "controller"))
        named = [name for name in self.controllers if name in found]
        object.__setattr__(self, "controllers", (*named, *(name for name in found if name not in named)))
        settings = [column.removeprefix(SETTING) for column in self.rows.columns if column.startswith(SETTING)]
        for name in self.heat_map or ():
            if name not in settings:
                raise UnknownNameError("report.heat_map", name, settings)

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """Names of settings that have more than one value, without seeds, in the order of the campaign's."""
        names = [column.removeprefix(SETTING) for column in self.rows.columns if column.startswith(SETTING)]
        asked = [name for name in self.specification.get("vary", {}) if name in names]
        return tuple(
            name
            for name in dict.fromkeys((*asked, *names))
            if not is_seed(name) and len(set(texts(self.rows, SETTING + name))) > 1
        )

    @cached_property
    def numeric(self) -> tuple[str, ...]:
        """Those of them that are numbers, in every run."""
        return tuple(name for name in self.varied if np.isfinite(self.setting(name)).all())

    @cached_property
    def _units(self) -> dict[str, str]:
        """Units of arguments of a base that comes with Rumo; one's own is not made again to ask it."""
        scenario = self.specification.get("scenario", {})
        if scenario.get("base") not in BASES:
            return {}
        return {name: each.unit for name, each in Recipe(scenario["base"]).arguments.items() if each.unit != "1"}

    def named(self, setting: str) -> str:
        """A setting with its unit, as far as it is known: "speed [m/s]"."""
        return f"{setting} [{self._units[setting]}]" if setting in self._units else setting

    def setting(self, name: str) -> Array:
        """Values of a setting (n,), NaN where it is no number."""
        return numbers(self.rows, SETTING + name)

    @cached_property
    def figures(self) -> tuple[str, ...]:
        """Columns with figures of merit of which something is known: those of criteria first, times of steps last, the
        others as in `rumo.studies.kpis.KPIS`."""
        judged = [column_of(each.kpi, self.rows.columns) for each in self.criteria]
        places = {key: place for place, key in enumerate(BY_KEY)}
        every = sorted(
            (column for column in self.rows.columns if column.startswith(KPI)),
            key=lambda column: places.get(key_of(column).partition(".")[0], len(places)),
        )
        times = [column for column in self.rows.columns if column.startswith(RUN) and kpi_of(column) is not None]
        return tuple(
            column
            for column in dict.fromkeys([*(column for column in judged if column), *every, *times])
            if np.isfinite(self.values(column)).any()
        )

    @cached_property
    def constant(self) -> tuple[str, ...]:
        """Those of them that are the same in all runs that know them: there is nothing to draw."""
        return tuple(column for column in self.figures if np.ptp(self._known(column)) == 0.0)

    def _known(self, column: str) -> Array:
        values = self.values(column)
        return values[np.isfinite(values)]

    @cached_property
    def _values(self) -> dict[str, Array]:
        return {}

    def values(self, column: str) -> Array:
        """A column as floats (n,), NaN where nothing is known."""
        if column not in self._values:
            self._values[column] = numbers(self.rows, column)
        return self._values[column]

    @cached_property
    def driver(self) -> NDArray[np.str_]:
        """The controller of each run (n,)."""
        return np.array(texts(self.rows, "controller"), dtype=str)

    def of(self, controller: str) -> NDArray[np.bool_]:
        """Which runs are a controller's (n,)."""
        return self.driver == controller

    @cached_property
    def passes(self) -> dict[str, NDArray[np.bool_]]:
        """Which runs pass (n,), by the criterion's name."""
        return {criterion.name: criterion.passed(self.rows) for criterion in self.criteria}

    @cached_property
    def passed(self) -> NDArray[np.bool_]:
        """Which runs pass all criteria (n,)."""
        return np.all([np.ones(len(self.rows), dtype=bool), *self.passes.values()], axis=0)

    @cached_property
    def leading(self) -> str | None:
        """The column by which runs are the worst: that of the first criterion, else the first there is."""
        return self.figures[0] if self.figures else None

    @cached_property
    def places(self) -> dict[str, NDArray[np.int_]]:
        """For each controller the rows of its draws (d,), -1 where it has not driven one; draws in ascending order."""
        draws, place = np.unique(self.values("draw"), return_inverse=True)
        found: dict[str, NDArray[np.int_]] = {}
        for name in self.controllers:
            found[name] = np.full(len(draws), -1)
            mine = np.flatnonzero(self.of(name))
            found[name][place[mine]] = mine
        return found

    def pairs(self, first: str, second: str) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
        """Rows of two controllers (m,) and (m,), of the draws that both have driven."""
        one, other = self.places[first], self.places[second]
        both = (one >= 0) & (other >= 0)
        return one[both], other[both]

    def log_of(self, key: str) -> Path | None:
        """The file with a run's log; None if it was not kept."""
        path = None if self.folder is None else self.folder / "logs" / f"{key}.nc"
        return path if path is not None and path.is_file() else None

    def worst(self, column: str, count: int) -> list[int]:
        """Rows of runs with the worst values of a figure, worst first: farthest beyond its limits, if it has some."""
        criterion = next((each for each in self.criteria if column_of(each.kpi, self.rows.columns) == column), None)
        values = self.values(column)
        if criterion is not None:
            values = criterion.excess(self.rows)
        elif better_of(column) == "more":
            values = -values
        known = np.flatnonzero(np.isfinite(values))
        # Ties in the order of their keys, so that the same rows in another order give the same page.
        keys = np.array(texts(self.rows, "key"), dtype=str)
        return known[np.lexsort((keys[known], -values[known]))][:count].tolist()
