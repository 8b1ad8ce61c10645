"""Estimators in closed loop: each question is what it says, and what is told follows from the logs."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from typer.testing import CliRunner

import rumo
from rumo.cli.app import app
from rumo.estimation import ExtendedKalman, MovingHorizon, consistency
from rumo.report.charts import Panels
from rumo.report.figures import draw
from rumo.report.plots import plot
from rumo.studies import Drive
from rumo.studies.base import nested
from rumo.studies.estimation import CONTENDERS, QUESTIONS, EstimationStudy
from rumo.studies.estimation.findings import finding
from rumo.studies.estimation.outcome import SETTLED, outcome
from rumo.studies.estimation.report import errors_table
from rumo.studies.estimation.summary import by_question, together
from rumo.studies.kpis import Driven

ROAD = Drive("oval", grip=0.8, mu=1.0, backend="portable")
SHORT = EstimationStudy(seeds=(0,), duration=2.0, base=ROAD)


@cache
def runs():
    return SHORT.runs()


@cache
def driven(question, name):
    """A run's drive, log and outcome."""
    run = runs()[question, name, 0]
    log = run.drive.run()
    drive = Driven(log, run.drive.track, run.drive.path, run.drive.profile, run.car)
    return run, log, outcome(drive, after=run.after, bounds=run.bounds, truth=run.truth)


def test_errors_are_those_of_the_log():
    run, log, found = driven("plain", "ekf")
    settled = log.sel(time=slice(SETTLED, None))
    error = settled.observed - settled.true_observed
    assert run.after == SETTLED
    for name in ("v_x", "omega", "delta"):
        column = error.sel(observed_state=name).values
        assert found["rmse"][name] == pytest.approx(np.sqrt(np.mean(column**2)))
    place = error.sel(observed_state=["p_x", "p_y"]).values
    assert found["rmse"]["position"] == pytest.approx(np.sqrt(np.mean(np.sum(place**2, axis=1))))
    n = log.true_states.sel(state="n").values
    assert found["lateral_deviation_rms_m"] == pytest.approx(np.sqrt(np.mean(n**2)), rel=1e-6)
    judged = consistency(log, after=SETTLED)
    assert (found["nis"], found["nis_expected"]) == (judged.nis, judged.expected)
    assert (found["beyond"], found["lost"]) == (None, False)
    json.dumps(found, allow_nan=False)


def test_every_estimator_meets_the_same_drive():
    """Wind, noise and gross errors are the seed's, not the estimator's."""
    (_, ekf, _), (_, robust, _) = driven("outliers", "ekf"), driven("outliers", "robust")
    np.testing.assert_array_equal(ekf.disturbance, robust.disturbance)
    np.testing.assert_array_equal(ekf.received_outputs[0], robust.received_outputs[0])
    spoilt = [((log.received_outputs - log.measured_outputs) != 0.0).values for log in (ekf, robust)]
    np.testing.assert_array_equal(*spoilt)
    begun = ekf.time.values >= 1.0
    assert not spoilt[0][~begun].any()
    assert 0.02 < spoilt[0][begun].mean() < 0.15


def test_outliers_pull_the_plain_filter_and_not_the_robust_ones():
    errors = {name: driven("outliers", name)[2]["rmse"]["position"] for name in CONTENDERS}
    assert max(errors["gated"], errors["robust"]) < 0.5 * errors["ekf"]


def test_a_moving_horizon_knows_its_bound_and_is_the_filter_without():
    run, log, found = driven("bounds", "mhe")
    mu = log.estimated_parameters.sel(model_parameter="mu").values
    assert np.nanmax(mu) <= 1.0 + 1e-6
    assert found["beyond"] == 0.0
    assert found["rmse"]["mu"] == pytest.approx(np.sqrt(np.mean((mu[log.time >= SETTLED] - 1.0) ** 2)))
    assert run.estimator.bounds == {"mu": (0.05, 1.0)}
    assert run.truth == {"mu": 1.0}
    (_, ekf, _), (_, mhe, _) = driven("plain", "ekf"), driven("plain", "mhe")
    np.testing.assert_allclose(mhe.observed, ekf.observed, atol=0.02)


