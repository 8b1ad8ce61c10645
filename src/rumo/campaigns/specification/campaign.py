"""What a campaign is: a recipe, what varies about it, who drives, and what is asked of the drives."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rumo.campaigns.specification.asked import as_criterion, as_report, kpi_name
from rumo.campaigns.specification.distributions import Distribution
from rumo.campaigns.specification.files import plain_by_content, with_files
from rumo.campaigns.specification.keys import Keys
from rumo.campaigns.specification.reading import campaign_arguments, errors_of
from rumo.campaigns.specification.rehearsal import rehearse
from rumo.campaigns.specification.sampling import SAMPLINGS, SEED, Draws, as_varied
from rumo.campaigns.work import CONTROLLER, LOGS
from rumo.checks import as_mapping, checked, known_names, positive_number, whole_number
from rumo.errors import ArgumentError, UnknownNameError
from rumo.registry import CONTROLLERS
from rumo.scenarios import Plain, Recipe
from rumo.scenarios.files import read_tables
from rumo.scenarios.parts import parts_of
from rumo.studies.kpis import KPIS

MOST_RUNS = 10_000_000
APART = 1_000_000
"""Seeds of drives in two campaigns are so far apart as their seeds, times this."""


ADJUSTABLE = ("timeout", "logs")
"""Keys of the table `[campaign]` that may change from one start to the next."""


@dataclass(frozen=True)
class Campaign:
    """A thousand drives, say, before they are driven.

    Parameters
    ----------
    recipe : Recipe
        What they have in common.
    vary : mapping of str to Grid, Distribution or sequence
        Settings that differ from draw to draw, by their names in the recipe. A sequence is a grid.
    runs : int, optional
        Number of draws, each of which every controller drives. If not given, the number of the grids' points. There
        cannot be fewer than these: each point is driven at least once.
    controllers : sequence of str
        Names in `rumo.registry.CONTROLLERS`; all drive the same draws.
    sampling : str
        How distributions are spread: one of `rumo.campaigns.specification.sampling.SAMPLINGS`.
    seed : int
        Of draws and drives. Where the recipe has no seed and none varies, draw i is driven with the seed
        1 000 000 `seed` + i.
    timeout : float
        That a run may take [s].
    kpis : sequence of str, optional
        Names in `rumo.studies.kpis.KPIS`; all if not given. Those of criteria are there anyway.
    criteria : mapping of str to Criterion or mapping
        What a drive has to meet, by name.
    logs : str
        Of which runs the log is kept at once, one of `rumo.campaigns.work.LOGS`.
    report : mapping of str to plain data
        What is shown: `heat_map`, two of the settings that vary.

    Raises
    ------
    ArgumentError
        If a value cannot work. Whether all drives can begin is found out by `rehearse`.
    """

    recipe: Recipe
    vary: Mapping[str, Any] = field(default_factory=dict[str, Any])
    runs: int | None = None
    controllers: tuple[str, ...] = ("rti",)
    sampling: str = "sobol"
    seed: int = 0
    timeout: float = 600.0
    kpis: tuple[str, ...] | None = None
    criteria: Mapping[str, Any] = field(default_factory=dict[str, Any])
    logs: str = "failed"
    report: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def __post_init__(self) -> None:
        checked(self.recipe, "recipe", Recipe)
        known_names(self.controllers, "controllers", CONTROLLERS)
        if len({*self.controllers}) < len(self.controllers):
            raise ArgumentError("controllers", repr(list(self.controllers)), "each of them once")
        for argument, value, known in (("sampling", self.sampling, SAMPLINGS), ("logs", self.logs, LOGS)):
            if value not in known:
                raise UnknownNameError(argument, value, known)
        whole_number(self.seed, "seed", 0)
        positive_number(self.timeout, "timeout")
        vary = {name: as_varied(value, f"vary.{name}") for name, value in as_mapping(self.vary, "vary").items()}
        for table, names in (("vary", vary), ("scenario", self.recipe.settings)):
            if CONTROLLER in names:
                raise ArgumentError(f"{table}.{CONTROLLER}", "something", "nothing: controllers says which drive")
        kpis = tuple(KPIS) if self.kpis is None else tuple(kpi_name(name, "kpis") for name in self.kpis)
        criteria = {name: as_criterion(name, value) for name, value in as_mapping(self.criteria, "criteria").items()}
        of_criteria = (kpi_name(each.kpi, f"criteria.{each.name}.kpi") for each in criteria.values())
        own: dict[str, Any] = {
            "recipe": self.recipe.with_settings(self.recipe.located(self.recipe.settings)),
            "vary": MappingProxyType(with_files(vary, self.recipe)),
            "controllers": tuple(self.controllers),
            "kpis": tuple(dict.fromkeys((*kpis, *of_criteria))),
            "criteria": MappingProxyType(criteria),
            "report": MappingProxyType(as_report(self.report, vary)),
        }
        for name, value in own.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "runs", self._checked_runs())

    @classmethod
    def from_toml(cls, path: str | Path) -> Campaign:
        """A campaign from a file, all of whose drives can begin.

        Parameters
        ----------
        path : str or Path
            Of a TOML file with tables `[campaign]`, `[scenario]`, `[vary]`, `[criteria]` and `[report]`.

        Raises
        ------
        ArgumentError
            If anything in it cannot work; the message names file, line and key, what is there and what could be.
        """
        with errors_of(path):
            campaign = cls.of(read_tables(path), Path(path).parent)
            campaign.rehearse()
            return campaign

    @classmethod
    def of(cls, tables: Mapping[str, Any], folder: Path = Path()) -> Campaign:
        """A campaign from plain data, as a file has it; names of files in it are relative to a folder."""
        return cls(**campaign_arguments(tables, folder))

    def rehearse(self) -> None:
        """Begin drives at the extremes of all that varies; see `rumo.campaigns.specification.rehearsal`."""
        rehearse(self)

    def _checked_runs(self) -> int:
        points = Draws(self.vary, 1).points
        if self.runs is None:
            if any(isinstance(each, Distribution) for each in self.vary.values()):
                raise ArgumentError("runs", "nothing", "a number of draws, since something varies by chance")
            return points
        runs = whole_number(self.runs, "runs", 1, most=MOST_RUNS)
        if runs < points:
            raise ArgumentError(
                "runs",
                str(runs),
                f"at least {points}, one for each point of the grids",
                'Leave values out, or let some vary by chance: { distribution = "choice", among = [...] }.',
            )
        by_chance = any(isinstance(each, Distribution) for each in self.vary.values())
        if runs > points and not by_chance and self._has_seed:
            raise ArgumentError("runs", str(runs), f"{points}, one for each point of the grids: more would be the same")
        return runs

    @property
    def _has_seed(self) -> bool:
        return SEED in self.vary or SEED in self.recipe.settings

    @cached_property
    def draws(self) -> Draws:
        """What varies, draw by draw."""
        return Draws(self.vary, self.runs or 1, self.sampling, self.seed)

    @cached_property
    def _seeded(self) -> bool:
        """Whether each draw has a seed of its own."""
        if self._has_seed:
            return False
        first = self.recipe.with_settings({**self.draws[0], CONTROLLER: self.controllers[0]})
        return SEED in first.arguments or SEED in (parts_of(first.run()) or ())

    def settings(self, draw: int) -> dict[str, Plain]:
        """Settings of a draw, on top of the recipe's."""
        own = {SEED: APART * self.seed + draw} if self._seeded else {}
        return self.draws[draw] | own

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of the settings of draws."""
        return (*self.vary, *((SEED,) if self._seeded else ()))

    @cached_property
    def common(self) -> dict[str, Any]:
        """What all tasks have in common, plain data: what `rumo.campaigns.work.run` is called with."""
        return {
            "recipe": self.recipe.plain,
            "identity": self.recipe.identity,
            "first": self.settings(0),
            "controllers": list(self.controllers),
            "kpis": list(self.kpis or ()),
            "criteria": {name: each.plain for name, each in self.criteria.items()},
            "timeout": self.timeout,
            "logs": self.logs,
        }

    @property
    def tasks(self) -> Tasks:
        """All runs, draw by draw, each with every controller."""
        return Tasks(self)

    def find(self, key: str) -> dict[str, Any]:
        """The task of a key, or of what only one key begins with.

        Raises
        ------
        ArgumentError
            If there is none, or there are several.
        """
        found = [task for task in self.tasks if task["key"].startswith(key)] if key else []
        if len(found) != 1:
            got = f"{key!r}, the beginning of {len(found)} of {len(self.tasks)} keys"
            raise ArgumentError("key", got, "the key of a run of this campaign")
        return found[0]

    @property
    def plain(self) -> dict[str, Any]:
        """All of it as plain data, from which `of` makes it again."""
        return {
            "campaign": {
                "runs": self.runs,
                "controllers": list(self.controllers),
                "sampling": self.sampling,
                "seed": self.seed,
                "timeout": self.timeout,
                "kpis": list(self.kpis or ()),
                "logs": self.logs,
            },
            "scenario": self.recipe.plain,
            "vary": {name: each.plain for name, each in self.vary.items()},
            "criteria": self.common["criteria"],
            "report": dict(self.report),
        }

    @property
    def identity(self) -> dict[str, Any]:
        """What of it may not change from one start to the next: the others add runs, or judge them otherwise.

        Draws in a Latin hypercube are all others if there are more of them.
        """
        plain = self.plain
        free = () if self.sampling == "latin-hypercube" else ("runs",)
        settings = {name: value for name, value in plain["campaign"].items() if name not in (*ADJUSTABLE, *free)}
        vary = plain_by_content(self.vary, self.recipe, self._keys.digests)
        return {"campaign": settings, "scenario": self.recipe.identity, "vary": vary}

    @cached_property
    def _keys(self) -> Keys:
        return Keys(self.recipe, self.kpis or ())

    def task(self, draw: int, controller: str, further: Mapping[str, Plain] | None = None) -> dict[str, Any]:
        """A run, perhaps with further settings: its key is the hash of all that decides its row."""
        return self._keys.task(draw, controller, {**(further or {}), **self.settings(draw)})


class Tasks(Collection[Any]):
    """The tasks of a campaign, made when they are asked for.

    Parameters
    ----------
    campaign : Campaign
        Whose tasks.
    """

    def __init__(self, campaign: Campaign) -> None:
        self._campaign = campaign

    def __len__(self) -> int:
        return len(self._campaign.draws) * len(self._campaign.controllers)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        campaign = self._campaign
        for draw in range(len(campaign.draws)):
            for controller in campaign.controllers:
                yield campaign.task(draw, controller)

    def __contains__(self, task: object) -> bool:
        return any(task == each for each in self)
