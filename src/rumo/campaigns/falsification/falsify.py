"""A falsification from its first trial to the smallest disturbance that it found."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import Any

from rumo.campaigns.falsification.shrinking import Found, shrunk
from rumo.campaigns.falsification.specification import Falsification
from rumo.campaigns.searching.rounds import Rounds
from rumo.campaigns.searching.search import Search
from rumo.campaigns.standing import Searching
from rumo.campaigns.store.room import writing_to
from rumo.campaigns.store.store import LOGS, Store
from rumo.campaigns.tasks.task import Engine, Row
from rumo.campaigns.work import CONTROLLER, WORK
from rumo.errors import CampaignError
from rumo.scenarios import Plain, Recipe

FOUND = "found.toml"
"""The file with the scenario of the smallest disturbance."""


@dataclass(frozen=True)
class Tried:
    """A disturbance, and what came of it.

    Attributes
    ----------
    settings : mapping of str to plain data
        What it is.
    size : float
        How large.
    violated : tuple of str, optional
        Names of the criteria; None if its drive does not say, as its process ended.
    row : dict
        Of its drive.
    """

    settings: Mapping[str, Plain]
    size: float
    violated: tuple[str, ...] | None
    row: Row


@dataclass(frozen=True)
class Falsified:
    """What came of a falsification.

    Attributes
    ----------
    falsification : Falsification
        What it was.
    folder : Path
        Of its rows, and of logs.
    undisturbed : dict
        Row of the drive without a disturbance.
    trials : tuple of Tried
        All that are done, in the order in which they were proposed.
    found : Found, optional
        The smallest; None if nothing that was tried violates anything, or the search is not over.
    stopped : CampaignError or KeyboardInterrupt, optional
        What ended it early. What was done is kept, and started again it goes on.
    """

    falsification: Falsification
    folder: Path
    undisturbed: Row
    trials: tuple[Tried, ...]
    found: Found | None = None
    stopped: CampaignError | KeyboardInterrupt | None = None

    @property
    def recipe(self) -> Recipe | None:
        """The recipe with the disturbance that was found, who drives and the seed; None if nothing was."""
        if self.found is None:
            return None
        drives, settings = self.falsification.drives, self.found.settings
        driver = {CONTROLLER: self.falsification.controller}
        return self.falsification.recipe.with_settings({**driver, **drives.settings(0), **settings})

    def log_of(self, key: str) -> Path | None:
        """The file with the log of a drive, by its key; None if it was not kept."""
        path = self.folder / LOGS / f"{key}.nc"
        return path if path.is_file() else None


def carry_out_falsification(
    falsification: Falsification,
    engine: Engine,
    store: Store,
    tell: Callable[[Searching], object] | None = None,
) -> Falsified:
    """Try disturbances, then look for the smallest of the kind of the smallest that violates something.

    What is tried depends on what came of those before, and the search is gone through again from its beginning whenever
    it is started: what is stored is not driven again. So one that was stopped, however, ends as one that was not.

    Parameters
    ----------
    falsification : Falsification
        What to look for.
    engine : Engine
        Where drives are carried out.
    store : Store
        Of their rows, and of the log of what was found; `found.toml` is written to its folder.
    tell : callable, optional
        Called with a `Searching` at the beginning and after each batch.

    Raises
    ------
    CampaignError
        If the drive without disturbance violates something, or there is none.
    """
    rounds, begun = Rounds(falsification.drives, engine, store), monotonic()
    trials: list[Tried] = []
    undisturbed, found, stopped = dict[str, Any](), None, None

    def told() -> None:
        if tell is not None:
            violating = [trial.size for trial in trials if trial.violated]
            words = f"size {min(violating):.3g}" if violating else ""
            tell(Searching(falsification.trials, 0, len(trials), 0, monotonic() - begun, words))

    try:
        told()
        for without in _tries(falsification, rounds, trials):
            undisturbed = without
            told()
        found = _smallest(falsification, rounds, trials)
        if found is not None:
            for settings in (found.settings, falsification.smaller(found.settings, 0.0)):
                _keep_log(falsification, settings, engine, store)
        store.compact()
    except (CampaignError, KeyboardInterrupt) as error:
        if not undisturbed:
            raise
        stopped = error
    falsified = Falsified(falsification, store.folder, undisturbed, tuple(trials), found, stopped)
    if falsified.recipe is not None:
        try:
            with writing_to(store.folder):
                falsified.recipe.to_toml(store.folder / FOUND)
        except CampaignError as error:
            falsified = replace(falsified, stopped=stopped or error)
    return falsified


def _smallest(what: Falsification, rounds: Rounds, trials: list[Tried]) -> Found | None:
    """The smallest trial that violates something, made smaller still."""
    violating = [trial for trial in trials if trial.violated]
    if not violating:
        return None
    smallest = min(violating, key=lambda trial: trial.size)
    return shrunk(what, lambda settings: _rows(rounds, [settings])[0], smallest.settings)


def _tries(what: Falsification, rounds: Rounds, trials: list[Tried]) -> Any:
    """Try disturbances, batch by batch; after each, the row of the drive without one."""
    search = Search(what.search, [False], storage=None, folder="", specified="", sampler=what.sampler, seed=what.seed)
    undisturbed: Row | None = None
    while len(trials) < what.trials:
        proposals = search.ask(min(what.batch, what.trials - len(trials)))
        wanted = [proposal.settings for proposal in proposals]
        if undisturbed is None:
            undisturbed = _rows(rounds, [what.smaller(wanted[0], 0.0)])[0]
            _require_held(what, undisturbed)
        for proposal, row in zip(proposals, _rows(rounds, wanted), strict=True):
            worth = what.worth(proposal.settings, row, undisturbed)
            search.tell(proposal.number, None if worth is None else [worth])
            trials.append(Tried(proposal.settings, what.size_of(proposal.settings), what.violated(row), row))
        yield undisturbed


def _rows(rounds: Rounds, settings: list[Mapping[str, Plain]]) -> list[Row]:
    return [rows[0] for rows in rounds.drive(settings)]


def _require_held(what: Falsification, row: Row) -> None:
    violated = what.violated(row)
    if row["outcome"] != "done":
        raise CampaignError(
            f"The drive without a disturbance did not come to its end. {row['outcome']}: {row['error']}"
        )
    if violated:
        why = ", ".join(f"{name}: {what.criteria[name].why(row)}" for name in violated)
        raise CampaignError(f"The drive without a disturbance violates something already. {why}")


def _keep_log(what: Falsification, settings: Mapping[str, Plain], engine: Engine, store: Store) -> None:
    """Drive once more to keep the log, if it is not there."""
    task: Any = {**what.drives.task(0, what.controller, settings), "log": True}
    if (store.folder / LOGS / f"{task['key']}.nc").is_file():
        return
    with closing(engine.rows(WORK, what.drives.common, [task])) as rows:
        for row in rows:
            if row.get("log") is not None:
                store.keep_log(row["key"], row["log"])
