"""A tuning from its file to its best settings, with drives that are made up; one that drives."""

import json
import os
import shutil
from pathlib import Path

import pytest
from fake_drives import FakeEngine
from typer.testing import CliRunner

import rumo
from rumo.campaigns.rerun import rerun
from rumo.campaigns.store import read_rows
from rumo.campaigns.tuning import Check, Tuning, read_tuning
from rumo.campaigns.tuning.course import carry_out_tuning
from rumo.campaigns.tuning.report import report
from rumo.cli.app import app
from rumo.errors import ArgumentError, CampaignError
from rumo.report.figures import write_figures
from rumo.report.page import write_page
from rumo.scenarios import Recipe

pytest.importorskip("optuna")
pytest.importorskip("pyarrow")
runner = CliRunner(env={"COLUMNS": "120"})

EXAMPLE = Path(__file__).parents[2] / "examples" / "tune.toml"
RMS, TORQUE = "tracking_error_rms_after_2s_m", "input_variation_per_s.torque"
TEXT = """
[tune]
trials = 24
batch = 4
timeout = 60.0

[scenario]
base = "paper"
duration = 2.4
backend = "portable"

[search]
filter_cutoff = { distribution = "uniform", low = 1.0, high = 9.0 }

[search.problem.weights]
p_y = { distribution = "log-uniform", low = 0.1, high = 50.0 }

[over]
seed = { from = 100, to = 102 }

[objectives]
error = { kpi = "tracking_error_rms_after_2s_m" }

[limits]
torque = { kpi = "input_variation_per_s.torque", times_base = 1.5 }

[check]
vary = { seed = { from = 0, to = 11 } }
scenario = { duration = 3.0 }
"""
BASE = {"filter_cutoff": 3.5, "problem.weights.p_y": 1.0}


@pytest.fixture(autouse=True)
def _no_waiting_for_disks(monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)


@pytest.fixture(scope="module")
def tuning(tmp_path_factory):
    path = tmp_path_factory.mktemp("files") / "tune.toml"
    path.write_text(TEXT, encoding="utf-8")
    return read_tuning(path)


def drive(settings):
    """Less error with more weight and a faster filter, and more torque; each seed has its own share of it."""
    settings = BASE | settings
    weight, chance = settings["problem.weights.p_y"], 1.0 + 0.01 * (settings["seed"] % 7)
    error = chance * (0.1 + 0.2 / weight + 0.02 * abs(settings["filter_cutoff"] - 6.0))
    torque = chance * (1.0 + 0.1 * weight)
    return {f"kpi.{RMS}": error, f"kpi.{TORQUE}": torque}


def tuned(tuning, folder, of=drive, most=None):
    engine = FakeEngine(of, most)
    return carry_out_tuning(tuning, folder, engine), engine


