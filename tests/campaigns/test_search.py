"""Searches go on wherever they were ended, and propose what they would have proposed."""

import pytest

from rumo.campaigns.searching.search import Search, Trial, not_beaten
from rumo.campaigns.specification.distributions import Choice, Integers, LogUniform, Normal, Uniform
from rumo.campaigns.specification.sampling import Grid
from rumo.errors import ArgumentError, CampaignError

optuna = pytest.importorskip("optuna")
pytest.importorskip("cmaes")
pytestmark = pytest.mark.usefixtures("quick_disks")

NUMBERS = {"x": Uniform(-1.0, 1.0), "y": LogUniform(0.01, 100.0), "n": Integers(1, 9)}
MIXED = {**NUMBERS, "scheme": Grid(["euler", "radau"]), "on": Choice([True, False])}
CASES = {"tpe": (MIXED, 1), "cma-es": (NUMBERS, 1), "nsga2": (MIXED, 2), "random": (MIXED, 1)}
TRIALS, BATCH = 30, 4


def made(folder, space=NUMBERS, objectives=1, sampler="tpe", storage=None, specified="a", seed=0):
    folder.mkdir(exist_ok=True)
    return Search(
        space,
        [False] * objectives,
        storage=storage or folder / "trials.journal",
        folder=str(folder),
        specified=specified,
        sampler=sampler,
        seed=seed,
    )


def judged(settings, objectives=1):
    """Values and constraints: small at x = 0.3, y = 1, with x not below 0.2; now and then nothing."""
    if settings["n"] == 7:
        return None, {}
    values = [(settings["x"] - 0.3) ** 2 + abs(settings["y"] - 1.0), settings["n"] - settings["x"]]
    return values[:objectives], {"not below": 0.2 - settings["x"]}


def go(search, objectives=1, trials=TRIALS):
    search.begin({name: choice.ends[0] for name, choice in search._space.items()})
    while (done := len(search.trials)) < trials:
        for proposal in search.ask(min(BATCH, trials - done)):
            search.tell(proposal.number, *judged(proposal.settings, objectives))
    return search.trials


class KilledError(BaseException):
    pass


@pytest.mark.parametrize("sampler", CASES)
def test_killed_again_and_again_it_tries_the_same(sampler, tmp_path, monkeypatch):
    space, objectives = CASES[sampler]
    wanted = go(made(tmp_path / "whole", space, objectives, sampler), objectives)
    assert len(wanted) == TRIALS
    assert any(trial.feasible for trial in wanted)
    backend, left = optuna.storages.journal.JournalFileBackend, [0]
    append = backend.append_logs

    def torn(self, logs):
        left[0] -= 1
        if left[0] < 0:
            with open(self._file_path, "ab") as file:
                file.write(b'{"op_code":')
            raise KilledError
        append(self, logs)

    monkeypatch.setattr(backend, "append_logs", torn)
    kills = 0
    while True:
        left[0] = 17 + kills % 5
        try:
            found = go(made(tmp_path / "killed", space, objectives, sampler), objectives)
            break
        except KilledError:
            kills += 1
    assert kills > 10
    assert found == wanted


def test_another_seed_tries_others(tmp_path):
    one, other = go(made(tmp_path / "a"), trials=4), go(made(tmp_path / "b", seed=1), trials=4)
    assert one[0] == other[0]  # what it is to begin with
    assert one[1:] != other[1:]


def test_what_was_asked_for_is_taken_up_before_others(tmp_path):
    asked = made(tmp_path / "a").ask(3)
    again = made(tmp_path / "a").ask(4)
    assert again[:3] == asked
    search = made(tmp_path / "a")
    search.tell(asked[0].number, [1.0])
    search.tell(asked[0].number, [2.0])  # as somebody else has done already
    assert search.trials[0].values == (1.0,)
    assert search.ask(4) == again[1:]


