"""A tuning from its first trial to what is best."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from rumo.campaigns.searching.rounds import Rounds
from rumo.campaigns.searching.search import Search, Trial
from rumo.campaigns.searching.space import as_chosen
from rumo.campaigns.store import Store
from rumo.campaigns.store.room import writing_to
from rumo.campaigns.tasks.task import Engine, Row, canonical
from rumo.campaigns.tuning.goals import parts_known
from rumo.campaigns.tuning.specification import Tuning
from rumo.errors import CampaignError
from rumo.interrupts import interruptible
from rumo.scenarios import Recipe

JOURNAL, BEST, FRONT = "trials.journal", "best.toml", "best-{}.toml"
Tell = Callable[[int, int, Trial | None], object]


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
        The best, or those that none beats in every objective, first the one that is nearest to being the best in all;
        that is written to `best.toml`.
    importance : mapping of str to mapping
        By objective: what share of it each setting decides.
    judged : Judged, optional
        Of the first of the best, if there is a check.
    after : list of dict
        Rows of the drives with the first of the best; empty if there is none, or another machine drove it.
    failed : list of dict
        Rows of all drives that did not come to their end.
    stopped : BaseException, optional
        What ended it before all trials were done.
    """

    tuning: Tuning
    base: list[Row]
    trials: list[Trial]
    best: list[Trial]
    importance: Mapping[str, Mapping[str, float]]
    judged: Judged | None = None
    after: list[Row] = field(default_factory=list[Row])
    failed: list[Row] = field(default_factory=list[Row])
    stopped: BaseException | None = None

    @property
    def recipe(self) -> Recipe | None:
        """The recipe with the best settings; None if no trial is within the limits."""
        return self.tuning.with_best(self.best[0].settings) if self.best else None


def carry_out_tuning(tuning: Tuning, folder: Path, engine: Engine, tell: Tell | None = None) -> Tuned:
    """Drive all trials that are not done, and judge the best; what is done is kept in the folder.

    Parameters
    ----------
    tuning : Tuning
        What to tune.
    folder : Path
        Of rows, trials, and `best.toml`; where several are best, the others are in `best-NUMBER.toml`.
    engine : Engine
        Where drives are carried out.
    tell : callable, optional
        Called with (trials done, all trials, the best so far) at the beginning and after each batch.

    Returns
    -------
    Tuned
        What came of it; also where Ctrl-C or a `CampaignError` ended it after some trials, see `Tuned.stopped`.

    Raises
    ------
    ArgumentError
        If the folder or the storage has another tuning.
    CampaignError
        If nothing can be carried out, or stored; if the drives without tuning fail.
    """
    specified = hashlib.sha256(canonical(tuning.identity).encode()).hexdigest()
    with Store(folder, tuning.plain, tuning.identity) as store:
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
        store.describe()
        stopped, judged = None, None
        try:
            _drive(tuning, search, rounds, base, tell)
            judged = _judged(tuning, _best(tuning, search), engine, store)
            with interruptible(inf):
                store.compact()
        except (CampaignError, KeyboardInterrupt) as error:
            stopped = error
        with interruptible(inf):
            tuned = _tuned(tuning, search, rounds, base, judged, stopped)
            try:
                with writing_to(folder):
                    _write(tuned, folder)
            except CampaignError as error:
                tuned = replace(tuned, stopped=stopped or error)
    return tuned


def _drive(tuning: Tuning, search: Search, rounds: Rounds, base: list[Row], tell: Tell | None) -> None:
    begun_with = tuning.begun_with
    if len(begun_with) == len(tuning.search) and all(tuning.allows(*item) for item in begun_with.items()):
        search.begin({name: as_chosen(tuning.search[name], value) for name, value in begun_with.items()})
    while True:
        done, best = len(search.trials), _best(tuning, search)
        if tell is not None:
            tell(done, tuning.trials, best[0] if best else None)
        if done >= tuning.trials:
            return
        proposals = search.ask(min(tuning.batch, tuning.trials - done))
        driven = rounds.drive([each.settings for each in proposals])
        with interruptible(inf):
            for proposal, rows in zip(proposals, driven, strict=True):
                search.tell(proposal.number, *_judge(tuning, rows, base))


def _judge(tuning: Tuning, rows: list[Row], base: list[Row]) -> tuple[list[float] | None, dict[str, float]]:
    """Objectives of a trial, None where a drive does not say, and by how much it is beyond each limit."""
    values = [objective.figure(rows) for objective in tuning.objectives.values()]
    beyond = {name: limit.violation(rows, base) for name, limit in tuning.limits.items()}
    known = [value for value in values if value is not None]
    limits = {name: value for name, value in beyond.items() if value is not None}
    if len(known) < len(values) or len(limits) < len(beyond):
        return None, {}
    return known, limits


def _best(tuning: Tuning, search: Search) -> list[Trial]:
    """Those that none beats, first the one that is nearest to having the best value of each objective."""
    best = search.best
    signs = np.array([-1.0 if objective.maximise else 1.0 for objective in tuning.objectives.values()])
    costs = signs * np.array([trial.values for trial in best]).reshape(len(best), len(signs))
    if not len(best):
        return best
    low, span = costs.min(axis=0), np.ptp(costs, axis=0)
    far = np.linalg.norm((costs - low) / np.where(span > 0.0, span, 1.0), axis=1)
    return [best[i] for i in np.argsort(far, kind="stable")]


def _judged(tuning: Tuning, best: list[Trial], engine: Engine, store: Store) -> Judged | None:
    if tuning.judged is None or not best:
        return None
    before, after = Rounds(tuning.judged, engine, store).drive([{}, best[0].settings])
    return Judged(before, after)


def _tuned(
    tuning: Tuning,
    search: Search,
    rounds: Rounds,
    base: list[Row],
    judged: Judged | None,
    stopped: BaseException | None,
) -> Tuned:
    best = _best(tuning, search)
    importance = {name: search.importance(i) for i, name in enumerate(tuning.objectives)}
    after = rounds.known(best[0].settings) if best else []
    return Tuned(tuning, base, search.trials, best, importance, judged, after, rounds.failed, stopped)


def _write(tuned: Tuned, folder: Path) -> None:
    """The best settings as files, without those of an earlier start."""
    for path in (folder / BEST, *folder.glob(FRONT.format("*"))):
        path.unlink(missing_ok=True)
    if tuned.recipe is not None:
        tuned.recipe.to_toml(folder / BEST)
    for trial in tuned.best[1:]:
        tuned.tuning.with_best(trial.settings).to_toml(folder / FRONT.format(trial.number))


def _require_all(tuning: Tuning, base: list[Row]) -> None:
    """Raise unless the drives without tuning say what limits and objectives are about."""
    goals: dict[str, Any] = {**tuning.objectives, **tuning.limits}
    for name, goal in goals.items():
        if goal.figure(base) is None:
            failed = next((row for row in base if row["outcome"] != "done"), None)
            parts = ", ".join(parts_known(base, goal.kpi))
            why = f"{goal.kpi}: not known of all of them" + (f"; they have {parts}" if parts else "")
            why = f"{failed['outcome']}: {failed['error']}" if failed else why
            raise CampaignError(f"The drives without tuning do not say what {goal.TABLE}.{name} asks. {why}.")
