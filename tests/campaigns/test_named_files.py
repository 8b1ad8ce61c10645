"""Files among the values of what varies: found beside the file that names them, and part of keys by what they hold."""

import json

import pytest

import rumo
from rumo.campaigns.falsification.reading import falsification_of
from rumo.campaigns.rerun import rerun
from rumo.campaigns.specification import Campaign
from rumo.campaigns.specification.reading import varied_in
from rumo.campaigns.store import Store
from rumo.campaigns.tasks.task import ChangedError
from rumo.campaigns.tuning.reading import tuning_of
from rumo.campaigns.work import run, task_run
from rumo.scenarios import Recipe
from rumo.scenarios.files import read_tables

OWN = """
from typing import Annotated
from pathlib import Path
from rumo.scenarios import Argument, Recipe

def make(*, load: Annotated[str, Argument("1", "Of what is carried.", file=True)] = "none", duration: float = 0.2):
    mass = float(Path(load).read_text()) if load != "none" else 200.0
    return Recipe("paper", {"mass": mass, "duration": duration, "backend": "portable"}).run()
"""
TEXT = """
[campaign]
kpis = ["tracking_error_rms"]
runs = 4

[scenario]
base = "own.py:make"

[vary]
seed = [0]
load = ["none", "empty.txt", "full.txt"]
"""


@pytest.fixture
def file(tmp_path):
    for name, text in {"own.py": OWN, "empty.txt": "190", "full.txt": "230", "campaign.toml": TEXT}.items():
        (tmp_path / name).write_text(text)
    return tmp_path / "campaign.toml"


def tables_of(file, **others):
    return {name: table for name, table in read_tables(file).items() if name == "scenario"} | others


def campaign_of(file, *, by_chance=False):
    if by_chance:
        table = 'load = { distribution = "choice", among = ["none", "empty.txt", "full.txt"] }'
        file.write_text(TEXT.replace('load = ["none", "empty.txt", "full.txt"]', table))
    text = file.read_text() if by_chance else TEXT.replace("runs = 4", "")
    file.write_text(text)
    return Campaign.from_toml(file)


@pytest.mark.parametrize("by_chance", [False, True])
def test_keys_follow_what_is_in_files(file, by_chance):
    def keys():
        campaign = campaign_of(file, by_chance=by_chance)
        return campaign.identity, {(each["draw"], each["settings"]["load"]): each["key"] for each in campaign.tasks}

    (identity, before), whole = (
        keys(),
        {name: str((file.parent / name).resolve()) for name in ("empty.txt", "full.txt")},
    )
    assert {load for _, load in before} == {"none", *whole.values()}
    assert str(file.parent) not in json.dumps(identity)
    (file.parent / "full.txt").write_text("240")
    other, after = keys()
    assert other != identity
    assert {load for (draw, load), key in after.items() if before[draw, load] != key} == {whole["full.txt"]}
    (file.parent / "full.txt").write_text("230")
    assert keys() == (identity, before)


def test_where_files_are_does_not_matter(file, tmp_path):
    there = tmp_path / "moved"
    there.mkdir()
    before = [task["key"] for task in campaign_of(file).tasks]
    for path in (*tmp_path.glob("*.txt"), tmp_path / "own.py", file):
        path.rename(there / path.name)
    assert [task["key"] for task in Campaign.from_toml(there / file.name).tasks] == before


def test_a_file_that_changes_while_the_campaign_goes_on_is_named(file):
    campaign = campaign_of(file)
    task = list(campaign.tasks)[2]
    assert run(campaign.common, task)["outcome"] == "done"
    (file.parent / "full.txt").write_text("240")
    assert campaign.task(2, "rti") == task
    with pytest.raises(ChangedError, match=r"a file has changed .*full\.txt has other content"):
        task_run(campaign.common, task)
    (file.parent / "full.txt").unlink()
    with pytest.raises(rumo.ArgumentError, match=r"a file has changed .*full\.txt was file \w{8}, is nothing"):
        task_run(campaign.common, task)
    (file.parent / "own.py").write_text(OWN.replace("200.0", "210.0"))
    with pytest.raises(rumo.ArgumentError, match=r"a file has changed .*\(base has other content\)"):
        task_run(campaign.common, next(iter(campaign.tasks)))
    (file.parent / "own.py").write_text("def make(")
    with pytest.raises(
        ChangedError, match=r"raises SyntaxError: .* not so where the campaign began, .* start it again"
    ):
        task_run(campaign.common, next(iter(campaign.tasks)))


