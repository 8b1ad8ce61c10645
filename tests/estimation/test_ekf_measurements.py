"""Late, missing, implausible and biased measurements, and unknowns beside the states."""

import re
from dataclasses import replace

import numpy as np
import pytest
from filters import NOISE, PROCESS, drive, estimates, noisy, pendulum_with_outputs
from scipy.linalg import expm

import rumo
from rumo.estimation import ExtendedKalman, ExtraState, OutlierGate
from rumo.simulation import Constant
from rumo.studies import PaperStudy
from rumo.studies.paper import kalman_filter

DT = 0.05


def swinging(times, drag=0.1, gravity=9.81):
    """Angle and rate at any times, without a torque: in closed form."""
    A = np.array([[0.0, 1.0], [-gravity, -drag]])
    return np.array([expm(A * t) @ [0.4, 0.1] for t in times])


@pytest.mark.parametrize("age", [0.4, 1.0, 1.3, 2.75])
@pytest.mark.parametrize("said", ["late", "age"])
def test_measurements_belong_to_times_between_samples(age, said):
    """Without noise, and with a scheme that is exact, innovations are none; with the age rounded they are."""
    problem, times = pendulum_with_outputs(), DT * np.arange(60)
    now, then = swinging(times), swinging(times - age * DT)
    samples = np.column_stack([then[:, 0], now[:, 1]])
    first = {"x": {"angle": 0.4}, "deviations": {"angle": 0.1}, "scheme": rumo.Radau3()}
    ages = {"late": {"angle": age}} if said == "late" else {"age": {"angle": age * DT}}
    told, _ = estimates(problem, samples, np.zeros((60, 1)), **ages, **first)
    np.testing.assert_allclose([estimate.x for estimate in told], now, atol=1e-5)
    rounded, _ = estimates(problem, samples, np.zeros((60, 1)), late={"angle": np.floor(age)}, **first)
    if age % 1.0:
        assert np.abs([estimate.x for estimate in rounded] - now)[20:].max() > 1e-3


def test_rates_of_their_own():
    """Every third sample of the angle, every second of the rate: the deviations say what that is worth."""
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 400)
    samples = noisy(x)
    samples[np.arange(400) % 3 > 0, 0] = samples[np.arange(400) % 2 > 0, 1] = np.nan
    told, _ = estimates(problem, samples, torques)
    error = np.array([estimate.x for estimate in told]) - x
    deviation = np.array([np.sqrt(np.diag(estimate.covariance)) for estimate in told])
    mean_square = ((error / deviation)[20:] ** 2).mean(axis=0)
    assert ((mean_square > 0.6) & (mean_square < 1.5)).all()


def test_a_channel_that_never_comes_does_not_block():
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 60)
    samples = noisy(x)
    samples[:, 0] = np.nan
    told, _ = estimates(problem, samples, torques, x={"angle": 0.3}, deviations={"angle": 0.2})
    assert np.abs(told[0].x - [0.3, samples[0, 1]]).max() == 0.0
    assert np.abs(told[-1].x - x[-1])[0] < 4.0 * np.sqrt(told[-1].covariance[0, 0])
    blocked, _ = estimates(problem, samples, torques)
    assert all(np.isnan(estimate.x[0]) for estimate in blocked)


def test_the_first_measurement_corrects_a_first_estimate():
    problem = pendulum_with_outputs()
    told, _ = estimates(problem, np.array([[0.5, 0.0]]), np.zeros((1, 1)), x={"angle": 0.3}, deviations={"angle": 0.02})
    np.testing.assert_allclose(told[0].x, [0.4, 0.0], atol=1e-12)  # half way between equals
    assert told[0].covariance[0, 0] == pytest.approx(0.5 * 0.02**2)


def test_outliers_are_refused_one_by_one():
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 300)
    clean = noisy(x)
    spoilt = clean.copy()
    spoilt[np.arange(300) % 10 == 5, 0] += 0.5
    gated, running = estimates(problem, spoilt, torques, gate=OutlierGate(4.0))
    open_, _ = estimates(problem, spoilt, torques)
    best, _ = estimates(problem, clean, torques)
    rms = [float(np.sqrt(((np.array([e.x for e in told]) - x)[20:] ** 2).mean())) for told in (gated, open_, best)]
    assert rms[0] < 1.1 * rms[2] < 0.7 * rms[1]
    refused = np.array([~e.innovation.used for e in gated[1:]])
    assert refused[np.arange(1, 300) % 10 == 5, 0].all()
    assert refused[:, 1].sum() == 0
    assert running.innovation is gated[-1].innovation


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_a_filter_that_is_wrong_recovers(backend):
    """It is moved by a metre behind its back: after `patience` refusals it listens again, and is right at once."""
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 120)
    samples = noisy(x)
    samples[60:, 0] += 2.0  # as if the origin had been moved; the rate stays what it was
    told, _ = estimates(problem, samples, torques, gate=OutlierGate(4.0, patience=5), backend=backend)
    used = np.array([e.innovation.used[0] for e in told[1:]])
    assert not used[59:64].any()
    assert used[64]
    assert abs(told[65].x[0] - samples[65, 0]) < 0.3
    assert told[65].innovation.deviations[0] == pytest.approx(abs(told[65].innovation.values[0]) / 4.0)


