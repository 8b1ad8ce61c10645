"""`rumo bench`: what is replayed is what was driven, and the figures say what they claim."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import rumo
from rumo.bench import SCENARIOS, WEAK, measure, measuring, record, summary
from rumo.bench.qp import installed, measure_solvers, record_programs
from rumo.bench.report import report, solver_summary, solver_table
from rumo.bench.runners import Outcome
from rumo.bench.schemes import schemes_of
from rumo.cli.app import app

PHASES = {"prepare_us", "feedback_us", "total_us"}
SAMPLES = 60
PERCENTILES = {"p50", "p99", "p999", "max"}


@pytest.fixture(autouse=True)
def measured_once(monkeypatch):
    """What times are is not looked at: one round does."""
    monkeypatch.setattr(measuring, "ROUNDS", 1)
    monkeypatch.setattr(measuring, "LAPS", 1)


@pytest.fixture(scope="module", params=SCENARIOS)
def recording(request):
    return record(request.param, 10, SAMPLES)


def test_a_recording_is_what_the_controller_was_told(recording):
    problem = recording.problem
    assert recording.x.shape == (SAMPLES, len(problem.model.states))
    assert recording.reference.shape == (SAMPLES, 11, len(problem.outputs))
    assert recording.applied.shape == (SAMPLES, 1, len(problem.model.inputs))
    # Replayed step by step, the commands are those of the drive: each is decided one sample before it is applied.
    controller = rumo.RealTimeIteration(problem, trusted_step=np.inf)
    commands = []
    for x, reference, applied in zip(recording.x, recording.reference, recording.applied, strict=True):
        np.testing.assert_allclose(controller.applied, applied, rtol=0.0, atol=1e-9)
        commands.append(controller.step(x, reference).command.values)
    np.testing.assert_allclose(commands[:-1], recording.applied[1:, 0], rtol=0.0, atol=1e-9)


def test_weak_inputs_are_nearly_all_at_bounds():
    recording = record(WEAK, 30, SAMPLES)
    problem = recording.problem
    controller = rumo.RealTimeIteration(problem)
    plans = [controller.step(x, wanted) for x, wanted in zip(recording.x, recording.reference, strict=True)]
    close = 1e-9 * problem.input_scales
    shares = [
        np.mean((plan.u.values <= problem.input_lower + close) | (plan.u.values >= problem.input_upper - close))
        for plan in plans
    ]
    assert np.median(shares) > 0.8


def test_every_runner_that_works_here_gives_a_time_for_each_phase_of_each_sample(recording):
    times = measure(recording, ["rti", "rti-python", "rti-portable", "rti-reference", "nlp"])
    for values in times.values():
        assert values.shape == (SAMPLES, 2)
        assert np.isfinite(values).all()
        assert (values[:, 1] > 0.0).all()


@pytest.fixture(scope="module")
def compared(recording):
    """Times made up, of two replays each: ours, and those of another with commands of its own."""
    ours = np.column_stack([np.full(SAMPLES, 8.0), np.full(SAMPLES, 2.0)])
    ours[:20] += 1.0  # which the other did not get to
    theirs = np.column_stack([np.linspace(40.0, 60.0, 20), np.full(20, 50.0)])
    commands = recording.applied[1:21, -1] / recording.problem.input_scales
    commands[15, 0] += 0.25
    commands[5, 0] += 1.0  # while warming up
    return {
        "rti": [Outcome(ours), Outcome(ours)],
        "acados": [Outcome(theirs), Outcome(theirs + 2.0, commands, failed=3, remark="DAQP")],
    }


def test_figures_are_percentiles_and_ratios_to_the_default_backend(recording, compared):
    content = summary(compared, recording, "easy")
    assert set(content) >= {"machine", "horizon", "controllers", "ratios"}
    assert content["samples"] == {"rti": SAMPLES - 10, "acados": 10}
    assert content["controllers"]["rti"]["total_us"] == {"p50": 10.0, "p99": 12.0, "p999": 12.0, "max": 12.0}
    assert content["controllers"]["acados"]["prepare_us"]["max"] == 61.0  # of the median of two replays
    # On the same samples.
    assert content["ratios"]["acados"]["feedback_us"]["p50"] == 51.0 / 3.0
    assert content["ratios"]["rti"]["total_us"]["p999"] == 1.0
    assert content["difference"] == {"acados": pytest.approx(0.25)}
    assert content["failed"] == {"acados": 3}
    assert content["remarks"] == {"acados": "DAQP"}


def test_a_sweep_tells_every_percentile_and_how_a_step_grows(recording, compared):
    runs = [summary(compared, recording, drive) | {"horizon": N} for drive in ("easy", "limit") for N in (50, 200)]
    for run in runs:
        if run["horizon"] == 200:
            for values in run["controllers"]["acados"]["total_us"], run["controllers"]["rti"]["prepare_us"]:
                values["p50"] *= 4.5
    content = report(runs)
    headings = [section.heading for section in content.sections]
    assert headings[:3] == [f"{phase}, easy; microseconds" for phase in ("total", "feedback", "prepare")]
    tables = {section.heading: section.content[0].rows for section in content.sections}
    assert tables["feedback, limit; microseconds"][2] == ["acados", "50", "51.0", "51.0", "51.0", "51.0", "17.00"]
    assert [row[0] for row in tables["total, easy; microseconds"]] == ["rti", "", "acados", ""]
    assert tables["p50 at N = 200 over N = 50"] == [["rti", "1.0", "1.0"], ["acados", "4.5", "4.5"]]
    assert tables["Solvers"][0] == ["acados", "easy", "50", "DAQP", "3", "2e-01"]
    assert len(content.summary["runs"]) == 4


def test_slow_runners_replay_less(recording, monkeypatch):
    monkeypatch.setattr(measuring, "SECONDS", 1e-9)
    monkeypatch.setattr(measuring, "LEAST", 30)
    times = measure(recording, ["rti", "rti-python"])
    assert {len(values) for values in times.values()} == {30}


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
