"""Ctrl-C at any moment: what was done is written and marked, and nothing false is."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from threading import Timer

import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

import rumo.bench
import rumo.report.figures
import rumo.report.page
from rumo.cli.app import app
from rumo.cli.sequence import run_study
from rumo.references import SinePath
from rumo.references.base import OfTime
from rumo.simulation import Scenario, load
from rumo.studies import PaperStudy
from rumo.studies.base import carry_out
from rumo.studies.linearization import LinearizationStudy
from rumo.studies.linearization.study import SweptRun

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT for a child alone")
EXIT = Exception  # of Typer, which has moved it from version to version
INTERRUPTED = (130, -signal.SIGINT)
"""While Python itself starts, it is the signal that ends it; a shell says 130 as well."""


def interrupted(arguments, seconds):
    """A command that gets Ctrl-C some time after it has begun to work: its exit code, and its standard error."""
    command = [sys.executable, "-m", "rumo", *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        first = process.stderr.readline()
        time.sleep(seconds)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120)
    return process.returncode, first + errors


def assert_true_as_far_as_it_goes(folder, code, errors):
    assert code in INTERRUPTED, errors
    assert "Traceback" not in errors
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]
    content = json.loads((folder / "summary.json").read_text())
    assert content["complete"] is False
    assert "Incomplete" in (folder / "report.html").read_text()
    for sweep in content["sweeps"].values():
        for runs in sweep["controllers"].values():
            assert len(runs) == len(sweep["values"])
            for value, run in zip(sweep["values"], runs, strict=True):
                # Neither is lost within 3 m of the path, nor without a solution.
                assert value > 3.0 or (run["lost"], run["unsolved_share"]) == (False, 0.0)


@pytest.mark.parametrize("trial", range(3))
def test_ctrl_c_at_a_random_time_claims_nothing_false(tmp_path, monkeypatch, trial):
    timer = Timer(random.Random(trial).uniform(0.0, 1.5), os.kill, (os.getpid(), signal.SIGINT))

    def started(*arguments):
        timer.start()
        yield from carry_out(*arguments)

    monkeypatch.setattr("rumo.studies.base.carry_out", started)
    monkeypatch.setattr(rumo.report.figures, "write_figures", lambda *_: None)
    with pytest.raises(EXIT) as end:
        run_study(LinearizationStudy(("nlp", "rti"), {"initial_error": range(9)}), tmp_path, quiet=True)
    assert_true_as_far_as_it_goes(tmp_path, end.value.exit_code, "")


@pytest.mark.slow
@pytest.mark.parametrize("trial", range(20))
def test_an_interrupted_study_claims_nothing_false(tmp_path, trial):
    arguments = ["study", "linearization", "--controllers", "nlp,rti", "--sweeps", "initial_error"]
    code, errors = interrupted([*arguments, "--output", tmp_path], random.Random(trial).uniform(0.0, 8.0))
    assert_true_as_far_as_it_goes(tmp_path, code, errors)


def test_an_interrupted_drive_is_kept_and_marked(tmp_path):
    code, errors = interrupted(["study", "paper", "--controllers", "nlp", "--output", tmp_path], 1.0)
    assert code in INTERRUPTED, errors
    log = load(tmp_path / "log-nlp.nc")
    assert log.attrs["complete"] == "no"
    assert log.sizes["time"] < 600
    assert json.loads((tmp_path / "summary.json").read_text())["controllers"] == {}


@pytest.fixture
def stopped(tmp_path):
    """Runs a tiny study; what stopped it, the summary and the page."""
    study = LinearizationStudy(("rti",), {"speed": (8.0, 9.0, 10.0)}, duration=0.4)

    def run(expected):
        with pytest.raises(expected) as caught:
            run_study(study, tmp_path, quiet=True)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
        content, page = json.loads((tmp_path / "summary.json").read_text()), (tmp_path / "report.html").read_text()
        assert content["complete"] is False
        return caught.value, content, page

    return run


def ctrl_c(*_):
    signal.raise_signal(signal.SIGINT)


def test_a_swallowed_interrupt_is_not_forgotten(stopped, monkeypatch):
    drive, drives = SweptRun.run, iter(range(9))

    def swallowing(self, *, progress=None):
        log = drive(self, progress=progress)
        if next(drives) == 1:
            try:
                ctrl_c()
            except KeyboardInterrupt:
                log = log.isel(time=slice(0, 3))  # as if the plant had failed
        return log

    monkeypatch.setattr(SweptRun, "run", swallowing)
    end, content, page = stopped(EXIT)
    assert end.exit_code == 130
    assert content["sweeps"]["speed"]["values"] == [8.0]
    assert "1 of 3 runs were done, then: interrupted." in page


def test_an_error_in_a_run_leaves_the_others(stopped, monkeypatch):
    drive, drives = SweptRun.run, iter(range(9))

    def failing(self, *, progress=None):
        return drive(self, progress=progress) if next(drives) < 2 else 1 / 0

    monkeypatch.setattr(SweptRun, "run", failing)
    _, content, page = stopped(ZeroDivisionError)
    assert content["sweeps"]["speed"]["values"] == [8.0, 9.0]
    assert "2 of 3 runs were done, then: ZeroDivisionError: division by zero." in page


@pytest.mark.parametrize("presses", [1, 3])
@pytest.mark.parametrize("place", ["report", "page", "figures"])
def test_ctrl_c_at_the_end_leaves_summary_and_page(stopped, monkeypatch, place, presses):
    owner, name = {
        "report": (LinearizationStudy, "report"),
        "page": (rumo.report.page, "write_page"),
        "figures": (rumo.report.figures, "write_figures"),
    }[place]
    works, pressed = getattr(owner, name), iter(range(presses))

    def interrupted(*arguments):
        for _ in pressed:
            ctrl_c()
        return works(*arguments)

    monkeypatch.setattr(owner, name, interrupted)
    end, content, page = stopped(EXIT)
    assert end.exit_code == 130
    assert content["sweeps"]["speed"]["values"] == [8.0, 9.0, 10.0]
    assert "3 of 3 runs were done, then: interrupted." in page


def test_ctrl_c_in_the_benchmark_leaves_what_was_measured(monkeypatch):
    monkeypatch.setitem(rumo.bench.RUNNERS, "nlp", lambda recording: ctrl_c)
    arguments = ["bench", "--steps", "100", "--horizon", "2", "--controllers", "nlp", "--json"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 130
    content = json.loads(result.stdout)
    assert content["complete"] is False
    assert list(content["controllers"]) == ["rti"]


def test_nothing_of_an_earlier_study_stays_beside_what_is_written(tmp_path, monkeypatch):
    study = PaperStudy(("rti", "ltv"), duration=0.08)
    monkeypatch.setattr(rumo.report.figures, "draw", lambda _: Figure())
    run_study(study, tmp_path, quiet=True)
    for name in ("log-rti.nc", "log-ltv.nc", "summary.json", "wind.png", "step-time-ltv.pdf"):
        assert (tmp_path / name).exists()
    mine = [tmp_path / name for name in ("map.png", "run.nc", "notes-wind.pdf")]
    for path in mine:
        path.write_text("mine")
    monkeypatch.setattr(Scenario, "run", ctrl_c)
    with pytest.raises(EXIT):
        run_study(study, tmp_path, quiet=True)
    assert set(tmp_path.iterdir()) == {*mine, tmp_path / "summary.json", tmp_path / "report.html"}


def test_what_was_driven_before_an_error_is_kept(tmp_path, monkeypatch):
    looks = iter(range(3))

    def preview(path, times, x):
        if next(looks, None) is None:
            raise RuntimeError("no more")
        return OfTime.preview(path, times, x)

    monkeypatch.setattr(SinePath, "preview", preview)
    monkeypatch.setattr(rumo.report.figures, "write_figures", lambda *_: None)
    with pytest.raises(RuntimeError, match="no more"):
        run_study(PaperStudy(("rti",), duration=0.4), tmp_path, quiet=True)
    log = load(tmp_path / "log-rti.nc")
    assert (log.sizes["time"], log.attrs["complete"]) == (3, "no")
