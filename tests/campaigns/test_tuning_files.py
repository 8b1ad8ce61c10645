"""What tunings are read from, and what cannot be one; by command and from Python, and the example."""

import json
from pathlib import Path

import pytest
from fake_drives import FakeEngine
from fake_tuning import RMS, TEXT, TORQUE, arguments, drive
from typer.testing import CliRunner

import rumo
from rumo.campaigns import conduct
from rumo.campaigns.rerun import rerun
from rumo.campaigns.store import read_rows
from rumo.campaigns.tuning import Check, Tuning, read_tuning
from rumo.campaigns.tuning.reading import tuning_of
from rumo.campaigns.tuning.report import report
from rumo.cli.app import app
from rumo.errors import ArgumentError

pytest.importorskip("optuna")
pytest.importorskip("pyarrow")
pytestmark = pytest.mark.usefixtures("quick_disks")
runner = CliRunner(env={"COLUMNS": "120"})
EXAMPLE = Path(__file__).parents[2] / "examples" / "tune.toml"


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
        Tuning(**arguments(tuning, objectives=goals, sampler="cma-es"))
    with pytest.raises(ArgumentError, match=r"search\.controller"):
        Tuning(**arguments(tuning, search={"controller": ["rti", "ltv"]}))
    with pytest.raises(ArgumentError, match=r"check: .*expected a rumo\.campaigns\.tuning\.Check"):
        Tuning(**arguments(tuning, check={"vary": {}}))


def test_plain_data_make_the_same_tuning(tuning):
    again = tuning_of(json.loads(json.dumps(tuning.plain)))
    assert again.plain == tuning.plain
    assert again.identity == tuning.identity
    other = Tuning(**arguments(tuning, trials=99, check=Check({"seed": range(40)})))
    assert other.identity == tuning.identity
    assert Tuning(**arguments(tuning, limits={})).identity != tuning.identity


def test_another_controller_is_in_the_file(tuning):
    other = Tuning(**arguments(tuning), controller="ltv")
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
    (folder / "report.html").unlink()
    found = rumo.tune(path, folder, serial=True)
    assert summary == json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert "<title>Tuning out</title>" in (folder / "report.html").read_text(encoding="utf-8")
    assert [trial.number for trial in found.trials] == [0, 1, 2]
    assert found.best[0].values == tuple(summary["best"][0]["values"])
    for row in (read_rows(folder).iloc[0], read_rows(folder).iloc[-1]):
        assert not rerun(folder, row["key"]).differs
    again = runner.invoke(app, ["tune", str(path), "--output", str(folder), "--serial", "--jobs", "2"])
    assert again.exit_code == 2
    assert "serial" in again.stderr


def test_the_command_ends_with_130_and_says_how_to_go_on(tuning, tmp_path, monkeypatch):
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