@pytest.mark.parametrize("sampler", ["tpe", "cma-es"])
def test_it_finds_what_is_good_within_the_constraint(sampler, tmp_path):
    search = made(tmp_path / "a", sampler=sampler)
    go(search, trials=80)
    (best,) = search.best
    assert best.feasible
    assert best.values[0] < 0.1
    if sampler == "cma-es":  # which knows nothing of constraints by itself
        assert sum(trial.feasible for trial in search.trials[40:]) > 25
    importance = search.importance()
    assert sum(importance.values()) == pytest.approx(1.0)
    assert importance["y"] > importance["x"]


def test_two_in_one_database_share_trials_and_propose_different_ones(tmp_path):
    storage = f"sqlite:///{tmp_path}/tune.db"
    one, other = (made(tmp_path / name, storage=storage) for name in "ab")
    first, second = one.ask(4), other.ask(4)
    assert {each.number for each in first}.isdisjoint(each.number for each in second)
    assert [each.settings for each in first] != [each.settings for each in second]
    for search, proposals in ((one, first), (other, second)):
        for proposal in proposals:
            search.tell(proposal.number, *judged(proposal.settings))
    assert one.trials == other.trials
    assert len(one.trials) == 8
    with pytest.raises(ArgumentError, match="with another search"):
        made(tmp_path / "c", storage=storage, specified="b")


def test_what_cannot_be_opened_says_so_without_a_password(tmp_path):
    (tmp_path / "text").write_text("what\never\n")
    for storage in (f"sqlite:///{tmp_path}/no/such/folder/tune.db", "no-database://here", tmp_path / "text"):
        with pytest.raises(ArgumentError, match="storage: got"):
            made(tmp_path / "a", storage=storage)
    with pytest.raises(ArgumentError, match=r"postgresql://me:\*\*\*@localhost") as error:
        made(tmp_path / "a", storage="postgresql://me:secret@localhost:1/tune")
    assert "secret" not in str(error.value)


def test_a_full_disk_ends_it_and_it_goes_on(tmp_path, monkeypatch):
    search = made(tmp_path / "a")
    first = search.ask(2)

    def full(self, logs):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(optuna.storages.journal.JournalFileBackend, "append_logs", full)
        with pytest.raises(CampaignError, match=r"No space left on device.*Start again to go on"):
            search.tell(first[0].number, [1.0])
    assert made(tmp_path / "a").ask(2) == first


@pytest.mark.parametrize(
    ("space", "sampler", "message"),
    [
        ({"x": Normal(0.0, 1.0)}, "tpe", "search.x: .*a distribution with ends"),
        ({"x": Grid([[1], [2]])}, "tpe", "search.x: .*numbers or texts"),
        ({"x": Grid([1, 2, 1])}, "tpe", "search.x: .*each of them once"),
        ({"x": Uniform(0.0, 1.0), "y": Grid([1, 2])}, "cma-es", "search.y: .*between two ends"),
        ({"x": Uniform(0.0, 1.0)}, "cma-es", "sampler: .*two settings at least"),
    ],
)
def test_what_cannot_be_searched(space, sampler, message, tmp_path):
    with pytest.raises(ArgumentError, match=message):
        made(tmp_path / "a", space, sampler=sampler)


def test_without_optuna_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "optuna", None)
    with pytest.raises(ArgumentError, match=r'without optuna.*pip install "rumo\[campaign\]"'):
        made(tmp_path / "a")


def test_none_beats_what_is_on_the_front():
    values = [(1.0, 5.0), (2.0, 4.0), (2.0, 6.0), (3.0, 3.0), (1.0, 5.0), (0.0, 0.0), ()]
    trials = [Trial(i, {}, each, {"limit": 1.0 if i == 5 else 0.0}) for i, each in enumerate(values)]
    assert [trial.number for trial in not_beaten(trials, [False, False])] == [0, 1, 3]
    assert [trial.number for trial in not_beaten(trials, [True, True])] == [2, 3]
    assert not_beaten(trials[5:], [False, False]) == []
    assert not_beaten([], [False]) == []