def test_from_python_they_are_relative_to_the_current_folder(file, monkeypatch):
    monkeypatch.chdir(file.parent)
    campaign = Campaign(Recipe("own.py:make", {"load": "empty.txt"}), {"load": ["full.txt"]})
    assert campaign.recipe.settings["load"] == str((file.parent / "empty.txt").resolve())
    assert campaign.vary["load"].values == [str((file.parent / "full.txt").resolve())]


def test_a_folder_of_other_files_is_refused_and_its_runs_are_not_made_again(file, tmp_path):
    pytest.importorskip("pyarrow")
    campaign, out = campaign_of(file), tmp_path / "out"
    task = list(campaign.tasks)[2]
    with Store(out, campaign.plain, campaign.identity) as store:
        store.add({"key": task["key"], "draw": 2, "controller": "rti", "outcome": "done"})
        store.flush()
    (file.parent / "full.txt").write_text("240")
    said = r"of another campaign: vary\.load was with file \w{8}, is with file \w{8}, expected"
    with pytest.raises(rumo.ArgumentError, match=said):
        rumo.campaign(file, out, serial=True)
    with pytest.raises(rumo.ArgumentError, match=r"key: .*: vary\.load was with .* expected a run of which nothing"):
        rerun(out, task["key"])


def test_searches_have_files_too(file):
    folder, whole = file.parent, str((file.parent / "full.txt").resolve())
    choice = {"load": ["none", "full.txt"], "wind_mean": {"distribution": "uniform", "low": 0.0, "high": 2.0}}
    goal = {"error": {"kpi": "tracking_error_rms_m"}}
    check = {"vary": {"seed": [7]}, "scenario": {"load": "empty.txt"}}
    tables = tables_of(file, objectives=goal, check=check)

    def made():
        tune = tables | {"search": {"duration": [0.2, 0.4]}, "over": {"seed": [1], "load": ["full.txt"]}}
        chosen = tables | {"search": {"load": ["none", "full.txt"]}, "over": {"seed": [1]}}
        chosen.pop("check")
        limit = {"close": {"kpi": "tracking_error_rms_m", "at_most": 1.0}}
        upset = tables_of(file, search=choice, size={"wind_mean": 0.0}, criteria=limit)
        return tuning_of(tune, folder), tuning_of(chosen, folder), falsification_of(upset, folder)

    before = made()
    assert before[0].drives.vary["load"].values == [whole]
    assert before[0].judged.recipe.settings["load"] == str((folder / "empty.txt").resolve())
    assert [search.search["load"].values for search in before[1:]] == [["none", whole]] * 2
    keys = [each.drives.task(0, "rti", {"load": whole})["key"] for each in before[1:]]
    identities = [each.identity for each in before]
    (folder / "full.txt").write_text("240")
    after = made()
    assert [new.identity != old for new, old in zip(after, identities, strict=True)] == [True] * 3
    again = [each.drives.task(0, "rti", {"load": whole})["key"] for each in after[1:]]
    assert [new != old for new, old in zip(again, keys, strict=True)] == [True] * 2


def test_what_is_said_twice_or_says_nothing_is_refused(file):
    recipe = Recipe("paper")
    for vary, said in (
        ({"speed": {}}, r"vary\.speed: got an empty table, expected a list"),
        ({"plant": {"mu": {}}}, r"vary\.plant\.mu: got an empty table"),
    ):
        with pytest.raises(rumo.ArgumentError, match=said):
            varied_in({"vary": vary}, "vary", recipe, file.parent)
