"""Falsifications from files: what they say, what is wrong with them, and what drives come to."""

import json

import pytest
from typer.testing import CliRunner

import rumo
from rumo.campaigns.falsification import Falsification, falsify, read_falsification
from rumo.campaigns.rerun import rerun
from rumo.campaigns.specification.distributions import Integers
from rumo.cli.app import app
from rumo.errors import ArgumentError
from rumo.scenarios import Recipe
from rumo.simulation import load

pytest.importorskip("optuna")
pytest.importorskip("pyarrow")
runner = CliRunner(env={"COLUMNS": "120"})

TEXT = """
[falsify]
trials = 6
batch = 3
timeout = 60.0

[scenario]
base = "paper"
duration = 2.4
initial_error = 0.0
backend = "portable"

[[scenario.faults]]
kind = "Missing"
when = { from = 10, samples = 0 }
signals = ["p_y"]

[search]
"faults.0.when.from" = { distribution = "integers", low = 5, high = 15 }
"faults.0.when.samples" = { distribution = "integers", low = 0, high = 50 }
"faults.0.signals.0" = ["p_y", "psi"]

[size]
"faults.0.when.samples" = 0

[criteria]
close = { kpi = "tracking_error_rms_m", at_most = 0.24 }
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("files") / "dropout.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def test_a_file_says_all_of_it(file):
    what = read_falsification(file)
    assert (what.trials, what.batch, what.controller, dict(what.size)) == (6, 3, "rti", {"faults.0.when.samples": 0.0})
    assert what.search["faults.0.when.samples"] == Integers(0, 50)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("trials = 6", "trails = 6", "line 3: falsify.trails: got 'trails'"),
        ("low = 0, high = 50", "low = -1, high = 50", "line 20: search.faults.0.when.samples"),
        ('"faults.0.when.samples" = 0', '"faults.0.when.samples" = 60', "line 24: size.faults.0.when.samples: got 60"),
        ('["p_y", "psi"]', '["p_y", "yaw"]', "line 21: search.faults.0.signals.0"),
        ("tracking_error_rms_m", "tracking_error", "line 27: criteria.close.kpi"),
        ("[size]", "[sizes]", "sizes: got 'sizes'"),
    ],
)
def test_errors_say_where(file, tmp_path, old, new, message):
    path = tmp_path / "wrong.toml"
    path.write_text(TEXT.replace(old, new), encoding="utf-8")
    with pytest.raises(ArgumentError, match=message):
        read_falsification(path)


def test_by_command_with_drives(file, tmp_path):
    folder = tmp_path / "out"
    result = runner.invoke(app, ["falsify", str(file), "--output", str(folder), "--serial"])
    assert result.exit_code == 0, result.output
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    found = summary["found"]
    assert f"rumo rerun {folder} {found['key']}" in (folder / "report.html").read_text(encoding="utf-8")
    assert found["criteria"]["close"]["value"] > 0.24 >= found["held"]["close"]["value"]
    again = rerun(folder, found["key"])
    assert not again.differs
    assert (folder / "logs" / f"{found['key']}.nc").is_file()
    log = Recipe.from_toml(folder / "found.toml").run().run()
    assert log["true_states"].equals(load(folder / "logs" / f"{found['key']}.nc")["true_states"])
    other = runner.invoke(app, ["falsify", str(file), "--output", str(folder), "--serial", "--json"])
    assert json.loads(other.stdout) == summary
    (folder / "summary.json").unlink()
    rumo.falsify(file, folder, serial=True)
    assert json.loads((folder / "summary.json").read_text(encoding="utf-8")) == summary


def test_it_is_public():
    assert rumo.falsify is falsify
    assert rumo.Falsification is Falsification
