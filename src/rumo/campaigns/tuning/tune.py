"""A tuning from its first trial to what is best."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rumo.campaigns.rounds import Rounds
from rumo.campaigns.search import Search, Trial
from rumo.campaigns.specification import canonical
from rumo.campaigns.store import Store
from rumo.campaigns.task import Engine, Row
from rumo.campaigns.tuning.specification import Tuning
from rumo.errors import CampaignError
from rumo.scenarios import Recipe

JOURNAL, BEST = "trials.journal", "best.toml"


@dataclass(frozen=True)
class Judged:
    """Drives that the tuning knew nothing of, without it and with it, draw by draw."""

    before: list[Row]
    after: list[Row]


@dataclass(frozen=True)
class Tuned:
    """What came of a tuning.

    Attributes
    ----------
    tuning : Tuning
        What it was.
    base : list of dict
        Rows of the drives without tuning.
    trials : list of Trial
        All that are done, by number.
    best : list of Trial
        The best, or those that none beats in every objective; the first of them is written to `best.toml`.
    importance : mapping of str to mapping
        By objective: what share of it each setting decides.
    judged : Judged, optional
        Of the first of the best, if there is a check.
    """

    tuning: Tuning
    base: list[Row]
    trials: list[Trial]
    best: list[Trial]
    importance: Mapping[str, Mapping[str, float]]
    judged: Judged | None = None

    @property
    def recipe(self) -> Recipe | None:
        """The recipe with the best settings; None if no trial is within the limits."""
        return self.tuning.recipe.with_settings(self.best[0].settings) if self.best else None


def carry_out_tuning(
    tuning: Tuning, folder: Path, engine: Engine, tell: Callable[[int, int, Trial | None], object] | None = None
) -> Tuned:
    """Drive all trials that are not done, and judge the best; what is done is kept in the folder.

    Parameters
    ----------
    tuning : Tuning
        What to tune.
    folder : Path
        Of rows, trials, and `best.toml`.
    engine : Engine
        Where drives are carried out.
    tell : callable, optional
        Called with (trials done, all trials, the best so far) at the beginning and after each batch.

    Raises
    ------
    ArgumentError
        If the folder or the storage has another tuning.
    CampaignError
        If no more can be carried out, or stored; if the drives without tuning fail.
    """
    specified = hashlib.sha256(canonical(tuning.identity).encode()).hexdigest()
    with Store(folder, tuning.identity) as store:
        search = Search(
            tuning.search,
            [objective.maximise for objective in tuning.objectives.values()],
            storage=tuning.storage or folder / JOURNAL,
            folder=str(folder.resolve()),
            specified=specified,
            sampler=tuning.sampler,
            seed=tuning.seed,
        )
        rounds = Rounds(tuning.drives, engine, store)
        base = rounds.drive([{}])[0]
        _require_all(tuning, base)
        begun_with = tuning.begun_with
        if len(begun_with) == len(tuning.search) and all(tuning.allows(*item) for item in begun_with.items()):
            search.begin(begun_with)
        done = len(search.trials)
        while done < tuning.trials:
            _tell(tell, done, tuning, search)
            proposals = search.ask(min(tuning.batch, tuning.trials - done))
            for proposal, rows in zip(proposals, rounds.drive([each.settings for each in proposals]), strict=True):
                values, beyond = _judge(tuning, rows, base)
                search.tell(proposal.number, values, beyond)
            done = len(search.trials)
        _tell(tell, done, tuning, search)
        best = search.best
        importance = {name: search.importance(i) for i, name in enumerate(tuning.objectives)}
        judged = _judged(tuning, best, engine, store)
        store.compact()
    tuned = Tuned(tuning, base, search.trials, best, importance, judged)
    if tuned.recipe is not None:
        tuned.recipe.to_toml(folder / BEST)
    return tuned


def _judge(tuning: Tuning, rows: list[Row], base: list[Row]) -> tuple[list[float] | None, dict[str, float]]:
    """Objectives of a trial, None where a drive does not say, and by how much it is beyond each limit."""
    values = [objective.value(rows) for objective in tuning.objectives.values()]
    beyond = {name: limit.violation(rows, base) for name, limit in tuning.limits.items()}
    known = [value for value in values if value is not None]
    limits = {name: value for name, value in beyond.items() if value is not None}
    if len(known) < len(values) or len(limits) < len(beyond):
        return None, {}
    return known, limits


def _judged(tuning: Tuning, best: list[Trial], engine: Engine, store: Store) -> Judged | None:
    if tuning.judged is None or not best:
        return None
    before, after = Rounds(tuning.judged, engine, store).drive([{}, best[0].settings])
    return Judged(before, after)


def _require_all(tuning: Tuning, base: list[Row]) -> None:
    """Raise unless the drives without tuning say what limits and objectives are about."""
    for name, goal in {**tuning.objectives, **tuning.limits}.items():
        if goal.figure(base) is None:
            failed = next((row for row in base if row["outcome"] != "done"), None)
            why = f"{failed['outcome']}: {failed['error']}" if failed else f"none of them has {goal.kpi}"
            raise CampaignError(f"The drives without tuning do not say what {name} is about. {why}")


def _tell(tell: Any, done: int, tuning: Tuning, search: Search) -> None:
    if tell is not None:
        best = search.best
        tell(done, tuning.trials, best[0] if best else None)
