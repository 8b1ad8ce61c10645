"""Where the linearisation decides: LTV is lost where RTI follows the NLP."""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import rumo
from rumo.cli.app import app
from rumo.controllers import DirectNlp
from rumo.estimation import Butterworth
from rumo.report.figures import draw
from rumo.report.plots import plot
from rumo.simulation import Scenario
from rumo.status import Status
from rumo.studies.linearization import BASE, SWEEPS, LinearizationStudy, StartedNlp
from rumo.studies.linearization.charts import linearization_panels
from rumo.studies.linearization.report import findings, overview_table, sweep_table
from rumo.studies.linearization.summary import closed_loop_cost, outcome

STUDY = LinearizationStudy(("rti", "nlp", "ltv"), {"initial_error": (0.0, 4.0), "noise": (1.0,)}, duration=5.0)
STEPS = 125
PROBLEM = BASE.problem()


@pytest.fixture(scope="module")
def logs():
    return STUDY.run()


@pytest.fixture(scope="module")
def content(logs):
    return STUDY.summary(logs)


def runs(content, sweep, value):
    entry = content["sweeps"][sweep]
    return {name: each[entry["values"].index(value)] for name, each in entry["controllers"].items()}


def test_on_the_path_it_does_not_matter_where_to_linearise(content):
    # The car stays within 0.1 m and 0.03 rad of its reference: what is left out is of second order, a thousandth.
    on_path = runs(content, "initial_error", 0.0)
    for run in on_path.values():
        assert run["cost"] == pytest.approx(on_path["nlp"]["cost"], rel=1e-2)
        assert (run["lost"], run["unsolved_share"], run["violated_steps"]) == (False, 0.0, 0)


def test_four_metres_beside_the_path_only_ltv_is_lost(content):
    beside = runs(content, "initial_error", 4.0)
    assert {name: run["lost"] for name, run in beside.items()} == {"rti": False, "nlp": False, "ltv": True}
    assert beside["ltv"]["cost_over_nlp"] > 100.0
    assert beside["rti"]["cost_over_nlp"] == pytest.approx(1.0, abs=0.01)
    assert all(run["unsolved_share"] == 0.0 for run in beside.values())


def test_ltv_does_not_know_how_much_the_tyres_can_hold(monkeypatch):
    # On the reference no tyre slips, and there the squares in the friction circles have no slope.
    study = LinearizationStudy(("rti", "ltv"), {"initial_error": (4.0,)}, duration=2.0)
    limited = study.run()["initial_error"][4.0]
    monkeypatch.setattr("rumo.studies.paper.study.friction_circles", lambda *_: {})
    unlimited = replace(study).run()["initial_error"][4.0]
    assert limited["ltv"].sizes["constraint"] > unlimited["ltv"].sizes["constraint"]
    for name, same in (("ltv", True), ("rti", False)):
        # Later, a car that spins magnifies rounding.
        commands = [logs[name].commanded.values[:10] for logs in (limited, unlimited)]
        assert np.allclose(*commands, rtol=0.0, atol=1e-6) == same


@pytest.mark.slow
def test_the_filters_lag_makes_ltv_better_and_noise_makes_it_worse(content):
    filtered = runs(content, "noise", 1.0)
    study = LinearizationStudy(("rti", "ltv"), {"noise": (0.0,)})
    lag = runs(study.summary(study.run()), "noise", 0.0)
    # The paper's 24 s, since in shorter drives it depends on the noise.
    study = LinearizationStudy(("rti", "ltv"), {"raw_noise": (1.0,)}, duration=24.0)
    noise = runs(study.summary(study.run()), "raw_noise", 1.0)
    rms = "tracking_error_rms_after_2s_m"
    assert filtered["ltv"][rms] <= filtered["rti"][rms]
    assert lag["ltv"][rms] <= lag["rti"][rms]
    assert noise["ltv"][rms] >= noise["rti"][rms]
    # What it gains from the lag it gains along the path, not across it.
    assert lag["ltv"]["across_rms_after_2s_m"] >= lag["rti"]["across_rms_after_2s_m"]


