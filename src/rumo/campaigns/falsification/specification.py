"""What a falsification is: what may get in the way, how its size is measured, and what it is to violate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import hypot
from types import MappingProxyType
from typing import Any, ClassVar

from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.searching.samplers import SAMPLERS
from rumo.campaigns.searching.space import as_chosen, identity_of, options_of
from rumo.campaigns.searching.specification import Searched
from rumo.campaigns.specification import Campaign
from rumo.campaigns.specification.distributions import Integers, LogUniform, Uniform
from rumo.campaigns.tasks.rows import DONE, RAISED
from rumo.campaigns.tasks.task import Row
from rumo.checks import as_mapping, finite_number
from rumo.errors import ArgumentError, UnknownNameError
from rumo.scenarios import Plain

LARGER = 1e-3
"""What size counts among disturbances that violate nothing, beside how far they are on the way to a limit."""


@dataclass(frozen=True)
class Falsification(Searched):
    """A search for the smallest disturbance that violates a criterion, before it is begun.

    Parameters
    ----------
    recipe, search, trials, controller, sampler, seed, batch, timeout
        See `rumo.campaigns.searching.specification.Searched`. What may be chosen is how large a gust is, when it comes.
    size : mapping of str to float
        Of these, what is to be small: the value of each at which there is no disturbance. The size of a disturbance
        is the root of the sum of squares of how far each is from there, over how far it can be: from 0 to 1 for one.
    criteria : mapping of str to Criterion or mapping
        What a drive has to meet. A drive that ends with an exception meets none.

    Raises
    ------
    ArgumentError
        If a value cannot work.
    """

    PROPOSED_BY: ClassVar[tuple[str, ...]] = tuple(name for name in SAMPLERS if name != "nsga2")
    """All but what is for several objectives."""

    size: Mapping[str, float]
    criteria: Mapping[str, Any]
    trials: int = field(default=200, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        search, size = self.search, as_mapping(self.size, "size")
        if not size:
            raise ArgumentError("size", "nothing", "at least one setting of search, and where there is no disturbance")
        for name, value in size.items():
            if name not in search:
                raise UnknownNameError(f"size.{name}", name, search)
            finite_number(value, f"size.{name}")
            if options_of(search[name]) is not None:
                raise ArgumentError(f"size.{name}", "a setting that is one of a list", "one between two ends")
            if isinstance(search[name], LogUniform):
                raise ArgumentError(f"size.{name}", "a log-uniform setting", "a uniform one: its size is a distance")
            low, high = (float(end) for end in search[name].ends)  # pyright: ignore[reportArgumentType]
            if not low <= value <= high or low == high:
                expected = f"where there is no disturbance, between the ends of search.{name}: from {low:g} to {high:g}"
                raise ArgumentError(f"size.{name}", repr(value), expected)
            if isinstance(search[name], Integers) and value != int(value):
                raise ArgumentError(f"size.{name}", repr(value), "a whole number, as all that may be chosen")
        own = {name: float(value) for name, value in size.items()}
        object.__setattr__(self, "size", MappingProxyType(own))
        object.__setattr__(self, "criteria", self.drives.criteria)
        if not self.criteria:
            raise ArgumentError("criteria", "nothing", "at least one: what is to be violated")

    @cached_property
    def drives(self) -> Campaign:
        """Of one trial: one drive."""
        return Campaign(
            self.recipe,
            controllers=(self.controller,),
            kpis=(),
            criteria=self.criteria,
            timeout=self.timeout,
            seed=self.seed,
            logs="none",
        )

    @property
    def plain(self) -> dict[str, Any]:
        """All of it as plain data, from which `rumo.campaigns.falsification.reading.falsification_of` makes it."""
        return {
            "falsify": self.settings,
            "scenario": self.recipe.plain,
            "search": {name: each.plain for name, each in self.search.items()},
            "size": dict(self.size),
            "criteria": {name: each.plain for name, each in self.criteria.items()},
        }

    @property
    def identity(self) -> dict[str, Any]:
        """What decides what is proposed: all but how many trials there are."""
        plain = self.plain
        settings = {name: value for name, value in plain["falsify"].items() if name != "trials"}
        return {**plain, "falsify": settings, **identity_of(self.recipe, self.search)}

    def size_of(self, settings: Mapping[str, Plain]) -> float:
        """Size of a disturbance."""
        values: Mapping[str, Any] = settings
        return hypot(*(self._share(name, float(values[name])) for name in self.size))

    def smaller(self, settings: Mapping[str, Plain], share: float) -> dict[str, Plain]:
        """A disturbance whose sized settings are as much nearer to nothing: 1 leaves it, 0 takes it away."""
        found = dict(settings)
        for name, nothing in self.size.items():
            value = nothing + share * (float(settings[name]) - nothing)  # pyright: ignore[reportArgumentType]
            found[name] = as_chosen(self.search[name], value)
        return found

    def _share(self, name: str, value: float) -> float:
        choice: Uniform | Integers = self.search[name]
        nothing = self.size[name]
        return abs(value - nothing) / max(abs(end - nothing) for end in choice.ends)

    def violated(self, row: Row) -> tuple[str, ...] | None:
        """Names of the criteria that a drive violates; None if it does not say, as its process ended."""
        if row["outcome"] == RAISED:
            return tuple(self.criteria)
        if row["outcome"] != DONE:
            return None
        return tuple(name for name, criterion in self.criteria.items() if criterion.why(row))

    def worth(self, settings: Mapping[str, Plain], row: Row, undisturbed: Row) -> float | None:
        """What the search makes small: the size of a disturbance that violates something; more for others.

        Of those, the farther on the way from where the drive without disturbance is to a limit, the better; of those
        that are as far, the larger ones: where nothing is felt of small disturbances, a search has to leave these.
        """
        violated = self.violated(row)
        if violated is None:
            return None
        if violated:
            return self.size_of(settings)
        largest = len(self.size) ** 0.5
        return largest + 1.0 - self.way(row, undisturbed) + LARGER * (largest - self.size_of(settings))

    def way(self, row: Row, undisturbed: Row) -> float:
        """How far a drive that meets all criteria is from the one without disturbance on the way to a limit, 1."""
        return max(_way(criterion, row, undisturbed) for criterion in self.criteria.values())


def _way(criterion: Criterion, row: Row, undisturbed: Row) -> float:
    """How far a drive that meets a criterion is on the way from another one to the nearer limit: 1 is there."""
    value, before = criterion.value(row), criterion.value(undisturbed)
    if value is None or before is None:
        return 0.0
    # A drive without disturbance that is at the limit already says nothing about how near another one is.
    return max(((value - before) / (limit - before) if limit != before else 0.0) for limit in criterion.limits)