@pytest.fixture(scope="module")
def whole(tuning, tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "tune"
    return (*tuned(tuning, folder), folder)


def test_what_is_found_is_better_and_within_the_limit(tuning, whole):
    found, engine, folder = whole
    assert len(found.trials) == 24
    assert found.trials[0].settings == BASE
    (best,) = found.best
    mean = sum(1.0 + 0.01 * (seed % 7) for seed in (100, 101, 102)) / 3
    weight, cutoff = best.settings["problem.weights.p_y"], best.settings["filter_cutoff"]
    assert best.values[0] == pytest.approx(mean * (0.1 + 0.2 / weight + 0.02 * abs(cutoff - 6.0)))
    assert 1.5 < weight <= 6.5  # 1.5 times 1.1 is the torque of 6.5
    assert best.values[0] == min(trial.values[0] for trial in found.trials if trial.feasible)
    assert len(found.judged.before) == len(found.judged.after) == 12
    assert len(engine.driven) == len({*engine.driven}) == 3 * (1 + 24) + 2 * 12
    assert len(read_rows(folder)) == len(engine.driven)
    assert Recipe.from_toml(folder / "best.toml") == tuning.recipe.with_settings(best.settings) == found.recipe


@pytest.mark.parametrize("most", [0, 2, 3, 10, 41, 76, 90])
def test_interrupted_it_goes_on_to_the_same(most, tuning, whole, tmp_path):
    folder = tmp_path / "tune"
    if most < 3:  # drives without tuning
        with pytest.raises(KeyboardInterrupt):
            tuned(tuning, folder, most=most)
    else:
        stopped, _ = tuned(tuning, folder, most=most)
        assert isinstance(stopped.stopped, KeyboardInterrupt)
        assert stopped.trials == whole[0].trials[: len(stopped.trials)]
        assert report(stopped, folder).summary["complete"] is False
    found, engine = tuned(tuning, folder)
    assert found.trials == whole[0].trials
    assert found.importance == whole[0].importance
    assert len(engine.driven) == len(whole[1].driven) - most
    assert report(found, "tune").summary == report(whole[0], "tune").summary
    again, engine = tuned(tuning, folder)
    assert engine.driven == []
    assert again.best == found.best


def test_with_more_trials_it_goes_on(tuning, whole, tmp_path):
    shutil.copytree(whole[2], tmp_path / "tune")
    more = Tuning(**{**_arguments(tuning), "trials": 32})
    found, engine = tuned(more, tmp_path / "tune")
    assert found.trials[:24] == whole[0].trials
    assert len(found.trials) == 32
    assert len(engine.driven) in (24, 36)  # the check again, if a better one was found


def _arguments(tuning, **others):
    names = ("recipe", "search", "over", "objectives", "limits", "trials", "batch", "sampler", "timeout", "check")
    return {name: getattr(tuning, name) for name in names} | others


def test_drives_that_fail_do_not_end_it(tuning, tmp_path):
    def failing(settings):
        weight = settings.get("problem.weights.p_y", 1.0)
        if weight > 20.0:
            return "crashed", "signal 11 (SIGSEGV)"
        if weight > 10.0:
            return "timeout", "not done after 60 s"
        if weight > 5.0:
            return "raised", "PlantError: lost"
        return {"kpi.fallbacks": 1} if weight < 0.3 else drive(settings)

    found, _ = tuned(tuning, tmp_path / "tune", failing)
    failed = [trial for trial in found.trials if not trial.values]
    assert len(found.trials) == 24
    assert failed
    assert found.best
    content = report(found, "tune").summary
    assert content["trials"]["failed"] == len(failed)
    assert {each["outcome"] for each in content["failures"]} <= {"crashed", "timeout", "raised"}
    assert sum(each["drives"] for each in content["failures"]) == len(found.failed)
    assert all({*BASE, "seed"} == {*each["settings"]} for each in content["failures"])


@pytest.mark.parametrize(
    ("of", "message"),
    [
        (lambda settings: ("raised", "PlantError: lost"), "objectives.error asks. raised: PlantError: lost"),
        (lambda settings: {f"kpi.{RMS}": 1.0, "kpi.input_variation_per_s.brake": 1.0}, r"they have .*\.brake"),
        (lambda settings: {f"kpi.{RMS}": float("nan")}, "objectives.error asks"),
    ],
)
def test_without_drives_to_compare_with_there_is_no_tuning(of, message, tuning, tmp_path):
    with pytest.raises(CampaignError, match=message):
        tuned(tuning, tmp_path / "tune", of)


def test_a_folder_has_one_tuning(tuning, whole):
    other = Tuning(**_arguments(tuning, sampler="random"))
    with pytest.raises(ArgumentError, match="of another campaign, with another tune"):
        tuned(other, whole[2])
    with pytest.raises(ArgumentError, match="which has a search, expected the folder of a campaign"):
        rerun(whole[2], whole[1].driven[0])


def test_two_objectives_have_a_front(tuning, tmp_path):
    goals = {"error": {"kpi": RMS}, "calm": {"kpi": TORQUE, "of": "max"}}
    two = Tuning(**_arguments(tuning, objectives=goals, limits={}, sampler="nsga2", trials=60))
    found, _ = tuned(two, tmp_path / "tune")
    assert len(found.best) > 3
    assert {path.name for path in (tmp_path / "tune").glob("best*.toml")} == {
        "best.toml",
        *(f"best-{trial.number}.toml" for trial in found.best[1:]),
    }
    costs = [trial.values for trial in found.best]
    assert found.best[0].values not in (min(costs), max(costs))  # in the middle of the front
    shown = report(found, "tune")
    assert "front-error-calm" in {figure.key for figure in shown.figures}
    assert len(shown.summary["best"]) == len(found.best)


def test_more_may_be_better_and_less_may_be_the_limit(tuning, tmp_path):
    goals = {"error": {"kpi": RMS, "maximise": True}}
    most = Tuning(**_arguments(tuning, objectives=goals, limits={"least": {"kpi": TORQUE, "at_least": 1.3}}))
    found, _ = tuned(most, tmp_path / "tune")
    (best,) = found.best
    assert best.settings["problem.weights.p_y"] > 2.5
    assert best.values[0] == max(trial.values[0] for trial in found.trials if trial.feasible)


def test_where_nothing_is_within_the_limits_nothing_is_best(tuning, tmp_path):
    none = Tuning(**_arguments(tuning, limits={"torque": {"kpi": TORQUE, "at_most": 0.5}}))
    found, _ = tuned(none, tmp_path / "tune")
    assert found.recipe is None
    assert found.judged is None
    assert not (tmp_path / "tune" / "best.toml").exists()
    assert "None of the 24 trials is within the limits" in report(found, "tune").sections[0].content[0]


def test_lists_and_whole_numbers_can_be_searched(tuning, tmp_path):
    search = {"horizon": [5, 10, 15], "estimator": ["butterworth", "none"], "problem.weights.p_y": range(1, 9)}
    listed = Tuning(**_arguments(tuning, search=search, limits={}))

    def of(settings):
        return drive({"seed": settings["seed"], "filter_cutoff": settings.get("horizon", 10) / 2})

    found, _ = tuned(listed, tmp_path / "tune", of)
    assert found.trials[0].settings == {"horizon": 15, "estimator": "butterworth", "problem.weights.p_y": 1}
    assert type(found.best[0].settings["horizon"]) is int
    shown = report(found, "tune")
    heads = [item.heads[0] for section in shown.sections for item in section.content if hasattr(item, "heads")]
    assert "estimator" in heads


def test_the_report_says_what_was_gained(whole, tmp_path):
    shown = report(whole[0], "tune")
    json.dumps(shown.summary, allow_nan=False)
    error, torque = shown.summary["objectives"]["error"], shown.summary["limits"]["torque"]
    assert error["check"]["ratio"] == pytest.approx(error["check"]["after"] / error["check"]["before"])
    low, high = error["check"]["interval"]
    assert low < error["check"]["difference"] < high < 0.0
    assert torque["tuning"]["at_most"] == pytest.approx(1.5 * torque["tuning"]["before"])
    assert torque["check"]["held_after"] is True
    assert "Error: mean RMS error after 2 s over 12 drives that it did not know" in str(shown.sections[0].content[0])
    write_page(tmp_path / "report.html", shown)
    write_figures(shown.figures, tmp_path)
    assert {"history-error.png", "over-settings-error.png"} <= {path.name for path in tmp_path.glob("*.png")}
    assert len((tmp_path / "report.html").read_bytes()) < 2_000_000


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("trials = 24", "trials = 0", r"line 3: trials: got 0"),
        ("trials = 24", "trails = 24", r"line 3: tune.trails: .*Did you mean 'trials'"),
        ("batch = 4", 'sampler = "tpa"', r"line 4: sampler: .*Did you mean 'tpe'"),
        ("batch = 4", 'storage = "tune.db"', r"line 4: storage: .*sqlite:///tune.db"),
        ("batch = 4", "runs = 2", r"line 4: runs: got 2, expected at least 3"),
        ("p_y = {", "q_y = {", r"line 16: search.problem.weights.q_y: .*p_y"),
        ("low = 1.0, high = 9.0", "low = 1.0, high = 900.0", r"line 13: search.filter_cutoff: got 900.0"),
        ('"uniform", low = 1.0, high = 9.0', '"normal", mean = 1.0, std = 9.0', r"line 13: .*a distribution with ends"),
        ("[over]\nseed", "[over]\nsead", r"line 19: over.sead: .*seed"),
        ("[over]\nseed", "[over]\nfilter_cutoff", r"over.filter_cutoff: got a setting that is searched for"),
        ('kpi = "tracking', 'kbi = "tracking', r"line 22: objectives.error.kbi: .*Did you mean 'kpi'"),
        ('"tracking_error_rms_after_2s_m"', '"tracking"', r"line 22: objectives.error.kpi: got 'tracking'"),
        ('"tracking_error_rms_after_2s_m"', '"fallbacks", of = "meen"', r"objectives.error.of: .*Did you mean 'mean'"),
        ('"tracking_error_rms_after_2s_m"', '"fallbacks", maximise = 1', r"objectives.error.maximise: got 1"),
        ("times_base = 1.5", "times_base = -1.0", r"line 25: limits.torque.times_base: got -1.0"),
        (", times_base = 1.5", "", r"line 25: limits.torque: got no limit"),
        ("times_base = 1.5", "at_most = 1, at_least = 2", r"limits.torque: .*something between them"),
        ("from = 0, to = 11", "from = 0, to = 101", r"line 28: check.vary.seed: got 100, which trials drive too"),
        ("duration = 3.0", "durations = 3.0", r"line 29: check.scenario.durations: .*duration"),
        ("duration = 3.0", "filter_cutoff = 3.0", r"check.scenario.filter_cutoff: got a setting that is searched"),
        ('base = "paper"', 'base = "papers"', r"line 8: scenario.base: .*Did you mean 'paper'"),
        ("[limits]", "[limit]", r"limit: .*Did you mean 'limits'"),
    ],
)
def test_what_cannot_work_is_said_before_any_drive(old, new, message, tmp_path):
    path = tmp_path / "tune.toml"
    assert old in TEXT
    path.write_text(TEXT.replace(old, new), encoding="utf-8")
    with pytest.raises(ArgumentError, match=rf"tune\.toml, {message}|tune\.toml, line \d+: {message}"):
        read_tuning(path)


