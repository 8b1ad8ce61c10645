"""A search over settings: Optuna proposes, drives tell what came of it."""

from __future__ import annotations

import warnings
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rumo.campaigns.searching.samplers import CMA_ES, SAMPLERS, SEVERAL, made_sampler
from rumo.campaigns.searching.space import check_space, options_of, suggest
from rumo.campaigns.searching.trial_storage import is_url, opened, opening, optuna_for, reached, shown
from rumo.campaigns.specification.distributions import Distribution
from rumo.campaigns.specification.sampling import Grid
from rumo.errors import ArgumentError

__all__ = ["SAMPLERS", "SEVERAL", "Proposal", "Search", "Trial", "check_space", "not_beaten", "options_of"]

NAME = "rumo"
"""Of the study in its storage."""
BEYOND = 1e12
"""What CMA-ES is told of trials that violate a constraint, times one and by how much: it asks only which is better."""
_SPECIFIED, _FOLDER, _AFTER, _VALUES = "specified", "folder", "after", "values"


@dataclass(frozen=True)
class Proposal:
    """Settings to be tried.

    Attributes
    ----------
    number : int
        Which trial.
    settings : mapping of str to object
        By dotted name.
    """

    number: int
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Trial:
    """Settings that were tried.

    Attributes
    ----------
    number : int
        Which trial.
    settings : mapping of str to object
        By dotted name.
    values : tuple of float
        Of the objectives; empty if the trial failed.
    constraints : mapping of str to float
        By how much each is violated; at most 0 where it holds.
    """

    number: int
    settings: Mapping[str, Any]
    values: tuple[float, ...] = ()
    constraints: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def feasible(self) -> bool:
        """Whether it has values and all constraints hold."""
        return bool(self.values) and all(value <= 0.0 for value in self.constraints.values())