def test_the_summary_says_what_the_logs_say(logs, content):
    weights = {"p_x": 10.0 / 50.0**2, "p_y": 10.0 / 6.0**2, "psi": 1.0 / 0.6**2, "v_x": 1.0 / 10.0**2}
    moves = {"torque": 5.0 / 600.0**2, "steering_rate": 5.0 / 3.0**2}
    for sweep, by_value in logs.items():
        for i, by_name in enumerate(by_value.values()):
            for name, log in by_name.items():
                run = content["sweeps"][sweep]["controllers"][name][i]
                plant, wanted = (log[key].to_dataset(log[key].dims[-1]) for key in ("plant", "reference"))
                applied = log.applied.to_dataset("input")
                cost = sum(w * float(((plant[y] - wanted[y])[1:] ** 2).sum()) for y, w in weights.items())
                cost += sum(w * float((applied[u].diff("time") ** 2).sum()) for u, w in moves.items())
                assert run["cost"] == pytest.approx(cost, rel=1e-9)
                squares = (plant.p_x - wanted.p_x) ** 2 + (plant.p_y - wanted.p_y) ** 2
                assert run["tracking_error_rms_m"] == pytest.approx(float(squares.mean()) ** 0.5)
                settled = squares.sel(time=slice(2.0, None))
                assert run["tracking_error_rms_after_2s_m"] == pytest.approx(float(settled.mean()) ** 0.5)
                assert run["tracking_error_max_m"] == pytest.approx(float(squares.max()) ** 0.5)
                assert run["violated_steps"] == int((log.status == "SOFT_VIOLATED").sum())
                assert run["step_time_us"] == pytest.approx(1e6 * float(log.step_time.median()))
    assert content["duration_s"] == 5.0
    json.dumps(content, allow_nan=False)


def test_what_counts_as_lost(logs):
    log = logs["initial_error"][0.0]["rti"]
    psi, p_x = (list(log.plant_state.values).index(name) for name in ("psi", "p_x"))

    def lost(samples, state, by):
        changed = log.copy(deep=True)
        changed.plant.values[samples, state] += by
        return outcome(changed, PROBLEM, STEPS)["lost"]

    assert not lost(100, psi, 1.4)
    assert lost(100, psi, -1.7)
    assert not lost(100, p_x, 50.0)
    assert not lost(-1, p_x, 9.8)
    assert lost(-1, p_x, 10.2)
    assert outcome(log.isel(time=slice(0, STEPS - 1)), PROBLEM, STEPS)["lost"]


def test_a_plant_that_cannot_be_integrated_is_a_lost_drive(logs, monkeypatch):
    def fail(*arguments, **options):
        raise rumo.PlantError("no", logs["initial_error"][0.0]["rti"].isel(time=slice(0, 20)))

    monkeypatch.setattr(Scenario, "run", fail)
    study = LinearizationStudy(("rti",), {"speed": (30.0,)})
    broken = study.run()
    (run,) = study.summary(broken)["sweeps"]["speed"]["controllers"]["rti"]
    assert run["lost"]
    assert (run["tracking_error_rms_after_2s_m"], run["cost_over_nlp"]) == (None, None)
    for figure in linearization_panels(study.summary(broken), broken):
        draw(figure)


@pytest.mark.parametrize("error", [8.0, 12.0])
def test_ipopt_started_from_a_plan_finds_its_way_from_afar(error):
    study = LinearizationStudy(("nlp",), {"initial_error": (error,)}, duration=0.4)
    log = study.run()["initial_error"][error]["nlp"]
    assert all(Status[status].solved for status in log.status.values)


def test_ipopt_finds_the_same_plan_wherever_it_starts():
    path, x = BASE.path, replace(BASE, initial_error=2.0).initial_state()
    start = {name: x[name] for name in PROBLEM.model.states if name in x} | {"w_f": x["w_fl"], "w_r": x["w_rl"]}
    plans = [kind(PROBLEM).step(start, path(PROBLEM.times)) for kind in (DirectNlp, StartedNlp)]
    np.testing.assert_allclose(plans[1].x.values, plans[0].x.values, atol=1e-5)


