"""Ctrl-C at any moment: what was done is written and marked, and nothing false is."""

import json
import random
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT for a child alone")
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


@pytest.mark.parametrize("trial", [*range(3), *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 20))])
def test_an_interrupted_study_claims_nothing_false(tmp_path, trial):
    arguments = ["study", "linearization", "--controllers", "nlp,rti", "--sweeps", "initial_error"]
    code, errors = interrupted([*arguments, "--output", tmp_path], random.Random(trial).uniform(0.0, 8.0))
    assert_true_as_far_as_it_goes(tmp_path, code, errors)


def test_an_interrupted_drive_is_kept_and_marked(tmp_path):
    from rumo.simulation import load

    code, errors = interrupted(["study", "paper", "--controllers", "nlp", "--output", tmp_path], 2.0)
    assert code in INTERRUPTED, errors
    log = load(tmp_path / "log-nlp.nc")
    assert log.attrs["complete"] == "no"
    assert log.sizes["time"] < 600
    assert json.loads((tmp_path / "summary.json").read_text())["controllers"] == {}


def test_a_swallowed_interrupt_is_not_forgotten(tmp_path, monkeypatch):
    from rumo.cli.sequence import run_study
    from rumo.studies.linearization import LinearizationStudy
    from rumo.studies.linearization.study import SweptRun

    drive, drives = SweptRun.run, iter(range(9))

    def swallowing(self, *, progress=None):
        log = drive(self, progress=progress)
        if next(drives) == 1:
            try:
                signal.raise_signal(signal.SIGINT)
            except KeyboardInterrupt:
                log = log.isel(time=slice(0, 3))  # as if the plant had failed
        return log

    monkeypatch.setattr(SweptRun, "run", swallowing)
    study = LinearizationStudy(("rti",), {"speed": (8.0, 9.0, 10.0)}, duration=0.4)
    with pytest.raises(Exception) as stopped:  # noqa: PT011 -- of Typer, which has moved it from version to version
        run_study(study, tmp_path, quiet=True)
    assert stopped.value.exit_code == 130
    content = json.loads((tmp_path / "summary.json").read_text())
    assert content["complete"] is False
    assert content["sweeps"]["speed"]["values"] == [8.0]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_what_was_driven_before_an_error_is_kept(tmp_path, monkeypatch):
    from rumo.cli.sequence import run_study
    from rumo.references import SinePath
    from rumo.references.base import OfTime
    from rumo.simulation import load
    from rumo.studies import PaperStudy

    looks = iter(range(3))

    def preview(path, times, x):
        if next(looks, None) is None:
            raise RuntimeError("no more")
        return OfTime.preview(path, times, x)

    monkeypatch.setattr(SinePath, "preview", preview)
    with pytest.raises(RuntimeError, match="no more"):
        run_study(PaperStudy(("rti",), duration=0.4), tmp_path, quiet=True)
    log = load(tmp_path / "log-rti.nc")
    assert (log.sizes["time"], log.attrs["complete"]) == (3, "no")
