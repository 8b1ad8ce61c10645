"""A search over settings: Optuna proposes, drives tell what came of it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

from rumo.campaigns.distributions import Choice, Distribution, Integers, LogUniform, Uniform
from rumo.campaigns.sampling import Grid
from rumo.errors import ArgumentError
from rumo.extras import required
from rumo.scenarios.settings import LEAVES

SAMPLERS = ("tpe", "cma-es", "nsga2", "random")
"""What proposes settings."""
SEVERAL = ("tpe", "nsga2", "random")
"""Those that can take several objectives."""
SEARCHED = (Uniform, Integers, Choice, Grid)
"""What can be searched; LogUniform is Uniform."""
NAME = "rumo"
"""Of the study in its storage."""
_SPECIFIED, _FOLDER = "specified", "folder"


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
    again proposes what it would have proposed.

    Parameters
    ----------
    space : mapping of str to Uniform, LogUniform, Integers, Choice or Grid
        What may be chosen, by dotted name; of a distribution only its ends matter.
    maximise : sequence of bool
        For each objective, whether more is better.
    storage : str or Path
        A journal file, or the URL of a database: sqlite:///tune.db, postgresql://user@host/tune.
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
        storage: str | Path,
        folder: str,
        specified: str,
        sampler: str = "tpe",
        seed: int = 0,
    ) -> None:
        self._optuna = optuna = required("optuna", "campaign", "a search")
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._sampler, self._seed, self._folder = sampler, seed, folder
        self._distributions = {name: self._distribution(choice) for name, choice in space.items()}
        try:
            self._study = optuna.create_study(
                storage=self._opened(storage),
                study_name=NAME,
                directions=["maximize" if more else "minimize" for more in maximise],
                sampler=optuna.samplers.RandomSampler(seed),
                load_if_exists=True,
            )
        except ArgumentError:
            raise
        except Exception as error:  # of SQLAlchemy, a database's driver, or the file system
            said = str(error).strip().partition("\n")[0] or type(error).__name__
            raise ArgumentError("storage", f"{storage!s} ({said})", "a file or database that can be opened") from None
        known = self._study.user_attrs.get(_SPECIFIED)
        if known not in (None, specified):
            cure = "Name another folder or storage, or go on with the file that it was begun with."
            raise ArgumentError("storage", f"{storage!s}, with another search", "a new one, or this search's", cure)
        if known is None:
            self._study.set_user_attr(_SPECIFIED, specified)

    def begin(self, settings: Mapping[str, Any]) -> None:
        """Have these settings tried first, if nothing has been tried."""
        if not self._study.trials:
            self._study.enqueue_trial(dict(settings))

    def ask(self, count: int) -> list[Proposal]:
        """So many trials: first those of this folder that were asked for and never told.

        Parameters
        ----------
        count : int
            How many, at least 1.
        """
        state = self._optuna.trial.TrialState
        running = self._study.get_trials(deepcopy=False, states=(state.RUNNING,))
        mine = [t for t in running if t.user_attrs.get(_FOLDER) == self._folder]
        proposals = [Proposal(trial.number, dict(trial.params)) for trial in mine[:count]]
        asked = len(self._study.get_trials(deepcopy=False))
        self._study.sampler = self._made_sampler(asked)
        while len(proposals) < count:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # what a sampler is not sure of is no concern of a user's
                trial = self._study.ask(self._distributions)
            trial.set_user_attr(_FOLDER, self._folder)
            proposals.append(Proposal(trial.number, dict(trial.params)))
        return proposals

    def tell(self, number: int, values: Sequence[float] | None, constraints: Mapping[str, float] | None = None) -> None:
        """What came of a trial.

        Parameters
        ----------
        number : int
            Which.
        values : sequence of float, optional
            Of the objectives; None if it failed.
        constraints : mapping of str to float
            By how much each is violated.
        """
        frozen = next(t for t in self._study.get_trials(deepcopy=False) if t.number == number)
        trial = self._optuna.Trial(self._study, frozen._trial_id)
        for name, value in (constraints or {}).items():
            trial.set_constraint(name, value)
        failed = self._optuna.trial.TrialState.FAIL if values is None else None
        self._study.tell(number, None if values is None else list(values), state=failed)

    @property
    def trials(self) -> list[Trial]:
        """Those that are done, by number."""
        state = self._optuna.trial.TrialState
        done = self._study.get_trials(deepcopy=False, states=(state.COMPLETE, state.FAIL))
        return [
            Trial(t.number, dict(t.params), tuple(t.values) if t.state == state.COMPLETE else (), dict(t.constraints))
            for t in done
        ]

    @property
    def best(self) -> list[Trial]:
        """The feasible trial that is best; with several objectives, all that no feasible trial beats in each."""
        if not any(trial.feasible for trial in self.trials):
            return []
        numbers = {trial.number for trial in self._study.best_trials}
        return [trial for trial in self.trials if trial.number in numbers and trial.feasible]

    def importance(self, objective: int = 0) -> dict[str, float]:
        """How much of what an objective does among the better trials each setting decides, by PED-ANOVA; sums to 1.

        Empty if there are too few trials to say.
        """
        evaluator = self._optuna.importance.PedAnovaImportanceEvaluator()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = self._optuna.importance.get_param_importances(
                    self._study, evaluator=evaluator, target=lambda trial: trial.values[objective]
                )
        except (RuntimeError, ValueError):
            return {}
        return {name: float(share) for name, share in found.items()}

    def _opened(self, storage: str | Path) -> Any:
        if "://" in str(storage):
            return self._optuna.storages.RDBStorage(str(storage))
        journal = self._optuna.storages.journal
        return self._optuna.storages.JournalStorage(journal.JournalFileBackend(str(storage)))

    def _made_sampler(self, asked: int) -> Any:
        """A sampler whose draws are decided by the seed and by how many trials there are."""
        seed = int.from_bytes(sha256(f"{self._seed} {asked}".encode()).digest()[:4])
        samplers = self._optuna.samplers
        if self._sampler == "cma-es":
            required("cmaes", "campaign", 'sampler "cma-es"')
            return samplers.CmaEsSampler(seed=seed)
        if self._sampler == "nsga2":
            return samplers.NSGAIISampler(seed=seed)
        if self._sampler == "random":
            return samplers.RandomSampler(seed=seed)
        return samplers.TPESampler(seed=seed, multivariate=True)

    def _distribution(self, choice: Distribution | Grid) -> Any:
        distributions, values = self._optuna.distributions, options_of(choice)
        if values is not None:
            return distributions.CategoricalDistribution(values)
        if isinstance(choice, Integers):
            return distributions.IntDistribution(choice.low, choice.high)
        assert isinstance(choice, Uniform)
        return distributions.FloatDistribution(choice.low, choice.high, log=isinstance(choice, LogUniform))


def check_space(space: Mapping[str, Distribution | Grid]) -> None:
    """Raise unless everything can be searched."""
    for name, choice in space.items():
        if not isinstance(choice, SEARCHED) or ((values := options_of(choice)) is not None and not _listed(values)):
            expected = "a list of numbers or texts, or a distribution with ends: uniform, log-uniform, integers"
            raise ArgumentError(f"search.{name}", repr(choice), expected)


def options_of(choice: Distribution | Grid) -> list[Any] | None:
    """Values among which one is chosen; None where it is not among some."""
    if isinstance(choice, Choice):
        return list(choice.among)
    return list(choice.values) if isinstance(choice, Grid) else None


def _listed(values: Sequence[Any]) -> bool:
    return all(isinstance(value, LEAVES) for value in values)
