"""What searches have in common before they are begun: what is driven, what may be chosen, and how it is looked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any, ClassVar

from rumo.campaigns.judging.columns import SETTING
from rumo.campaigns.judging.summary import plain
from rumo.campaigns.searching.samplers import SAMPLERS
from rumo.campaigns.searching.space import as_chosen, check_space
from rumo.campaigns.specification.files import with_files
from rumo.campaigns.specification.sampling import as_varied
from rumo.checks import as_mapping, checked, positive_number, whole_number
from rumo.errors import ArgumentError, UnknownNameError
from rumo.registry import CONTROLLERS
from rumo.scenarios import Plain, Recipe


@dataclass(frozen=True)
class Searched:
    """What a tuning and a falsification have in common.

    Parameters
    ----------
    recipe : Recipe
        What is driven, as it is without what is searched for.
    search : mapping of str to Distribution, Grid or sequence
        What may be chosen: uniform, log-uniform, integers, or one of a list.
    trials : int
        How many.
    controller : str
        Name in `rumo.registry.CONTROLLERS`.
    sampler : str
        One of `rumo.campaigns.searching.samplers.SAMPLERS` that can do it.
    seed : int
        Of what is drawn.
    batch : int
        Trials that are proposed at the same time; their drives can be carried out at the same time. It decides what
        is proposed, so that a search gives the same on every machine.
    timeout : float
        That a drive may take [s].

    Raises
    ------
    ArgumentError
        If a value cannot work.
    """

    PROPOSED_BY: ClassVar[tuple[str, ...]] = SAMPLERS
    """Samplers that can do it."""

    recipe: Recipe
    search: Mapping[str, Any]
    trials: int = field(default=100, kw_only=True)
    controller: str = field(default="rti", kw_only=True)
    sampler: str = field(default="tpe", kw_only=True)
    seed: int = field(default=0, kw_only=True)
    batch: int = field(default=8, kw_only=True)
    timeout: float = field(default=600.0, kw_only=True)

    def __post_init__(self) -> None:
        checked(self.recipe, "recipe", Recipe)
        for name in ("trials", "batch"):
            whole_number(getattr(self, name), name, 1)
        whole_number(self.seed, "seed", 0)
        positive_number(self.timeout, "timeout")
        for name, known in (("controller", CONTROLLERS), ("sampler", self.PROPOSED_BY)):
            if getattr(self, name) not in known:
                raise UnknownNameError(name, getattr(self, name), known)
        search = {name: as_varied(value, f"search.{name}") for name, value in as_mapping(self.search, "search").items()}
        if not search:
            raise ArgumentError("search", "nothing", "at least one setting that may be chosen")
        check_space(search, self.sampler)
        object.__setattr__(self, "search", MappingProxyType(with_files(search, self.recipe)))

    @property
    def settings(self) -> dict[str, Any]:
        """How it is looked for, by the names that a file has for it."""
        return {name: getattr(self, name) for name in SETTINGS}

    def chosen_in(self, row: Mapping[str, Any]) -> dict[str, Plain]:
        """What was chosen for a drive, by its row of a table, in which what was not chosen is None or NaN."""
        said = {name: plain(row.get(SETTING + name)) for name in self.search}
        return {name: as_chosen(self.search[name], value) for name, value in said.items() if value is not None}


SETTINGS = tuple(each.name for each in fields(Searched) if each.kw_only)
"""What says how it is looked for."""
