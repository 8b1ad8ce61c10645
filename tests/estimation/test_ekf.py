"""The extended Kalman filter against the closed form, and at work."""

import re

import numpy as np
import pytest
from problems import pendulum, tank
from scipy.linalg import solve_discrete_are

import rumo
from rumo.estimation import Butterworth, ExtendedKalman
from rumo.references import SinePath
from rumo.report.kpis import driving_kpis
from rumo.studies import PaperStudy
from rumo.studies.paper import kalman_filter
from rumo.vehicles import PAPER_CAR

NOISE = {"angle": 0.02, "rate": 0.1}
PROCESS = {"angle": 0.001, "rate": 0.05}


def started(problem, noise=NOISE, process=PROCESS, measured=None, **settings):
    """(measurement, applied) -> estimate of a fresh filter."""
    running = ExtendedKalman(noise, process, **settings).start(problem, measured)
    return lambda measurement, applied: running.update(measurement, applied, problem.parameters[0]).x


def test_on_a_linear_model_the_gain_becomes_the_stationary_one():
    problem = pendulum()
    columns = []
    for unit in np.eye(2):
        running = started(problem)
        for _ in range(300):
            running(np.zeros(2), np.zeros(1))
        columns.append(running(unit, np.zeros(1)))
    gain = np.column_stack(columns)

    dt = problem.sampling_time
    A = np.linalg.inv(np.eye(2) - dt * np.array([[0.0, 1.0], [-9.81, 0.0]]))
    Q, R = (np.diag(np.square(list(sigma.values()))) for sigma in (PROCESS, NOISE))
    P = solve_discrete_are(A.T, np.eye(2), Q, R)  # covariance of the prediction
    np.testing.assert_allclose(gain, P @ np.linalg.inv(P + R), rtol=1e-8)


def test_missing_entries_are_predicted():
    problem = pendulum()
    running = started(problem)
    assert np.isnan(running(np.array([np.nan, 0.0]), np.zeros(1))).any()  # nothing known yet
    np.testing.assert_array_equal(running(np.array([0.2, 0.1]), np.zeros(1)), [0.2, 0.1])
    estimate = running(np.array([np.nan, np.inf]), np.array([1.5]))
    dt = problem.sampling_time
    A = np.linalg.inv(np.eye(2) - dt * np.array([[0.0, 1.0], [-9.81, 0.0]]))
    np.testing.assert_allclose(estimate, A @ (np.array([0.2, 0.1]) + dt * np.array([0.0, 1.5])), rtol=1e-12)
    assert np.isfinite(running(np.array([0.2, np.nan]), np.zeros(1))).all()


def test_angles_turn_around():
    running = started(spinning())
    estimates = []
    for k in range(60):
        angle = 2.0 * k * 0.05  # 2 rad/s: once around, measured between -pi and pi
        estimates.append(running(np.array([np.angle(np.exp(1j * angle)), 2.0]), np.zeros(1))[0])
    np.testing.assert_allclose(estimates, 2.0 * 0.05 * np.arange(60), atol=1e-9)


def spinning():
    model = rumo.Model(
        states={"angle": "rad", "rate": "rad/s"},
        inputs={"torque": "N m"},
        dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque},
    )
    return pendulum(model=model)


def test_memory_stays_sound_where_the_model_has_no_value():
    running = started(tank(sampling_time=0.1), {"level": 0.1}, {"level": 0.1})
    for level in (0.5, 0.4, -0.3, -0.3, 0.4, 0.4):
        estimate = running(np.array([level]), np.array([0.6]))
    assert estimate[0] == pytest.approx(0.4, abs=0.05)


def test_a_singular_prediction_starts_anew():
    model = rumo.Model(states={"a": "1"}, inputs={"push": "1"}, dynamics=lambda x, u, p: {"a": 10.0 * x.a + u.push})
    problem = rumo.Problem(
        model, horizon=5, sampling_time=0.1, track={"a": rumo.Weight(1.0)}, moves={"push": rumo.Weight(1.0)}
    )
    running = started(problem, {"a": 0.1}, {"a": 0.1})
    assert [running(np.array([value]), np.zeros(1))[0] for value in (1.0, 2.0, 3.0)] == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("noise", "process", "message"),
    [
        ({"angle": 0.1}, PROCESS, "noise: got no value for rate, expected all of angle, rate."),
        (NOISE, PROCESS | {"rate": 0.0}, "process['rate']: got 0, expected a positive standard deviation."),
    ],
)
def test_settings_are_checked(noise, process, message):
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        ExtendedKalman(noise, process).start(pendulum())


def test_the_low_pass_filters_lag_is_the_tracking_error_at_speed():
    weights = {
        "p_x": rumo.Weight(10.0, 50.0),
        "p_y": rumo.Weight(10.0, 6.0),
        "psi": rumo.Weight(1.0, 0.6),
        "v_x": rumo.Weight(1.0, 10.0),
    }
    path = SinePath(3.0, 50.0, 12.0, PAPER_CAR)
    rms = {}
    for estimator in (Butterworth(), kalman_filter()):
        study = PaperStudy(("rti",), path=path, weights=weights, estimator=estimator)
        rms[type(estimator)] = driving_kpis(study.run()["rti"])["tracking_error_rms_after_2s_m"]
    assert rms[ExtendedKalman] < 0.5 * rms[Butterworth]
