"""What a tuning is: what may be chosen, for which drives, and what is wanted of them."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

from rumo.campaigns.searching.samplers import SEVERAL
from rumo.campaigns.searching.space import identity_of, options_of
from rumo.campaigns.searching.specification import Searched
from rumo.campaigns.searching.trial_storage import is_url
from rumo.campaigns.specification import Campaign
from rumo.campaigns.specification.asked import kpi_key
from rumo.campaigns.specification.sampling import SEED, Grid, as_varied
from rumo.campaigns.tuning.goals import Goal, Limit, Objective, goals_of
from rumo.campaigns.work import CONTROLLER
from rumo.checks import as_mapping
from rumo.errors import ArgumentError
from rumo.scenarios import Plain, Recipe
from rumo.scenarios.settings import settings_of


@dataclass(frozen=True)
class Check:
    """Drives that a tuning knows nothing of, by which it is judged.

    Parameters
    ----------
    vary : mapping of str to Grid, Distribution or sequence
        See `Campaign`.
    runs : int, optional
        See `Campaign`.
    settings : mapping of str to plain data
        Of all these drives: a longer `duration`.
    """

    vary: Mapping[str, Any]
    runs: int | None = None
    settings: Mapping[str, Plain] = field(default_factory=dict[str, Plain])


@dataclass(frozen=True)
class Tuning(Searched):
    """A search for better settings, before it is begun.

    Parameters
    ----------
    recipe, search, trials, controller, sampler, seed, batch, timeout
        See `rumo.campaigns.searching.specification.Searched`. What is tuned is driven as it is, too: limits are
        compared with that.
    over : mapping of str to Grid, Distribution or sequence
        The drives of each trial: what varies from one to the next, such as the seed.
    objectives : mapping of str to Objective or mapping
        What is wanted of them.
    limits : mapping of str to Limit or mapping
        What else has to hold.
    runs : int, optional
        Number of drives of each trial; if not given, the number of points of the grids in `over`.
    storage : str, optional
        Of the trials: the URL of a database, where several machines tune together; a journal file in the tuning's
        folder if not given.
    check : Check, optional
        By which drives the result is judged; not judged if not given.

    Raises
    ------
    ArgumentError
        If a value cannot work.
    """

    over: Mapping[str, Any]
    objectives: Mapping[str, Any]
    limits: Mapping[str, Any] = field(default_factory=dict[str, Any])
    runs: int | None = None
    storage: str | None = None
    check: Check | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.storage is not None and (not isinstance(self.storage, str) or not is_url(self.storage)):
            raise ArgumentError("storage", repr(self.storage), "the URL of a database: sqlite:///tune.db")
        search, over = self.search, as_mapping(self.over, "over")
        for name in over:
            if name in search:
                raise ArgumentError(f"over.{name}", "a setting that is searched for", "another one")
        if CONTROLLER in search or CONTROLLER in over:
            table = "search" if CONTROLLER in search else "over"
            raise ArgumentError(f"{table}.{CONTROLLER}", "something", "nothing: [tune] says which controller drives")
        objectives, limits = _goals(Objective, self.objectives, "objectives"), _goals(Limit, self.limits, "limits")
        if not objectives:
            raise ArgumentError("objectives", "nothing", "at least one")
        if len(objectives) > 1 and self.sampler not in SEVERAL:
            expected = f"one objective, or sampler {' or '.join(SEVERAL)}"
            raise ArgumentError("sampler", f"{self.sampler!r} with {len(objectives)} objectives", expected)
        own = {"over": over, "objectives": objectives, "limits": limits}
        for name, value in own.items():
            object.__setattr__(self, name, MappingProxyType(value))
        with named("over"):
            _ = self.drives
        if self.check is not None:
            if not isinstance(self.check, Check):
                raise ArgumentError("check", repr(self.check), "a rumo.campaigns.tuning.Check")
            self._require_apart(self.check)
            with named("check.vary", "check.runs"):
                _ = self.judged

    def _require_apart(self, check: Check) -> None:
        """Raise unless the check leaves alone what is searched for, and has seeds of its own."""
        for table, names in (("vary", check.vary), ("scenario", check.settings)):
            for name in names:
                if name in self.search:
                    raise ArgumentError(f"check.{table}.{name}", "a setting that is searched for", "another one")
        seeds = [as_varied(vary[SEED], SEED) for vary in (self.over, check.vary) if SEED in vary]
        grids = [set(each.values) for each in seeds if isinstance(each, Grid)]
        both = sorted(grids[0] & grids[1], key=repr) if len(grids) == 2 else []
        if both:
            raise ArgumentError(f"check.vary.{SEED}", f"{both[0]}, which trials drive too", "seeds that they do not")

    @cached_property
    def drives(self) -> Campaign:
        """Of one trial."""
        return Campaign(
            self.recipe,
            self.over,
            runs=self.runs,
            controllers=(self.controller,),
            kpis=tuple(each.kpi for each in (*self.objectives.values(), *self.limits.values())),
            timeout=self.timeout,
            seed=self.seed,
            logs="none",
        )

    @cached_property
    def judged(self) -> Campaign | None:
        """The drives by which the result is judged."""
        if self.check is None:
            return None
        recipe, seed = self.recipe.with_settings(self.check.settings), self.seed + 1  # other draws
        return replace(self.drives, recipe=recipe, vary=self.check.vary, runs=self.check.runs, seed=seed)

    @cached_property
    def begun_with(self) -> dict[str, Plain]:
        """What the recipe has of what may be chosen; without what it does not say."""
        return own_settings(self.recipe, self.controller, self.search)

    def allows(self, name: str, value: Any) -> bool:
        """Whether a setting may be chosen so."""
        choice = self.search[name]
        options = options_of(choice)
        if options is not None:
            return value in options
        return isinstance(value, int | float) and choice.low <= value <= choice.high

    def with_best(self, settings: Mapping[str, Plain]) -> Recipe:
        """The recipe with other settings, and with the controller of this tuning."""
        own = {CONTROLLER: self.controller}
        same = settings_of(self.recipe.run()).get(CONTROLLER) == self.controller
        return self.recipe.with_settings({**settings} if same else {**settings, **own})

    def drives_of(self, row: Mapping[str, Any]) -> tuple[Campaign, dict[str, Plain]]:
        """The drives that a row is one of, of trials or of the check, and what was chosen for it.

        Parameters
        ----------
        row : mapping
            Of a table, in which what was not chosen is None or NaN, and whole numbers may be floats.

        Raises
        ------
        ArgumentError
            If it is of none of them, as something has changed since.
        """
        chosen = self.chosen_in(row)
        every = [self.drives] if self.judged is None else [self.drives, self.judged]
        draw, key = int(row["draw"]), row["key"]
        for drives in every:
            if draw < len(drives.draws) and drives.task(draw, self.controller, chosen)["key"] == key:
                return drives, chosen
        cure = "The version of Rumo, files and the table [check] as they were repeat it."
        raise ArgumentError("key", f"{key}, of a run that is now another one", "one of which nothing has changed", cure)

    @property
    def plain(self) -> dict[str, Any]:
        """All of it as plain data, from which `rumo.campaigns.tuning.reading.tuning_of` makes it again."""
        return {
            "tune": {
                name: value
                for name, value in {**self.settings, "runs": self.runs, "storage": self.storage}.items()
                if value is not None
            },
            "scenario": self.recipe.plain,
            "search": {name: each.plain for name, each in self.search.items()},
            "over": {name: each.plain for name, each in self.drives.vary.items()},
            "objectives": {name: each.plain for name, each in self.objectives.items()},
            "limits": {name: each.plain for name, each in self.limits.items()},
            **_check(self.judged, self.check),
        }

    @property
    def identity(self) -> dict[str, Any]:
        """What decides what is proposed: all but how many trials there are, and by what the result is judged."""
        plain = self.plain
        settings = {name: value for name, value in plain["tune"].items() if name not in ("trials", "storage")}
        others = {name: value for name, value in plain.items() if name not in ("check", "scenario")}
        over = self.drives.identity["vary"]
        return {**others, "tune": settings, "over": over, **identity_of(self.recipe, self.search)}


def own_settings(recipe: Recipe, controller: str, names: Iterable[str]) -> dict[str, Plain]:
    """Those of some settings that a recipe has or that its base begins with, as a controller drives it."""
    known = {name: argument.default for name, argument in recipe.arguments.items() if not argument.needed}
    known |= settings_of(recipe.with_settings({CONTROLLER: controller}).run())
    known |= recipe.settings
    return {name: known[name] for name in names if known.get(name) is not None}


@contextmanager
def named(vary: str, runs: str = "runs") -> Generator[None]:
    """Errors of a campaign by the names that a tuning has for what varies, and for the number of runs."""
    try:
        yield
    except ArgumentError as error:
        head, dot, rest = error.argument.partition(".")
        head = {"vary": vary, "runs": runs}.get(head, head)
        raise ArgumentError(f"{head}{dot}{rest}", error.got, error.expected, error.cure) from None


def _goals(kind: type[Goal], given: Any, argument: str) -> dict[str, Any]:
    """Objectives or limits, by figures that there are."""
    given = as_mapping(given, argument)
    made = goals_of(kind, {name: each for name, each in given.items() if not isinstance(each, kind)}, argument)
    goals = {name: made.get(name, each) for name, each in given.items()}
    return {name: replace(each, kpi=kpi_key(each.kpi, f"{argument}.{name}.kpi")) for name, each in goals.items()}


def _check(judged: Campaign | None, check: Check | None) -> dict[str, Any]:
    if judged is None or check is None:
        return {}
    runs = {} if check.runs is None else {"runs": check.runs}
    vary = {name: each.plain for name, each in judged.vary.items()}
    return {"check": {**runs, "vary": vary, "scenario": dict(check.settings)}}
