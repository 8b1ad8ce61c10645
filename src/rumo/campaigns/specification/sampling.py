"""Draws of a campaign: which values its settings have, from a seed, the same whenever they are asked for."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from inspect import signature
from math import prod
from typing import Any

import numpy as np

from rumo.campaigns.specification.distributions import Distribution
from rumo.checks import finite_number
from rumo.errors import ArgumentError, UnknownNameError
from rumo.scenarios.arguments import Plain
from rumo.signals import Array

SAMPLINGS = ("sobol", "latin-hypercube", "random")
"""How points are spread: by Sobol's sequence, of which more runs are a continuation, in a Latin hypercube, or at
random."""
SEED = "seed"
"""The setting by which all that happens by chance in a drive is chosen."""
MOST_IN_GRID = 10_000_000


@dataclass(frozen=True)
class Grid:
    """Values of a setting, each of which is driven.

    Parameters
    ----------
    values : sequence of plain data
        In the order in which they are driven.
    """

    values: Sequence[Plain]

    def __post_init__(self) -> None:
        if isinstance(self.values, str) or not len(self.values):
            raise ArgumentError("values", repr(self.values), "at least one value")

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Grid:
        """A grid from `{"from": 0, "to": 49}`, both of them in it, and perhaps `step`."""
        for key, value in table.items():
            if key not in ("from", "to", "step"):
                raise UnknownNameError(key, key, ("from", "to", "step"))
            finite_number(value, key)
        for key in ("from", "to"):
            if key not in table:
                raise ArgumentError(key, "nothing", "a number")
        first, last, step = table["from"], table["to"], table.get("step", 1)
        if not step > 0:
            raise ArgumentError("step", repr(step), "a positive number")
        if last < first:
            raise ArgumentError("to", repr(last), f"a number of at least from = {first}")
        # A whole number of steps up to rounding: 0.1 to 0.5 by 0.1 has 0.5.
        count = int(np.floor((last - first) / step * (1.0 + 1e-12) + 1e-9)) + 1
        if count > MOST_IN_GRID:
            raise ArgumentError("step", repr(step), f"at most {MOST_IN_GRID} values: these are {count}")
        if all(isinstance(number, int) for number in (first, last, step)):
            return cls(range(first, last + 1, step))
        return cls([first + step * i for i in range(count)])

    @property
    def plain(self) -> Plain:
        """As plain data."""
        values = self.values
        if isinstance(values, range):
            return {"from": values.start, "to": values[-1], "step": values.step}
        return list(values)

    @property
    def ends(self) -> tuple[Plain, ...]:
        """The extreme values of numbers; all, of what are none."""
        numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.values)
        return (min(self.values), max(self.values)) if numbers else tuple(self.values)  # pyright: ignore[reportArgumentType, reportReturnType, reportCallIssue]


def as_varied(value: Any, argument: str) -> Grid | Distribution:
    """What varies, from a grid, a distribution or a sequence of values; others raise, naming `argument`."""
    if isinstance(value, Grid | Distribution):
        return value
    if isinstance(value, str | Mapping) or not isinstance(value, Collection) or not len(value):
        raise ArgumentError(argument, repr(value), "a list of values, a range or a distribution")
    return Grid(value if isinstance(value, range) else list(value))  # pyright: ignore[reportUnknownArgumentType]


@dataclass(frozen=True)
class Draws:
    """Values of what varies, draw by draw.

    The points of all grids' product are taken in turn, the last grid's values fastest, and again from the first one
    when there are more draws. Each time, all of them get the same values of what has a distribution: low bits of an
    index decide high digits of a Sobol point, so that points taken in turn would each see a part of it only.

    Parameters
    ----------
    vary : mapping of str to Grid or Distribution
        By setting.
    runs : int
        How many draws there are.
    sampling : str
        One of `SAMPLINGS`.
    seed : int
        Of the spread: the same seed gives the same draws.
    """

    vary: Mapping[str, Grid | Distribution]
    runs: int
    sampling: str = "sobol"
    seed: int = 0

    @property
    def points(self) -> int:
        """Number of points of the grids' product."""
        return prod(len(grid.values) for grid in self.grids.values())

    @cached_property
    def grids(self) -> dict[str, Grid]:
        """What varies by a grid."""
        return {name: each for name, each in self.vary.items() if isinstance(each, Grid)}

    @cached_property
    def distributions(self) -> dict[str, Distribution]:
        """What varies by chance."""
        return {name: each for name, each in self.vary.items() if isinstance(each, Distribution)}

    @cached_property
    def _shares(self) -> Array:
        """Points in the unit cube (turns, distributions), one for each time that all points of the grids are driven."""
        count, turns = len(self.distributions), -(-self.runs // self.points)
        rng = np.random.default_rng(self.seed)
        if not count:
            return np.empty((turns, 0))
        if self.sampling == "random":
            return rng.random((turns, count))
        from scipy.stats import qmc  # takes longer to import than all the rest

        if self.sampling == "sobol":
            power = int(np.ceil(np.log2(max(turns, 2))))  # Sobol's points are even in powers of two
            points = _seeded(qmc.Sobol, count, rng).random_base2(power)[:turns]
        else:
            points = _seeded(qmc.LatinHypercube, count, rng).random(turns)
        # Of distributions without ends, 0 would be infinitely far out.
        return np.clip(points, 0.5**53, 1.0 - 0.5**53)

    @cached_property
    def _values(self) -> dict[str, Sequence[Plain]]:
        columns = self._shares.T
        return {name: each.values(columns[i]) for i, (name, each) in enumerate(self.distributions.items())}

    def __len__(self) -> int:
        return self.runs

    def __getitem__(self, draw: int) -> dict[str, Plain]:
        """Settings of a draw, counted from 0, in the order in which they were given."""
        if not 0 <= draw < self.runs:
            raise IndexError(draw)
        turn, place = divmod(draw, self.points)
        found: dict[str, Plain] = {name: values[turn] for name, values in self._values.items()}
        for name, grid in reversed(self.grids.items()):
            place, i = divmod(place, len(grid.values))
            found[name] = grid.values[i]
        return {name: found[name] for name in self.vary}

    def extremes(self, name: str) -> tuple[Plain, ...]:
        """The extreme values that a setting can have, and those that it has in these draws."""
        ends = self.vary[name].ends
        drawn = self._values.get(name)
        if drawn is None or len(ends) == 2 or not all(isinstance(value, int | float) for value in drawn):
            return ends
        return tuple(dict.fromkeys((*ends, min(drawn), max(drawn))))  # pyright: ignore[reportArgumentType, reportCallIssue]


def _seeded(kind: Any, count: int, rng: np.random.Generator) -> Any:
    """A sampler of SciPy's, whose argument for chance has been called `rng` since 1.15."""
    name = "rng" if "rng" in signature(kind).parameters else "seed"
    return kind(count, **{name: rng})