def test_an_unknown_parameter_is_found_and_told():
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 600, parameters={"gravity": 7.0})
    told, _ = estimates(problem, noisy(x), torques, extra={"gravity": ExtraState(0.01, 2.0)})
    last = told[-1]
    assert abs(last.parameters["gravity"] - 7.0) < 4.0 * last.deviations["gravity"]
    assert last.deviations["gravity"] < 0.5
    assert told[0].parameters == {"gravity": 9.81}  # what the controller believes
    assert last.covariance.shape == (2, 2)


def test_a_bias_is_found_where_another_sensor_tells():
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 400)
    samples = np.column_stack([noisy(x), torques[:, 0] - 9.81 * x[:, 0] + 0.8])
    told, _ = estimates(
        problem,
        samples,
        torques,
        measured=("angle", "rate", "force"),
        noise=NOISE | {"force": 0.1},
        extra={"force": ExtraState(0.001, 1.0)},
    )
    assert told[-1].biases["force"] == pytest.approx(0.8, abs=4.0 * told[-1].deviations["force"])
    assert told[-1].deviations["force"] < 0.05


def test_a_floor_keeps_the_filter_open():
    problem = pendulum_with_outputs()
    tiny = {"angle": 1e-7, "rate": 1e-7}
    for backend in ("portable", "reference"):
        closed, _ = estimates(problem, np.zeros((300, 2)), np.zeros((300, 1)), process=tiny, backend=backend)
        kept, _ = estimates(
            problem, np.zeros((300, 2)), np.zeros((300, 1)), process=tiny, floor={"angle": 0.01}, backend=backend
        )
        least = 0.01 * 0.02 / np.hypot(0.01, 0.02)  # of the prediction's floor and a reading's noise together,
        assert np.sqrt(closed[-1].covariance[0, 0]) < 0.004
        assert 0.99 * least < np.sqrt(kept[-1].covariance[0, 0]) < least  # less what the rate's reading adds


def test_wind_that_is_estimated_is_told_to_the_controller():
    """In a loop: the estimate of the wind reaches the controller's parameters, and the log."""
    wind = {"wind_speed": ExtraState(0.5, 4.0, start=4.0)}
    study = PaperStudy(duration=8.0, estimator=replace(kalman_filter(), extra=wind), wind=Constant(8.0))
    across = study.problem().changed(parameters={"wind_direction": np.pi / 2.0})
    scenario = replace(study.runs()["rti",], problem=across)
    loop = rumo.ClosedLoop(scenario)
    column = scenario.problem.model.parameters.index("wind_speed")
    for sample in loop:
        assert sample.parameters[0, column] == sample.estimate.parameters["wind_speed"]
    assert loop.controller.parameters[0, column] == 0.0  # its own again
    log = scenario.run()
    found = log["estimated_parameters"].sel(model_parameter="wind_speed")
    assert 5.0 < float(found[-50:].mean()) < 9.0  # it began at 4, and slowly sees that there are 8
    assert np.isnan(log["estimated_parameters"].sel(model_parameter="wind_direction")).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"late": {"angle": -0.5}}, "late['angle']: got -0.5, expected a number of at least 0"),
        ({"age": {"angle": np.inf}}, "age['angle']: got inf, expected a finite number"),
        ({"age": {"angel": 0.1}}, "age: got 'angel', expected one of angle, rate. Did you mean 'angle'?"),
        ({"late": {"angle": 1}, "age": {"angle": 0.1}}, "age['angle']: got 0.1 s, expected nothing"),
        ({"extra": {"wind": ExtraState(1.0, 1.0)}}, "extra: got 'wind', expected one of gravity, drag, angle, rate"),
        ({"extra": {"drag": 0.1}}, "extra['drag']: got 0.1, expected a rumo.ExtraState"),
        ({"floor": {"angle": -1.0}}, "floor['angle']: got -1.0, expected a number of at least 0"),
        ({"gate": 4.0}, "gate: got 4.0, expected a rumo.OutlierGate"),
        ({"discretization": "euler"}, "discretization: got 'euler', expected a rumo.Discretization"),
        ({"backend": "fast"}, "backend: got 'fast', expected one of auto, portable, reference"),
    ],
)
def test_settings_are_checked(changes, message):
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        ExtendedKalman(NOISE, PROCESS, **changes).start(pendulum_with_outputs())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ExtraState(-1.0, 1.0), "ExtraState.drift"),
        (lambda: ExtraState(1.0, 0.0), "ExtraState.deviation"),
        (lambda: ExtraState(1.0, 1.0, np.nan), "ExtraState.start"),
        (lambda: OutlierGate(0.0), "OutlierGate.width"),
        (lambda: OutlierGate(4.0, -1), "OutlierGate.patience"),
    ],
)
def test_parts_are_checked(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()


class Old:
    """An estimator as they were before they were told a scheme."""

    def start(self, problem, measured=None):
        return self

    def update(self, measured, applied, parameters):
        return rumo.estimation.Estimate(measured)


def test_estimators_are_told_the_scheme():
    problem = pendulum_with_outputs()
    told = []

    class Listening(Old):
        def start(self, problem, measured=None, discretization=None):
            told.append(discretization)
            return self

    scenario = rumo.Scenario(
        problem, problem.model, [0.1, 0.0], {"angle": 0.0}, 0.2, discretization=rumo.Radau2(), estimator=Listening()
    )
    scenario.run()
    assert told == [rumo.Radau2()]
    with pytest.raises(rumo.ArgumentError, match=r"estimator.start.*problem, measured, discretization"):
        replace(scenario, estimator=Old()).run()