def test_sweeps_do_what_they_say():
    study, times = LinearizationStudy(), np.linspace(0.0, 20.0, 20001)
    path = study.drive("curvature", 0.2).path(times)
    assert np.abs(path["omega"]).max() / 8.0 == pytest.approx(0.2, rel=1e-4)
    level = study.drive("heading", 0.0).initial_state()
    turned = study.drive("heading", 0.5).initial_state()
    assert {name for name in level if level[name] != turned[name]} == {"psi"}
    assert turned["psi"] - level["psi"] == pytest.approx(0.5)
    assert study.drive("initial_error", 3.0).initial_state()["p_y"] == 3.0
    assert study.drive("speed", 14.0).path.speed == 14.0
    noisy = study.drive("noise", 2.0)
    assert (noisy.noise["p_x"], noisy.path.speed) == (0.1, 12.0)
    assert noisy.estimator == Butterworth(cutoff=3.5)
    assert study.drive("raw_noise", 2.0).estimator is None


@pytest.mark.parametrize(
    ("sweep", "value"),
    [
        ("speed", 20.0),
        pytest.param("initial_error", 9.0, marks=pytest.mark.slow),
        *(pytest.param("heading", value, marks=pytest.mark.slow) for value in (1.2, 1.4)),
    ],
)
def test_safeguarded_it_drives_where_full_steps_lose_the_car(sweep, value):
    study = LinearizationStudy(("rti", "plain", "nlp"), {sweep: (value,)})
    driven = runs(study.summary(study.run()), sweep, value)
    assert {name: run["lost"] for name, run in driven.items()} == {"rti": False, "plain": True, "nlp": False}
    assert driven["rti"]["cost_over_nlp"] == pytest.approx(1.0, abs=0.02)


def test_findings_follow_the_numbers(content):
    first, *_ = findings(content)
    assert first.startswith(
        "Initial distance from the path: RTI is lost nowhere; Direct NLP is lost nowhere; LTV is lost at 4 m."
    )
    assert "LTV tracks closer than RTI at 1." in findings(content)[1]
    other = copy.deepcopy(content)
    rti, nlp, ltv = (other["sweeps"]["initial_error"]["controllers"][name] for name in ("rti", "nlp", "ltv"))
    rti[1]["lost"], ltv[1]["lost"] = True, False
    rti[0]["cost_over_nlp"], ltv[0]["cost_over_nlp"], ltv[1]["cost_over_nlp"] = 1.25, 0.5, 3.0
    assert findings(other)[0] == (
        "Initial distance from the path: RTI is lost at 4 m; Direct NLP is lost nowhere; LTV is lost nowhere."
        " Where neither is lost, RTI costs 25 % more at 0 m than the direct NLP."
        " Where neither is lost, LTV costs 50 % less at 0 m to 200 % more at 4 m than the direct NLP."
        " LTV tracks closer than RTI at 4 m."
    )
    rti[0]["cost_over_nlp"], ltv[0]["cost_over_nlp"] = 1.0 - 1e-9, 1.0 + 1e-9
    assert "RTI costs as much as the direct NLP. Where" in findings(other)[0]
    assert "LTV costs nothing more at 0 m to 200 % more at 4 m than the direct NLP." in findings(other)[0]
    nlp[0]["unsolved_share"] = nlp[1]["unsolved_share"] = 0.1  # an NLP without a solution is nothing to compare with
    assert "than the direct NLP" not in findings(other)[0]