def test_several_objectives_need_a_sampler_that_takes_them(tuning):
    goals = {"error": {"kpi": RMS}, "calm": {"kpi": TORQUE}}
    with pytest.raises(ArgumentError, match="one objective, or sampler tpe or nsga2 or random"):
        Tuning(**_arguments(tuning, objectives=goals, sampler="cma-es"))
    with pytest.raises(ArgumentError, match=r"search\.controller"):
        Tuning(**_arguments(tuning, search={"controller": ["rti", "ltv"]}))
    with pytest.raises(ArgumentError, match=r"check: .*expected a rumo\.campaigns\.tuning\.Check"):
        Tuning(**_arguments(tuning, check={"vary": {}}))


def test_plain_data_make_the_same_tuning(tuning):
    from rumo.campaigns.tuning.reading import tuning_of

    again = tuning_of(json.loads(json.dumps(tuning.plain)))
    assert again.plain == tuning.plain
    assert again.identity == tuning.identity
    other = Tuning(**_arguments(tuning, trials=99, check=Check({"seed": range(40)})))
    assert other.identity == tuning.identity
    assert Tuning(**_arguments(tuning, limits={})).identity != tuning.identity


def test_another_controller_is_in_the_file(tuning):
    other = Tuning(**_arguments(tuning), controller="ltv")
    assert other.with_best({"filter_cutoff": 4.0}).settings["controller"] == "ltv"
    assert "controller" not in tuning.with_best({"filter_cutoff": 4.0}).settings