class Search:
    """Trials in a storage of Optuna's own: what it holds is not lost, and a search that was stopped goes on.

    What is proposed depends on what was told, and on the seed, never on when: a search that was stopped and started
    again proposes what it would have proposed, wherever it was stopped.

    Parameters
    ----------
    space : mapping of str to Uniform, LogUniform, Integers, Choice or Grid
        What may be chosen, by dotted name; of a distribution only its ends matter.
    maximise : sequence of bool
        For each objective, whether more is better.
    storage : str or Path, optional
        A journal file, in a folder to which only this process writes, or the URL of a database: sqlite:///tune.db,
        postgresql://user@host/tune. Without one, the search is in memory, and is told of all trials again.
    folder : str
        Who asks: of trials that nobody has told, those of the same folder are taken up again.
    specified : str
        What the search is about; a storage that has another is refused.
    sampler : str
        One of `SAMPLERS`.
    seed : int
        Of what is drawn.

    Raises
    ------
    ArgumentError
        If Optuna is not installed, the storage cannot be opened, or it has another search.
    """

    def __init__(
        self,
        space: Mapping[str, Distribution | Grid],
        maximise: Sequence[bool],
        *,
        storage: str | Path | None,
        folder: str,
        specified: str,
        sampler: str = "tpe",
        seed: int = 0,
    ) -> None:
        self._optuna = optuna = optuna_for("a search")
        check_space(space, sampler)
        self._space, self._maximise, self._sampler = dict(space), tuple(maximise), sampler
        self._storage, self._folder, self._alone = storage, folder, not is_url(storage)
        # Processes with one database must not all propose the same.
        self._decided_by = f"{seed}" if self._alone else f"{seed} {folder}"
        with _silent(), opening(storage):
            self._study = optuna.create_study(
                storage=opened(optuna, storage),
                study_name=NAME,
                directions=["maximize" if more else "minimize" for more in maximise],
                sampler=made_sampler(optuna, sampler, self._decided_by),
                load_if_exists=True,
            )
            known = self._study.user_attrs.get(_SPECIFIED)
            if known is None:
                self._study.set_user_attr(_SPECIFIED, specified)
        if known not in (None, specified):
            cure = "Name another folder or storage, or go on with the file that it was begun with."
            got = f"{shown(storage)}, with another search"
            raise ArgumentError("storage", got, "a new one, or this search's", cure)

    def begin(self, settings: Mapping[str, Any]) -> None:
        """Have these settings tried first, if nothing has been tried."""
        with self._kept():
            if not self._study.trials:
                self._study.enqueue_trial(dict(settings))

    def ask(self, count: int) -> list[Proposal]:
        """So many trials, or those of this folder that were asked for before and not all told: they come first.

        Parameters
        ----------
        count : int
            How many, at least 1.
        """
        state = self._optuna.trial.TrialState
        with self._kept():
            trials = self._study.get_trials(deepcopy=False)
            mine = [t for t in trials if self._is_mine(t)]
            running = sorted((t for t in mine if t.state == state.RUNNING), key=lambda t: t.number)[:count]
            told = len([t for t in mine if t.state.is_finished()])
            again = [self._optuna.Trial(self._study, t._trial_id) for t in running]
            proposals = [self._proposed(trial, told) for trial in again]
            # Of a batch of which some are told, all were asked for: those that follow are to know of all of it.
            if running and running[0].user_attrs.get(_AFTER, told) != told:
                return proposals
            while len(proposals) < count:
                proposals.append(self._proposed(self._study.ask(), told))
            return proposals

    def _is_mine(self, trial: Any) -> bool:
        # Whoever was killed while asking has left a trial that says nothing; in a database it may be another's.
        return trial.user_attrs.get(_FOLDER, self._folder if self._alone else None) == self._folder

    def _proposed(self, trial: Any, told: int) -> Proposal:
        """The proposal of a trial, some of whose settings may be there already."""
        if _AFTER not in trial.user_attrs:
            trial.set_user_attr(_FOLDER, self._folder)
            trial.set_user_attr(_AFTER, told)
        if self._space.keys() <= trial.params.keys():
            return Proposal(trial.number, dict(trial.params))
        # Each setting has draws of its own, so that those that are there do not change the others.
        self._study.sampler = made_sampler(self._optuna, self._sampler, f"{self._decided_by} {trial.number}")
        _ = trial.relative_params
        for name, choice in self._space.items():
            decided_by = f"{self._decided_by} {trial.number} {name}"
            self._study.sampler = made_sampler(self._optuna, self._sampler, decided_by)
            suggest(trial, name, choice)
        return Proposal(trial.number, dict(trial.params))

    def tell(self, number: int, values: Sequence[float] | None, constraints: Mapping[str, float] | None = None) -> None:
        """What came of a trial; nothing if somebody has told already.

        Parameters
        ----------
        number : int
            Which.
        values : sequence of float, optional
            Of the objectives; None if it failed.
        constraints : mapping of str to float
            By how much each is violated.
        """
        with self._kept():
            frozen = next(t for t in self._study.get_trials(deepcopy=False) if t.number == number)
            if frozen.state.is_finished():
                return
            trial, beyond = self._optuna.Trial(self._study, frozen._trial_id), dict(constraints or {})
            for name, value in beyond.items():
                trial.set_constraint(name, value)
            if values is None:
                self._study.tell(number, state=self._optuna.trial.TrialState.FAIL)
                return
            told = list(map(float, values))
            trial.set_user_attr(_VALUES, told)
            if self._sampler == CMA_ES and any(value > 0.0 for value in beyond.values()):
                worst = BEYOND * (1.0 + sum(max(value, 0.0) for value in beyond.values()))
                told = [-worst if more else worst for more in self._maximise]
            self._study.tell(number, told)

    @property
    def trials(self) -> list[Trial]:
        """Those that are done, by number."""
        state = self._optuna.trial.TrialState
        with self._kept():
            done = self._study.get_trials(deepcopy=False, states=(state.COMPLETE, state.FAIL))
        return [
            Trial(
                t.number,
                {name: t.params[name] for name in self._space if name in t.params},
                tuple(t.user_attrs[_VALUES]) if t.state == state.COMPLETE else (),
                dict(t.constraints),
            )
            for t in sorted(done, key=lambda t: t.number)
        ]

    @property
    def best(self) -> list[Trial]:
        """The feasible trial that is best; with several objectives, all that no feasible trial beats in each."""
        return not_beaten(self.trials, self._maximise)

    def importance(self, objective: int = 0) -> dict[str, float]:
        """How much of what an objective does among the better trials each setting decides, by PED-ANOVA; sums to 1.

        Empty if there are too few trials to say.
        """
        sign = -1.0 if self._maximise[objective] else 1.0
        evaluator = self._optuna.importance.PedAnovaImportanceEvaluator()
        try:
            with self._kept():
                found = self._optuna.importance.get_param_importances(
                    self._study, evaluator=evaluator, target=lambda trial: sign * trial.user_attrs[_VALUES][objective]
                )
        except (RuntimeError, ValueError):
            return {}
        return {name: float(share) for name, share in found.items()}

    @contextmanager
    def _kept(self) -> Generator[None]:
        with _silent(), reached(self._optuna, self._storage):
            yield


@contextmanager
def _silent() -> Generator[None]:
    """What a sampler is not sure of, or thinks is experimental, is no concern of a user's."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def not_beaten(trials: Sequence[Trial], maximise: Sequence[bool]) -> list[Trial]:
    """Feasible trials of which no feasible one is at least as good in all objectives and better in one, by number.

    Of trials with the same values, the first.
    """
    signs = [-1.0 if more else 1.0 for more in maximise]
    costs = {t.number: [s * v for s, v in zip(signs, t.values, strict=True)] for t in trials if t.feasible}

    def beats(one: int, other: int) -> bool:
        no_worse = all(a <= b for a, b in zip(costs[one], costs[other], strict=True))
        return no_worse and (costs[one] != costs[other] or one < other)

    return [t for t in trials if t.feasible and not any(beats(other, t.number) for other in costs if other != t.number)]