def test_tables_and_figures_show_the_summary(content, logs):
    table = sweep_table(content["sweeps"]["initial_error"])
    assert table.heads[:4] == ["Initial distance from the path [m]", "RTI\ncost", "Direct NLP\ncost", "LTV\ncost"]
    assert [row[3] for row in table.rows] == ["0.150", "lost"]
    assert [row[:3] for row in overview_table(content).rows[:3]] == [
        ["Initial distance from the path", "RTI", "-"],
        ["", "Direct NLP", "-"],
        ["", "LTV", "4 m"],
    ]
    figures = linearization_panels(content, logs)
    assert [figure.key for figure in figures] == ["cost", "cost-over-nlp", "error", "trajectories"]
    for figure in figures:
        printed, interactive = draw(figure), plot(figure)
        drawn = [line for axes in printed.axes for line in axes.lines]
        assert len(drawn) == len(interactive.data) == sum(len(lines) for _, lines in figure.panels)
    cost = dict(figures[0].panels)["Initial distance from the path [m]"]
    lost = next(line for line in cost if line.name == "Lost")
    assert lost.x[np.isfinite(lost.x)].tolist() == [4.0]
    assert len(STUDY.report(logs).sections) == 2 + len(STUDY.sweeps)


def test_progress_is_told_by_sweep():
    told = []
    study = LinearizationStudy(("rti", "ltv"), {"speed": (8.0, 9.0), "heading": (0.1,)}, duration=0.08)
    study.run(lambda *state: told.append(state))
    halves = [("speed", done / 2, 4) for done in range(9)] + [("heading", done / 2, 2) for done in range(5)]
    assert list(dict.fromkeys(told)) == halves


def test_a_drive_beside_the_path_costs_by_the_square(logs):
    # Held still in its errors, the cost is that of one sample times their number.
    log = logs["initial_error"][0.0]["rti"].copy(deep=True)
    for name in ("p_x", "p_y", "psi", "v_x"):
        log.plant.loc[{"plant_state": name}] = log.reference.sel(output=name).values
    log.applied.values[:] = 0.0
    assert closed_loop_cost(log, PROBLEM) == 0.0
    log.plant.loc[{"plant_state": "p_y"}] += 3.0
    assert closed_loop_cost(log, PROBLEM) == pytest.approx((STEPS - 1) * 10.0 * (3.0 / 6.0) ** 2)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"controllers": ("rti", "pid")}, "controllers: got 'pid', expected one of rti, nlp, ltv, plain."),
        ({"controllers": ()}, "controllers: got none, expected some of rti, nlp, ltv, plain."),
        ({"sweeps": {}}, f"sweeps: got none, expected some of {', '.join(SWEEPS)}."),
        ({"sweeps": {"curvatur": (0.1,)}}, "Did you mean 'curvature'?"),
        ({"sweeps": {"speed": ()}}, "sweeps['speed']: got (), expected at least one value."),
        ({"sweeps": {"speed": (8.0, 0.0)}}, "sweeps['speed']: got 0.0, expected a positive finite number."),
        ({"sweeps": {"heading": (np.inf,)}}, "sweeps['heading']: got inf, expected a finite number."),
        ({"sweeps": {"noise": ("much",)}}, "sweeps['noise']: got 'much', expected a number of at least 0."),
        ({"sweeps": ("speed",)}, "sweeps: got ('speed',), expected a mapping from names."),
        ({"seed": -1}, "seed: got -1, expected a whole number of at least 0."),
        ({"duration": 0.04}, "duration: got 0.04 s, expected at least two samples of 0.04 s."),
    ],
)
def test_bad_settings(settings, message):
    with pytest.raises(rumo.ArgumentError) as error:
        LinearizationStudy(**settings)
    assert message in str(error.value)


def test_command(tmp_path, monkeypatch):
    monkeypatch.setitem(SWEEPS, "speed", replace(SWEEPS["speed"], values=(8.0,)))
    arguments = ["study", "linearization", "--controllers", "rti,ltv", "--sweeps", "speed", "--output", str(tmp_path)]
    run = CliRunner().invoke(app, arguments)
    assert run.exit_code == 0, run.output
    content = json.loads((tmp_path / "summary.json").read_text())
    assert content["sweeps"]["speed"]["values"] == [8.0]
    assert "RTI is lost nowhere" in run.output
    assert "RTI is lost nowhere" in (tmp_path / "report.html").read_text()
    unknown = CliRunner().invoke(app, ["study", "linearization", "--sweeps", "sped", "--output", str(tmp_path)])
    assert (unknown.exit_code, "Did you mean 'speed'?" in unknown.output) == (2, True)