def test_by_command_and_from_python_it_drives(tmp_path):
    path, folder = tmp_path / "small.toml", tmp_path / "out"
    small = TEXT.replace("trials = 24", "trials = 3").replace("to = 102", "to = 101")
    path.write_text(small[: small.index("[check]")], encoding="utf-8")
    result = runner.invoke(app, ["tune", str(path), "--output", str(folder), "--serial", "--json"])
    assert result.exit_code == 0, result.output
    summary = json.loads(result.stdout)
    assert summary["trials"]["done"] == 3
    assert summary == json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert "<title>Tuning out</title>" in (folder / "report.html").read_text(encoding="utf-8")
    found = rumo.tune(path, folder, serial=True)
    assert [trial.number for trial in found.trials] == [0, 1, 2]
    assert found.best[0].values == tuple(summary["best"][0]["values"])
    again = runner.invoke(app, ["tune", str(path), "--output", str(folder), "--serial", "--jobs", "2"])
    assert again.exit_code == 2
    assert "serial" in again.stderr


def test_the_command_ends_with_130_and_says_how_to_go_on(tuning, tmp_path, monkeypatch):
    from rumo.campaigns import conduct

    path = tmp_path / "tune.toml"
    path.write_text(TEXT, encoding="utf-8")
    monkeypatch.setattr(conduct, "engine_of", lambda *_, **__: FakeEngine(drive, 20))
    result = runner.invoke(app, ["tune", str(path), "--output", str(tmp_path / "out")])
    assert result.exit_code == 130
    assert "4 of 24 trials are done, and started again it goes on, then: interrupted" in " ".join(
        (result.stdout + result.stderr).split()
    )
    assert json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["complete"] is False


def test_the_example_can_be_tuned():
    assert read_tuning(EXAMPLE).trials == 200


@pytest.mark.slow
def test_the_example_halves_the_papers_error_with_no_more_input_variation(tmp_path):
    pytest.importorskip("distributed")
    found = report(rumo.tune(EXAMPLE, tmp_path / "tune"), "tune").summary
    assert found["objectives"]["tracking"]["check"]["ratio"] <= 0.45
    assert all(limit["check"]["held_after"] for limit in found["limits"].values())
    assert found["trials"]["failed"] == 0
