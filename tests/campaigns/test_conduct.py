"""A campaign from its file to its rows, its logs and its report, by function and by command."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace

import pytest
from typer.testing import CliRunner

import rumo
from rumo.campaigns import pilots
from rumo.campaigns.judging.criteria import Criterion
from rumo.campaigns.judging.kept import read_results
from rumo.campaigns.specification import Campaign
from rumo.campaigns.specification.going_on import as_begun
from rumo.campaigns.store import Store, read_rows
from rumo.cli.app import app
from rumo.scenarios import Recipe

pytest.importorskip("distributed")
pytest.importorskip("pyarrow")
runner = CliRunner(env={"COLUMNS": "120"})

FILE = """
[campaign]
runs = 6

[scenario]
base = "paper"
duration = 2.4
backend = "portable"

[vary]
mass = { distribution = "uniform", low = 180.0, high = 220.0 }
noise_scale = { distribution = "uniform", low = 0.5, high = 2.0 }

[criteria]
close = { kpi = "tracking_error_max_after_2s_m", at_most = 0.5 }
"""

TRUSTED = {"kpi": "fallbacks", "at_most": 0}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("files") / "small.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """Folder of the campaign, driven from Python."""
    return tmp_path_factory.mktemp("serial") / "out"


@pytest.fixture(scope="module")
def rows(file, serial):
    """Rows of the campaign, driven one after the other."""
    return rumo.campaign(file, serial, serial=True)


def lasting(rows):
    """Without what may differ from one time to the next."""
    kept = [name for name in rows.columns if not name.startswith("run.") and name != "attempts"]
    return rows[kept].sort_values("key").reset_index(drop=True)


def test_rows_from_python(rows):
    assert list(rows["outcome"]) == ["done"] * 6
    assert rows["setting.mass"].between(180.0, 220.0).all()
    assert rows["setting.mass"].nunique() == 6
    assert rows["setting.seed"].nunique() == 6
    assert (rows["kpi.tracking_error_rms_m"] > 0.0).all()


def test_by_command_there_are_the_same_rows_and_the_same_report(rows, serial, file, tmp_path):
    folder = tmp_path / "out"
    result = runner.invoke(app, ["campaign", str(file), "--output", str(folder), "--jobs", "2"])
    assert result.exit_code == 0, result.output
    assert lasting(read_rows(folder)).equals(lasting(rows))
    told = [line for line in result.stderr.splitlines() if "runs" in line]
    assert told[0] == "0/6 runs; the first ones say how long all take"
    assert told[-1].startswith("6/6 runs")
    assert "close, largest error after 2 s at most 0.5 m: RTI passes" in " ".join(
        result.stdout.split()
    ).lower().replace("rti", "RTI")
    assert "<title>Campaign out</title>" in (folder / "report.html").read_text(encoding="utf-8")
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert (summary["runs"], summary["complete"]) == (6, True)
    assert {path.relative_to(folder) for path in folder.rglob("*")} == {
        path.relative_to(serial) for path in serial.rglob("*")
    }
    other = json.loads((serial / "summary.json").read_text(encoding="utf-8"))
    assert other["worst"] == summary["worst"]
    kept = {run["key"] for run in summary["worst"]}
    assert kept == {path.stem for path in (folder / "logs").glob("*.nc")} == set(rows["key"])


def test_more_runs_other_criteria_and_fewer_runs(rows, file, tmp_path):
    path, folder = tmp_path / "small.toml", tmp_path / "out"
    more = FILE.replace("runs = 6", "runs = 8").replace("at_most = 0.5", "at_most = 0.4")
    for text, count in ((FILE, 6), (more, 8), (FILE, 6)):
        path.write_text(text, encoding="utf-8")
        rumo.campaign(path, folder, serial=True, report=False)
        assert len(read_results(folder).rows) == count
    assert len(read_rows(folder)) == 8
    assert not (folder / "report.html").exists()
    assert lasting(read_results(folder).rows).equals(lasting(rows))


def test_other_criteria_where_figures_are_chosen(tmp_path):
    """What rows know may be judged; of what they do not, it is said how to come to know it."""
    begun = Campaign(Recipe("paper"), {"mass": [200.0]}, kpis=("tracking_error_rms",), criteria={"trusted": TRUSTED})
    close = {"kpi": "tracking_error_rms_m", "at_most": 0.5}
    with Store(tmp_path, begun.plain, begun.identity):
        pass
    for kpis, criteria in ((("fallbacks",), {"close": close}), (("fallbacks",), {}), (begun.kpis, {})):
        again = as_begun(replace(begun, kpis=kpis, criteria=criteria), tmp_path)
        assert (again.identity, list(again.tasks)) == (begun.identity, list(begun.tasks))
        assert again.criteria.keys() == criteria.keys()
    far = {"far": {"kpi": "distance_m", "at_least": 9.0}}
    for change, said in (
        (
            {"criteria": far},
            r"criteria\.far\.kpi: got 'distance_m', which the rows in .* do not have, expected one of ",
        ),
        ({"kpis": ("distance",)}, r"^kpis: got 'distance', which .* do not have.* Name another folder"),
    ):
        with pytest.raises(rumo.ArgumentError, match=said):
            as_begun(replace(begun, **change), tmp_path)
    other = replace(begun, criteria=far, seed=3)
    assert as_begun(other, tmp_path) is other
    with pytest.raises(rumo.ArgumentError, match=r"of another campaign: .*campaign\.seed was 0, is 3"):
        Store(tmp_path, other.plain, other.identity)
    assert as_begun(begun, tmp_path / "nowhere") is begun


def test_criteria_and_settings_are_shown_in_the_order_of_the_file(tmp_path):
    vary = {"speed": [6.0, 8.0], "mass": [190.0, 210.0]}
    criteria = {"trusted": {"kpi": "fallbacks", "at_most": 0}, "close": {"kpi": "tracking_error_rms", "at_most": 0.3}}
    specification = rumo.Campaign(rumo.Recipe("paper"), vary, criteria=criteria).plain
    with Store(tmp_path, specification) as store:
        for draw, (speed, mass) in enumerate(((6.0, 190.0), (8.0, 210.0))):
            figures = {"kpi.fallbacks": 0, "kpi.tracking_error_rms_m": 0.1, "kpi.bad_commands": draw}
            settings = {"setting.speed": speed, "setting.mass": mass}
            store.add({"key": f"{draw:x}", "draw": draw, "controller": "rti", "outcome": "done", **settings, **figures})
        store.flush()
    results = read_results(tmp_path)
    assert [each.name for each in results.criteria] == ["trusted", "close"]
    assert results.varied == ("speed", "mass")
    assert results.figures == ("kpi.fallbacks", "kpi.tracking_error_rms_m", "kpi.bad_commands")


def test_another_campaign_in_the_folder(file, tmp_path):
    with Store(tmp_path / "out", {"another": 1}):
        pass
    result = runner.invoke(app, ["campaign", str(file), "--output", str(tmp_path / "out"), "--serial"])
    assert result.exit_code == 2
    assert "of another campaign" in result.output


def test_what_cannot_work_is_an_error_before_any_drive(file, tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(FILE.replace("mass =", "mas ="), encoding="utf-8")
    result = runner.invoke(app, ["campaign", str(path), "--output", str(tmp_path / "out"), "--serial"])
    assert result.exit_code == 2
    assert "small.toml, line 11: vary.mas: got 'mas', expected one of" in " ".join(result.output.split())
    assert not (tmp_path / "out").exists()


def test_what_only_a_drive_tells_is_said_by_its_line(file, tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(FILE.replace("tracking_error_max_after_2s_m", "input_variation_per_s.torqe"), encoding="utf-8")
    result = runner.invoke(app, ["campaign", str(path), "--output", str(tmp_path / "out"), "--serial"])
    assert result.exit_code == 2
    assert "small.toml, line 15: criteria.close.kpi: got 'input_variation_per_s.torqe'" in " ".join(
        result.output.split()
    )


@pytest.mark.parametrize(
    ("kpi", "part"),
    [
        ("input_variation_per_s.torqe", "one of input_variation_per_s.steering_rate, input_variation_per_s.torque"),
        ("input_variation_per_s", "one of input_variation_per_s.steering_rate, input_variation_per_s.torque"),
        ("fallbacks.x", "fallbacks, which has no parts"),
        ("lap_time_s", "'lap_time_s', which these drives do not have: they are along no path, expected one of "),
    ],
)
def test_a_criterion_of_what_the_first_runs_do_not_know(rows, kpi, part):
    criterion = Criterion("calm", kpi, at_most=1.0)
    with pytest.raises(rumo.ArgumentError, match=re.escape(part)):
        pilots.require_known([criterion], rows.to_dict("records"))


@pytest.mark.parametrize(
    ("figures", "kpi"),
    [
        ({"distance_m": 3.0, "lap_time_s": None}, "lap_time_s"),
        ({"tracking_error_rms_m": 0.1, "tracking_error_rms_after_2s_m": None}, "tracking_error_rms_after_2s_m"),
        ({"lap_time_s": None}, "lap_time_s"),
        ({"jerk_rms_m_s3": None}, "jerk_rms_m_s3"),
    ],
)
def test_what_other_drives_might_know_is_no_error(figures, kpi):
    row = {"outcome": "done", **{f"kpi.{name}": value for name, value in figures.items()}}
    pilots.require_known([Criterion("late", kpi, at_most=1.0)], [row])


def test_what_drives_without_a_point_cannot_know_is_an_error():
    row = {"outcome": "done", "kpi.tracking_error_rms_m": None, "kpi.fallbacks": 0}
    far = Criterion("far", "tracking_error_max_after_2s_m", at_most=1.0)
    with pytest.raises(rumo.ArgumentError, match=r"criteria\.far\.kpi: .*they follow no point.* one of fallbacks\."):
        pilots.require_known([far], [row])
    pilots.require_known([far], [{**row, "outcome": "raised"}])


def test_a_scheduler_that_is_not_there(file, tmp_path):
    result = runner.invoke(
        app, ["campaign", str(file), "--output", str(tmp_path / "out"), "--scheduler", "tcp://127.0.0.1:1"]
    )
    assert result.exit_code == 2
    assert "no scheduler answers" in " ".join(result.output.split())


@pytest.mark.parametrize("further", [["--jobs", "2"], ["--scheduler", "tcp://127.0.0.1:1"]])
def test_more_than_one_engine(file, tmp_path, further):
    result = runner.invoke(app, ["campaign", str(file), "--output", str(tmp_path / "out"), "--serial", *further])
    assert (result.exit_code, "one of them" in result.output) == (2, True)


def test_what_takes_longer_than_an_hour_has_to_be_meant(file, tmp_path):
    path, folder = tmp_path / "small.toml", tmp_path / "out"
    path.write_text(FILE.replace("runs = 6", "runs = 6000000"), encoding="utf-8")
    result = runner.invoke(app, ["campaign", str(path), "--output", str(folder), "--serial"])
    said = " ".join(result.output.split())
    assert result.exit_code == 2, said
    assert "runs: got 6000000, which would take about" in said
    assert "--yes" in said
    assert len(read_rows(folder)) == pilots.DRAWS  # those that were timed


@pytest.mark.parametrize(("last", "count"), [("rows/000001.parquet", 2), ("logs/[!.]*.nc", 6)])
def test_a_full_disk_is_told_and_the_next_start_goes_on(rows, file, tmp_path, monkeypatch, last, count):
    """Nothing can be written any more once the first rows, or all logs, are there."""
    folder, command = tmp_path / "out", ["campaign", str(file), "--output", str(tmp_path / "out"), "--serial"]
    replace = os.replace

    def replace_with_room(source, place):
        if len([*folder.glob(last)]) == (6 if "*" in last else 1):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), place)
        replace(source, place)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", replace_with_room)
        result = runner.invoke(app, command)
    assert result.exit_code == 2
    assert f"Error: {folder} cannot be written to: No space left on device" in result.stderr
    assert "Make room, and start again to go on." in result.stderr
    assert len(read_rows(folder)) == count
    assert not (folder / "report.html").exists()
    assert runner.invoke(app, command).exit_code == 0
    assert lasting(read_rows(folder)).equals(lasting(rows))


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is no signal to a process there")
def test_ctrl_c_keeps_what_is_done_and_the_next_start_goes_on(rows, file, tmp_path):
    folder = tmp_path / "out"
    command = [sys.executable, "-m", "rumo", "campaign", str(file), "--output", str(folder), "--serial"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        while not [*folder.glob("rows/*.parquet")]:  # the pilots' rows
            assert process.poll() is None
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=60.0)
    if process.returncode != 0:  # else it was done before
        assert process.returncode == 130, output
        assert "Incomplete" in output
        assert len(read_rows(folder)) >= pilots.DRAWS
    assert lasting(rumo.campaign(file, folder, serial=True)).equals(lasting(rows))
