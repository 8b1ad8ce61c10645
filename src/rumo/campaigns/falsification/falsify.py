"""A falsification from its first trial to the smallest disturbance that it found."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rumo.campaigns.falsification.specification import Falsification
from rumo.campaigns.rounds import Rounds
from rumo.campaigns.search import Search, Trial
from rumo.campaigns.specification import canonical
from rumo.campaigns.store import Store
from rumo.campaigns.task import Engine, Row
from rumo.errors import CampaignError
from rumo.scenarios import Plain, Recipe

JOURNAL, FOUND = "trials.journal", "found.toml"
HALVINGS = 10
"""Of the way from nothing to what was found, to see from where on a disturbance violates."""


@dataclass(frozen=True)
class Found:
    """A disturbance that violates something.

    Attributes
    ----------
    settings : mapping of str to plain data
        What it is.
    size : float
        How large.
    violated : tuple of str
        Names of the criteria.
    row : dict
        Of its drive.
    holds_at : float
        The largest size on the way from nothing to it that was driven and violates nothing.
    """

    settings: Mapping[str, Plain]
    size: float
    violated: tuple[str, ...]
    row: Row
    holds_at: float


@dataclass(frozen=True)
class Falsified:
    """What came of a falsification.

    Attributes
    ----------
    falsification : Falsification
        What it was.
    undisturbed : dict
        Row of the drive without a disturbance.
    trials : list of Trial
        All that are done, by number.
    sizes : mapping of int to float
        Of the trials that violate something, by number.
    found : Found, optional
        The smallest; None if nothing that was tried violates anything.
    """

    falsification: Falsification
    undisturbed: Row
    trials: list[Trial]
    sizes: Mapping[int, float]
    found: Found | None

    @property
    def recipe(self) -> Recipe | None:
        """The recipe with the disturbance that was found."""
        return None if self.found is None else self.falsification.recipe.with_settings(self.found.settings)


def carry_out_falsification(
    falsification: Falsification,
    folder: Path,
    engine: Engine,
    tell: Callable[[int, int, Trial | None], object] | None = None,
) -> Falsified:
    """Drive all trials that are not done, then halve the way to the smallest disturbance that violates something.

    Parameters
    ----------
    falsification : Falsification
        What to look for.
    folder : Path
        Of rows, trials, and `found.toml`.
    engine : Engine
        Where drives are carried out.
    tell : callable, optional
        Called with (trials done, all trials, the best so far) at the beginning and after each batch.

    Raises
    ------
    ArgumentError
        If the folder has another falsification.
    CampaignError
        If no more can be carried out, or stored; if a drive without disturbance violates something.
    """
    identity = falsification.identity
    with Store(folder, identity) as store:
        search = Search(
            falsification.search,
            [False],
            storage=folder / JOURNAL,
            folder=str(folder.resolve()),
            specified=hashlib.sha256(canonical(identity).encode()).hexdigest(),
            sampler=falsification.sampler,
            seed=falsification.seed,
        )
        rounds = Rounds(falsification.drives, engine, store)
        proposals = search.ask(1) if not search.trials else []
        rows = _rows_of(rounds, [each.settings for each in proposals])
        first = proposals[0].settings if proposals else search.trials[0].settings
        undisturbed = _rows_of(rounds, [falsification.smaller(first, 0.0)])[0]
        _require_held(falsification, undisturbed)
        for proposal, row in zip(proposals, rows, strict=True):
            _told(falsification, search, proposal.number, proposal.settings, row)
        while (done := len(search.trials)) < falsification.trials:
            _tell(tell, done, falsification, search)
            proposals = search.ask(min(falsification.batch, falsification.trials - done))
            for proposal, row in zip(proposals, _rows_of(rounds, [each.settings for each in proposals]), strict=True):
                _told(falsification, search, proposal.number, proposal.settings, row)
        _tell(tell, done, falsification, search)
        sizes = _sizes(falsification, rounds, search.trials)
        smallest = min(sizes, key=lambda number: sizes[number], default=None)
        trials = {trial.number: trial for trial in search.trials}
        found = None if smallest is None else _halved(falsification, rounds, trials[smallest].settings)
        store.compact()
    falsified = Falsified(falsification, undisturbed, list(trials.values()), sizes, found)
    if falsified.recipe is not None:
        falsified.recipe.to_toml(folder / FOUND)
    return falsified


def _rows_of(rounds: Rounds, settings: list[Mapping[str, Plain]]) -> list[Row]:
    return [rows[0] for rows in rounds.drive(settings)]


def _told(what: Falsification, search: Search, number: int, settings: Mapping[str, Plain], row: Row) -> None:
    worth = what.worth(settings, row)
    search.tell(number, None if worth is None else [worth])


def _sizes(what: Falsification, rounds: Rounds, trials: list[Trial]) -> dict[int, float]:
    """Of the trials that violate something."""
    rows = _rows_of(rounds, [trial.settings for trial in trials])
    return {
        trial.number: what.size_of(trial.settings)
        for trial, row in zip(trials, rows, strict=True)
        if what.violated(row)
    }


def _halved(what: Falsification, rounds: Rounds, settings: Mapping[str, Plain]) -> Found:
    """The smallest disturbance on the way from nothing that violates something, as far as halving the way finds it."""
    low, high, found = 0.0, 1.0, dict(settings)
    row = _rows_of(rounds, [found])[0]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        tried = what.smaller(settings, middle)
        here = _rows_of(rounds, [tried])[0]
        if what.violated(here):
            high, found, row = middle, tried, here
        else:
            low = middle
    violated = tuple(what.violated(row) or ())
    return Found(found, what.size_of(found), violated, row, what.size_of(what.smaller(settings, low)))


def _require_held(what: Falsification, row: Row) -> None:
    violated = what.violated(row)
    if violated is None:
        raise CampaignError(
            f"The drive without a disturbance did not come to its end. {row['outcome']}: {row['error']}"
        )
    if violated:
        why = ", ".join(f"{name}: {what.criteria[name].why(row)}" for name in violated)
        raise CampaignError(f"The drive without a disturbance violates something already. {why}")


def _tell(tell: Any, done: int, what: Falsification, search: Search) -> None:
    if tell is not None:
        best = search.best
        tell(done, what.trials, best[0] if best else None)
