"""The command as a user types it."""

import io
import json
import logging
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner

import rumo
from rumo.cli import main
from rumo.cli.app import app
from rumo.cli.console import print_error, print_note, print_table
from rumo.cli.progress import progress
from rumo.registry import MODELS
from rumo.report.tables import Table

runner = CliRunner(env={"COLUMNS": "100"})
SHORT = ["study", "paper", "--duration", "0.4", "--controllers", "rti"]


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
    figures = {"trajectory-first-2s", "trajectory", "wind", "torque", "steering-rate", "tracking-error", "difference"}
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
        assert list(kpis["step_time_us"]) == ["mean", "p50", "p99", "p99.9", "max"]
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


def test_next_to_nothing_is_imported_before_ctrl_c_is_heeded():
    code = "import sys, rumo; before = set(sys.modules); import rumo.cli; print(sorted(set(sys.modules) - before))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "['rumo.cli', 'rumo.cli.entry']"


def test_import_leaves_the_heavy_libraries_alone():
    heavy = ("numpy", "casadi", "scipy", "xarray", "matplotlib", "plotly", "rich", "typer")
    code = f"import sys, rumo.cli; print([name for name in {heavy} if name in sys.modules])"
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


@pytest.fixture
def undrawn(monkeypatch):
    """Figures take most of the time of a short study."""
    monkeypatch.setattr("rumo.report.figures.write_figures", lambda *_: None)


@pytest.mark.usefixtures("undrawn")
def test_json_is_the_summary_and_nothing_else_and_progress_on_a_pipe_is_lines_on_standard_error(tmp_path):
    result = runner.invoke(app, [*SHORT, "--json", "--output", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert result.stdout == (tmp_path / "summary.json").read_text()
    lines = result.stderr.splitlines()
    assert lines[0] == "rti: started"
    assert any(line.startswith("rti: 100 %, ") for line in lines)


def test_json_of_models():
    models = runner.invoke(app, ["models", "--json"])
    assert json.loads(models.stdout)["cart_pendulum"]["inputs"] == {"force": "N"}


@pytest.mark.usefixtures("undrawn")
def test_quiet_says_nothing_but_errors(tmp_path):
    result = runner.invoke(app, [*SHORT, "--quiet", "--output", str(tmp_path)])
    assert (result.exit_code, result.output) == (0, "")
    assert (tmp_path / "report.html").exists()
    wrong = runner.invoke(app, [*SHORT, "--quiet", "--seed", "0", "--controllers", "pid", "--output", str(tmp_path)])
    assert wrong.exit_code == 2
    assert "controllers: got 'pid'" in wrong.stderr
    assert runner.invoke(app, ["models", "--quiet"]).stdout.split() == list(MODELS)


STUDIES = [
    ["study", name] for name in ("paper", "faults", "discretization", "linearization", "estimation", "race-line")
]


@pytest.mark.parametrize("command", [[], ["study"], *STUDIES, ["drive"], ["bench"], ["models"]])
def test_help_fits_80_columns_and_is_whole(command):
    result = CliRunner(env={"COLUMNS": "80"}).invoke(app, [*command, "-h"])
    assert result.exit_code == 0
    assert "Usage:" in result.output
    assert max(map(len, result.output.splitlines())) <= 80
    assert "...\n" not in result.output.partition("Commands:")[2]
    assert ("--json" in result.output) == ("--quiet" in result.output) == (command not in ([], ["study"]))


def test_help_says_what_quiet_is():
    assert "Print names only." in runner.invoke(app, ["models", "-h"]).output
    assert "Print errors only." in runner.invoke(app, ["bench", "-h"]).output


def test_completion_can_be_installed():
    assert "--install-completion" in runner.invoke(app, ["-h"]).output


def test_tables_fit_80_columns_without_splitting_words():
    heads = ["", "Bad\ncommands", "Exceptions", "Largest\nerror [m]", "Samples to\nrecover", "Statuses"]
    status = f"195\u00a0OPTIMAL, 5\u00a0{rumo.Status.BAD_MEASUREMENT.name}"
    rows = [
        ["Frozen measurements", "0", "0", "0.095", "1", status],
        ["Position off by 100 m", "0", "0", "", "1", status],
    ]
    console = Console(width=80, file=io.StringIO())
    print_table(Table(heads, rows, words=(0, 5)), "A title", console)
    text = console.file.getvalue()
    assert max(map(len, text.splitlines())) <= 80
    for word in " ".join([*heads, *rows[0], *rows[1]]).replace("\u00a0", " ").split():
        assert word in text.split(), word
    assert "5 BAD_MEASUREMENT" in text


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_one_line():
    with open("/dev/full", "w") as full:
        result = subprocess.run(
            [sys.executable, "-m", "rumo", "models"], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert result.returncode == 1
    assert result.stderr == "Error: the output cannot be written: [Errno 28] No space left on device\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_mistake_has_its_exit_code_where_nobody_hears_of_it():
    with open("/dev/full", "w") as full:
        assert subprocess.run([sys.executable, "-m", "rumo", "nosuch"], stderr=full, check=False).returncode == 2


@pytest.mark.skipif(sys.platform == "win32", reason="pipes of another kind")
def test_a_reader_that_has_gone_is_no_traceback():
    with subprocess.Popen(
        [sys.executable, "-m", "rumo", "models"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == 1


class Full(io.StringIO):
    """A stream that takes nothing."""

    def __init__(self, terminal):
        super().__init__()
        self.terminal = terminal

    def isatty(self):
        return self.terminal

    def write(self, text):
        raise OSError(28, "No space left on device")


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("quiet", [True, False])
def test_progress_that_nobody_can_read_does_not_end_the_work(monkeypatch, terminal, quiet):
    monkeypatch.setattr(sys, "stderr", Full(terminal))
    with progress(quiet) as told:
        told("rti", 0, 2)
        logging.getLogger("rumo").warning("The portable build is used.")
        print_note("A note.")
        told("rti", 2, 2)
    print_error("An error.")


@pytest.fixture
def ended(monkeypatch, capsys):
    """Runs the command by what is in its place; its exit code and standard error."""

    def run(place):
        monkeypatch.setattr("rumo.cli.entry._run", place)
        with pytest.raises(SystemExit) as end:
            main()
        return end.value.code, capsys.readouterr().err

    return run


def test_errors_of_files_are_not_those_of_the_output(ended, tmp_path):
    code, errors = ended((tmp_path / "there is none.toml").read_text)
    assert code == 1
    assert errors == f"Error: [Errno 2] No such file or directory: '{tmp_path / 'there is none.toml'}'\n"


def test_ctrl_c_while_modules_are_imported_is_an_exit_code(ended):
    def interrupted():
        raise KeyboardInterrupt

    assert ended(interrupted) == (130, "")


def test_closed_standard_streams_are_no_error(ended, monkeypatch):
    for name in ("stdout", "stderr"):
        monkeypatch.setattr(sys, name, None)
    code, _ = ended(lambda: sys.stdout.write("version"))
    assert code == len("version")
    sys.stdout.close()
    sys.stderr.close()