def test_questions_are_what_they_say():
    kinds = {name: runs()["late", name, 0].estimator for name in CONTENDERS}
    assert isinstance(kinds["ekf"], ExtendedKalman)
    assert kinds["ekf"].gate is None
    assert kinds["gated"].gate == rumo.estimation.OutlierGate()
    assert isinstance(kinds["mhe"], MovingHorizon)
    assert kinds["robust"].huber < kinds["mhe"].huber == np.inf
    late = runs()["late", "ekf", 0].drive.scenario
    assert late.sensors.late == kinds["ekf"].late == {"p_x": 3.0, "p_y": 3.0}
    start = runs()["start", "ekf", 0]
    seen = start.drive.scenario.sensors.measured
    assert {"psi", "v_y"}.isdisjoint(seen)
    assert start.after == 0.0
    psi = start.drive.scenario.x["psi"]
    assert start.estimator.x["psi"] == pytest.approx(psi + 0.4)
    first = driven("start", "ekf")[1].isel(time=0)
    assert float((first.observed - first.true_observed).sel(observed_state="psi")) == pytest.approx(0.4, abs=0.05)


def test_seeds_are_taken_together():
    every = [
        {
            "rmse": {"position": error},
            "settled_s": settled,
            "beyond": None,
            "farthest": None,
            "nis": 7.0,
            "nis_expected": 7.0,
            "lost": lost,
            "lateral_deviation_rms_m": 0.1,
            "lateral_deviation_max_m": 0.2,
            "time_off_track_s": 0.0,
            "update_time_us": time,
        }
        for error, settled, lost, time in ((0.1, 0.4, False, 20.0), (0.3, 0.2, True, 30.0), (0.2, 0.0, False, 70.0))
    ]
    found = together(every)
    assert (found["drives"], found["lost"], found["settled_s"]) == (3, 1, 0.4)
    assert (found["rmse"]["position"], found["position_worst_m"], found["update_time_us"]) == (0.2, 0.3, 30.0)
    assert together([*every, {**every[0], "settled_s": None}])["settled_s"] is None
    lost = {**every[0], "rmse": {"position": None}, "lost": True}  # before errors count
    assert together([*every, lost])["position_worst_m"] == 0.3
    assert together([lost])["position_worst_m"] is None

    class Made:
        outcome = every[0]

    content = by_question({"plain": {"ekf": {0: Made()}, "mhe": {0: Made()}}})
    assert content["plain"]["estimators"]["mhe"]["update_time_ratio"] == 1.0


def entry(position, ratio=1.0, mu=None, **others):
    usual = {"beyond": None, "farthest": None, "settled_s": 0.0, "lost": 0, "drives": 5}
    return {"rmse": {"position": position} | ({"mu": mu} if mu else {}), "update_time_ratio": ratio, **usual, **others}


@pytest.mark.parametrize(
    ("question", "estimators", "said"),
    [
        (
            "plain",
            {"ekf": entry(0.02), "mhe": entry(0.0201)},
            "EKF and MHE know the position to 0.020 m: no difference.",
        ),
        (
            "outliers",
            {"ekf": entry(1.25, lost=2), "gated": entry(0.02), "robust": entry(0.03, 40.0)},
            "EKF with gate knows the position to 0.020 m; MHE, robust to 0.030 m, EKF to 1.25 m. Drives lost: EKF 2 of "
            "5. An update takes so many times the plain filter's: MHE, robust 40.",
        ),
        (
            "bounds",
            {"ekf": entry(0.02, mu=0.1, beyond=0.25, farthest=0.125), "mhe": entry(0.02, mu=0.14, beyond=0.0)},
            "EKF and MHE know the position to 0.020 m: no difference. What is unknown besides is known by EKF to "
            "0.10, MHE to 0.14. EKF was beyond the bound in 25 % of the samples, by up to 0.12.",
        ),
        (
            "start",
            {"ekf": entry(0.02, settled_s=0.4), "mhe": entry(0.02, settled_s=None)},
            "EKF and MHE know the position to 0.020 m: no difference. The heading stays within 0.01 rad, at worst: EKF "
            "after 0.40 s, MHE never.",
        ),
        ("plain", {"ekf": entry(0.02)}, ""),
    ],
)
def test_findings_follow_from_the_numbers(question, estimators, said):
    assert finding(question, estimators) == said


