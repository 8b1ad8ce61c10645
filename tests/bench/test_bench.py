"""`rumo bench`: what is replayed is what was driven, and the figures say what they claim."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import rumo
from rumo.bench import SCENARIOS, measure, record, runners, summary
from rumo.bench.qp import installed, measure_solvers, record_programs
from rumo.bench.report import report, solver_summary, solver_table
from rumo.bench.schemes import schemes_of
from rumo.cli.app import app

PHASES = {"prepare_us", "feedback_us", "total_us"}
SAMPLES = 60
PERCENTILES = {"p50", "p99", "p999", "max"}


@pytest.fixture(autouse=True)
def measured_once(monkeypatch):
    """What times are is not looked at: one round does."""
    monkeypatch.setattr(runners, "ROUNDS", 1)
    monkeypatch.setattr(runners, "LAPS", 1)


@pytest.fixture(scope="module", params=SCENARIOS)
def recording(request):
    return record(request.param, 10, SAMPLES)


def test_a_recording_is_what_the_controller_was_told(recording):
    problem = recording.problem
    assert recording.x.shape == (SAMPLES, len(problem.model.states))
    assert recording.reference.shape == (SAMPLES, 11, len(problem.outputs))
    assert recording.applied.shape == (SAMPLES, 1, len(problem.model.inputs))
    # Replayed step by step, the commands are those of the drive: each is decided one sample before it is applied.
    controller = rumo.RealTimeIteration(problem)
    commands = []
    for x, reference, applied in zip(recording.x, recording.reference, recording.applied, strict=True):
        np.testing.assert_allclose(controller.applied, applied, rtol=0.0, atol=1e-9)
        commands.append(controller.step(x, reference).command.values)
    np.testing.assert_allclose(commands[:-1], recording.applied[1:, 0], rtol=0.0, atol=1e-9)


def test_every_runner_that_works_here_gives_a_time_for_each_phase_of_each_sample(recording):
    times = measure(recording, ["rti", "rti-python", "rti-portable", "rti-reference", "nlp"])
    for values in times.values():
        assert values.shape == (SAMPLES, 2)
        assert np.isfinite(values).all()
        assert (values[:, 1] > 0.0).all()


def test_figures_are_percentiles_and_ratios_to_the_default_backend():
    ours = np.column_stack([np.full(110, 8.0), np.full(110, 2.0)])
    theirs = np.column_stack([np.linspace(40.0, 60.0, 110), np.full(110, 50.0)])
    content = summary({"rti": ours, "acados": theirs}, 15, "easy")
    assert set(content) >= {"machine", "horizon", "controllers", "ratios"}
    assert content["samples"] == {"rti": 100, "acados": 100}
    assert content["controllers"]["rti"]["total_us"] == dict.fromkeys(("p50", "p99", "p999", "max"), 10.0)
    assert content["controllers"]["acados"]["prepare_us"]["max"] == 60.0
    assert content["ratios"]["acados"]["feedback_us"]["p50"] == 25.0
    assert content["ratios"]["rti"]["total_us"]["p999"] == 1.0


def test_qp_solvers_that_work_here_find_what_the_core_finds(recording):
    programs = record_programs(recording, most=20)
    assert len(programs) == 20
    assert installed()[0] == "core"
    content = solver_summary(measure_solvers(programs, installed()))
    for name, values in content.items():
        assert values["solved"] == 20
        assert values["difference"] < 1e-4, name  # interior points stop beside the solution
        assert 0.0 < values["p50"] <= values["max"]
    assert content["core"]["difference"] == 0.0
    table = solver_table(content)
    assert [row[0] for row in table.rows] == installed()
    assert table.rows[0][5] == "1.0"


@pytest.mark.slow
def test_the_command_measures_all_if_not_told_which():
    outcome = CliRunner().invoke(app, ["bench", "--steps", "100", "--horizon", "4", "--json"])
    assert outcome.exit_code == 0, outcome.output
    content = json.loads(outcome.stdout)
    assert [section.heading.split(",")[0] for section in report([content]).sections][1] == "QP solvers"
    assert set(content["controllers"]) >= {"rti", "rti-tailored", "rti-portable", "rti-reference", "nlp"}
    assert set(content["qp_solvers"]["core"]) >= PERCENTILES


def test_the_command_prints_a_table_or_the_figures():
    arguments = ["bench", "--steps", "100", "--controllers", "rti-portable", "--horizon", "5"]
    table, figures = (CliRunner().invoke(app, [*arguments, *more]) for more in ([], ["--json", "--quiet"]))
    assert (table.exit_code, figures.exit_code) == (0, 0), table.output + figures.output
    assert "rti-portable" in table.stdout
    content = json.loads(figures.stdout)
    assert figures.stderr == ""
    assert content["horizon"] == 5
    for name in ("rti", "rti-portable"):
        assert set(content["controllers"][name]) == PHASES
        assert set(content["controllers"][name]["total_us"]) == PERCENTILES
        assert set(content["ratios"][name]["total_us"]) == PERCENTILES


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [("--controllers", "rti-python,rtx", "rtx"), ("--scenario", "rally", "rally"), ("--steps", "5", "100")],
)
def test_wrong_options_say_what_is_right(option, value, words):
    outcome = CliRunner().invoke(app, ["bench", option, value])
    assert outcome.exit_code == 2
    assert words in outcome.output


def test_schemes_by_name(recording):
    schemes = schemes_of(["radau2", "implicit-euler:3", "rk4:60", "explicit-euler"], recording)
    assert list(schemes)[:3] == ["radau2", "implicit-euler:3", "rk4:60"]
    assert schemes["implicit-euler:3"] == rumo.ImplicitEuler(substeps=3)
    # As many as the fastest wheel mode on the drive needs: some 1e5 1/s over 0.04 s, at most 2 per step.
    (name,) = list(schemes)[3:]
    assert 1000 < schemes[name].substeps < 5000
    assert name == f"explicit-euler:{schemes[name].substeps}"
    times = measure(recording, ["rti"], {key: schemes[key] for key in ("radau2", "rk4:60")})
    assert list(times) == ["rti", "radau2", "rk4:60"]
    assert all(values.shape == (SAMPLES, 2) and np.isfinite(values).all() for values in times.values())


@pytest.mark.parametrize(
    ("scheme", "message"),
    [
        ("radau4", "--scheme: got 'radau4', expected one of implicit-euler"),
        ("rk4:many", "--scheme: got 'rk4:many', expected NAME or NAME:SUBSTEPS"),
        ("rk4:0", "substeps of rk4: got 0, expected a whole number of at least 1"),
    ],
)
def test_unknown_schemes(scheme, message):
    result = CliRunner().invoke(app, ["bench", "--steps", "100", "--horizon", "2", "--scheme", scheme])
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())


def test_command_with_schemes():
    command = ["bench", "--steps", "100", "--horizon", "3", "--scheme", "radau2, sdirk2", "--json"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    content = json.loads(result.stdout)
    assert list(content["controllers"]) == ["rti", "radau2", "sdirk2"]
    assert "qp_solvers" not in content
