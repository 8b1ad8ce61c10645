"""The command as a user types it."""

import json
import subprocess
import sys

import pytest
from typer.testing import CliRunner

import rumo
from rumo.cli import app
from rumo.registry import MODELS

runner = CliRunner(env={"COLUMNS": "100"})


def test_version():
    result = runner.invoke(app, ["--version"])
    assert result.output.strip() == f"rumo {rumo.__version__}"


def test_models_lists_every_signal_with_its_unit():
    result = runner.invoke(app, ["models"])
    assert result.exit_code == 0
    words = " ".join(result.output.split())
    for name, make in MODELS.items():
        model = make()
        assert name in words
        for signals in model.signals:
            for signal in signals:
                assert f"{signal} [{signals.unit(signal)}]" in words


def test_help_without_arguments():
    assert "study" in runner.invoke(app, []).output


def test_short_study_writes_all_it_promises(tmp_path):
    folder = tmp_path / "new" / "out"
    result = runner.invoke(
        app, ["study", "paper", "--duration", "0.8", "--controllers", "rti,ltv", "--output", str(folder)]
    )
    assert result.exit_code == 0, result.output
    written = {path.name for path in folder.iterdir()}
    figures = {"trajectory-first-2s", "trajectory", "wind", "torque", "steering-rate", "tracking-error"}
    figures |= {"step-time-rti", "step-time-ltv"}
    assert written == {f"{figure}.{ending}" for figure in figures for ending in ("png", "pdf")} | {
        "summary.json",
        "report.html",
        "log-rti.nc",
        "log-ltv.nc",
    }
    summary = json.loads((folder / "summary.json").read_text())
    assert list(summary) == ["study", "seed", "sampling_time_s", "horizon", "controllers", "claims"]
    assert (summary["study"], summary["seed"], summary["sampling_time_s"], summary["horizon"]) == ("paper", 0, 0.04, 15)
    assert list(summary["controllers"]) == ["rti", "ltv"]
    for kpis in summary["controllers"].values():
        assert list(kpis) == [
            "tracking_error_rms_m",
            "tracking_error_rms_after_2s_m",
            "tracking_error_max_after_2s_m",
            "step_time_us",
            "deadline_misses",
            "status_counts",
        ]
        assert list(kpis["step_time_us"]) == ["mean", "p50", "p99", "max"]
        assert kpis["tracking_error_rms_after_2s_m"] is None  # the drive ended before
        assert kpis["status_counts"] == {"OPTIMAL": 20}
    assert all(list(claim) == ["claim", "printed", "ours", "unit"] for claim in summary["claims"])
    assert "Report:" in result.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--controllers", "rti,pid"], "controllers: got 'pid', expected one of rti, nlp, ltv."),
        (["--controllers", "rt"], "Did you mean 'rti'?"),
        (["--duration", "0.01"], "duration: got 0.01 s, expected at least one sample of 0.04 s."),
        (["--duration", "nan"], "duration: got nan s, expected at least one sample of 0.04 s."),
    ],
)
def test_bad_settings_are_one_sentence_and_exit_code_2(tmp_path, arguments, message):
    result = runner.invoke(app, ["study", "paper", "--output", str(tmp_path), *arguments])
    assert result.exit_code == 2
    assert message in result.output
    assert "Traceback" not in result.output
    assert not list(tmp_path.iterdir())


def test_output_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("in the way")
    result = runner.invoke(app, ["study", "paper", "--output", str(tmp_path / "file")])
    assert result.exit_code == 2
    assert f"--output: got '{tmp_path / 'file'}' (File exists), expected a folder that can be written." in result.output
    assert (tmp_path / "file").read_text() == "in the way"


def test_command_is_installed():
    result = subprocess.run([sys.executable, "-m", "rumo", "--version"], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == f"rumo {rumo.__version__}"


def test_import_leaves_the_heavy_libraries_alone():
    code = (
        "import rumo, sys; print([m for m in ('scipy', 'xarray', 'matplotlib', 'plotly', 'rich') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_a_plant_that_fails_leaves_what_was_driven(tmp_path, monkeypatch):
    from rumo.simulation import Plant, load

    advance, samples = Plant.advance, iter(range(10))

    def failing(self, x, u, p):
        if next(samples) == 5:
            raise rumo.PlantError("the road ended")
        return advance(self, x, u, p)

    monkeypatch.setattr(Plant, "advance", failing)
    result = runner.invoke(
        app, ["study", "paper", "--duration", "0.8", "--controllers", "rti", "--output", str(tmp_path)]
    )
    assert result.exit_code == 2
    assert "At t = 0.2 s: the road ended" in result.output
    assert load(tmp_path / "log-rti.nc").sizes["time"] == 6