@pytest.fixture(scope="module")
def studied():
    study = EstimationStudy(("plain", "bounds", "start"), ("mhe",), (0,), 2.0, 5, ROAD)
    return study, study.run()


def test_print_and_page_show_the_same(studied):
    study, results = studied
    report = study.report(results)
    figures = {figure.key: figure for figure in report.figures}
    assert list(figures) == ["errors-plain", "unknown-bounds", "errors-start"]
    for section, question in zip(report.sections, study.questions, strict=True):
        assert (section.heading, section.brief) == (QUESTIONS[question].title, True)
        table = section.content[0]
        assert [row[0] for row in table.rows] == ["MHE"]
        assert len(table.heads) == len(table.rows[0])
    errors = figures["errors-plain"]
    assert isinstance(errors, Panels)
    (_, lines), *_ = errors.panels
    found = report.summary["questions"]["plain"]["estimators"]["mhe"]["rmse"]
    assert lines[0].x[1] == pytest.approx(found["psi"] / report.summary["noise"]["psi"])
    for figure in figures.values():
        draw(figure).draw_without_rendering()
        plot(figure)
    json.dumps(report.summary, allow_nan=False)


def test_a_study_goes_on_with_what_was_kept(studied):
    study, results = studied
    kept = json.loads(json.dumps(study.record(results["plain"]["mhe"][0]), allow_nan=False))
    assert study.restored(kept).outcome == results["plain"]["mhe"][0].outcome
    assert study.report(nested({("plain", "mhe", 0): study.restored(kept)})).figures


def test_a_table_says_who_never_settled(studied):
    study, results = studied
    asked = study.summary(results)["questions"]["start"]
    asked["estimators"]["mhe"]["settled_s"] = None
    table = errors_table("start", asked)
    assert [row[table.heads.index("Settled\nafter [s]")] for row in table.rows] == ["never"]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"questions": ("outlier",)}, "questions: got 'outlier', expected one of .* Did you mean 'outliers'"),
        ({"estimators": ()}, "estimators: got none, expected some of ekf, gated, mhe, robust"),
        ({"seeds": ()}, r"seeds: got \(\), expected at least one seed such as 0"),
        ({"seeds": (-1,)}, "seeds: got -1, expected a whole number of at least 0"),
        ({"duration": 1.0}, "duration: got 1 s, expected at least 2 s"),
        ({"window": 3}, "window: got 3, expected a whole number of at least 4"),
        ({"base": "club"}, "base: got 'club', expected a rumo.Drive"),
    ],
)
def test_bad_settings(settings, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        replace(SHORT, **settings)


def test_the_command_writes_all_it_promises(tmp_path):
    of = ("--questions", "start", "--estimators", "ekf", "--seeds", "0", "--duration", "2", "--track", "oval")
    result = CliRunner().invoke(app, ["study", "estimation", *of, "--json", "--output", str(tmp_path)])
    assert result.exit_code == 0, result.output
    names = {"errors-start.png", "errors-start.pdf", "results.jsonl", "summary.json", "report.html"}
    assert {path.name for path in tmp_path.iterdir()} == names
    content = json.loads(result.stdout)
    assert (content["study"], content["track"], content["window"]) == ("estimation", "oval", 10)
    assert content["questions"]["start"]["estimators"]["ekf"]["drives"] == 1
