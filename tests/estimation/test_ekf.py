"""The extended Kalman filter against the closed form, and at work."""

import re

import numpy as np
import pytest
from problems import pendulum, tank
from scipy.linalg import solve_discrete_are

import rumo
from rumo.estimation import Butterworth, ExtendedKalman
from rumo.references import SinePath
from rumo.studies import PaperStudy
from rumo.studies.kpis import driving_kpis
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


def test_starts_when_each_state_has_been_measured_once():
    running = started(pendulum())
    np.testing.assert_array_equal(running(np.array([0.1, np.nan]), np.zeros(1)), [0.1, np.nan])
    np.testing.assert_array_equal(running(np.array([0.2, np.inf]), np.zeros(1)), [0.2, np.nan])
    np.testing.assert_array_equal(running(np.array([np.nan, 0.3]), np.zeros(1)), [0.2, 0.3])
    assert np.isfinite(running(np.full(2, np.nan), np.zeros(1))).all()


def test_starts_without_a_sensor_whose_state_has_a_first_estimate():
    running = started(pendulum(), x={"rate": 0.5}, deviations={"rate": 0.1})
    np.testing.assert_array_equal(running(np.array([0.1, np.nan]), np.zeros(1)), [0.1, 0.5])
    assert np.isfinite(running(np.array([0.1, np.nan]), np.zeros(1))).all()


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


def oscillator(**changes):
    """A pendulum whose length above ground and reaction force are outputs, driven by a known torque."""
    model = rumo.Model(
        states={"angle": "rad", "rate": "rad/s"},
        inputs={"torque": "N m"},
        dynamics=lambda x, u, p: {"angle": x.rate, "rate": u.torque - p.gravity * x.angle},
        parameters={"gravity": rumo.Parameter("m/s^2", 9.81)},
        outputs={
            "height": rumo.Output("m", lambda x, u, p: x.angle**2),
            "force": rumo.Output("N", lambda x, u, p: u.torque - p.gravity * x.angle),
        },
    )
    return pendulum(**({"model": model} | changes))


def driven(problem, samples=80, seed=0):
    """States (K, 2) of the discretised model with some process noise, and the torque before each sample."""
    rng, dt, (torque, gravity) = np.random.default_rng(seed), problem.sampling_time, (0.0, 9.81)
    A = np.linalg.inv(np.eye(2) - dt * np.array([[0.0, 1.0], [-gravity, 0.0]]))
    x, states, torques = np.array([0.4, 0.1]), [], []
    for k in range(samples):
        states.append(x)
        torques.append(torque)
        torque = np.sin(0.3 * k)
        x = A @ (x + dt * np.array([0.0, torque])) + rng.normal(size=2) * [0.001, 0.05]
    return np.array(states), np.array(torques)


def kalman(problem, noise, measured, samples, torques, **settings):
    """Estimates (K, 2) and deviations (K, 2) for measurements (K, m)."""
    running = ExtendedKalman(noise, PROCESS, **settings).start(problem, measured)
    estimates = [running.update(y, np.array([u]), problem.parameters[0]) for y, u in zip(samples, torques, strict=True)]
    assert all(estimate.covariance is not None for estimate in estimates)
    return (
        np.array([estimate.x for estimate in estimates]),
        np.array([np.sqrt(np.diag(estimate.covariance)) for estimate in estimates]),
    )


@pytest.mark.parametrize("measured", [("angle",), ("force",), ("height", "rate"), ("rate", "angle", "force")])
def test_states_are_found_from_any_measurements(measured):
    problem = oscillator()
    x, torques = driven(problem)
    every = {"angle": x[:, 0], "rate": x[:, 1], "height": x[:, 0] ** 2, "force": torques - 9.81 * x[:, 0]}
    sigma = {"angle": 0.02, "rate": 0.1, "height": 0.005, "force": 0.2}
    rng = np.random.default_rng(1)
    samples = np.column_stack([every[name] + sigma[name] * rng.normal(size=len(x)) for name in measured])
    first = {name: value for name, value in {"angle": 0.35, "rate": 0.0}.items() if name not in measured}
    estimates, deviations = kalman(
        problem,
        {name: sigma[name] for name in measured},
        measured,
        samples,
        torques,
        x=first,
        deviations=dict.fromkeys(first, 0.3),
    )
    error = np.abs(estimates - x)[20:]
    # 60 samples of both states within four of the filter's own deviations, and these small.
    assert (error < 4.0 * deviations[20:]).all()
    assert (deviations[20:].max(axis=0) < [0.08, 0.25]).all()


def test_late_measurements_count_for_when_they_were_made():
    """What has arrived, at once or late, gives the same estimate once nothing is under way."""
    problem = oscillator()
    x, torques = driven(problem)
    samples = x + np.random.default_rng(1).normal(size=x.shape) * [0.02, 0.1]
    samples[-3:] = np.nan  # the last measurements are lost
    late = np.vstack([np.full((3, 1), np.nan), samples[:-3, 1:]])
    settings = {"x": {"rate": samples[0, 1]}, "deviations": {"rate": 0.1}}
    prompt, _ = kalman(problem, NOISE, None, samples, torques)
    behind, _ = kalman(problem, NOISE, None, np.hstack([samples[:, :1], late]), torques, late={"rate": 3}, **settings)
    np.testing.assert_allclose(behind[-1], prompt[-1], rtol=1e-10)
    taken_as_new, _ = kalman(problem, NOISE, None, np.hstack([samples[:, :1], late])[3:], torques[3:])
    assert np.abs(behind - x)[20:].max() < 0.7 * np.abs(taken_as_new - x[3:])[17:].max()


def test_measurements_of_algebraic_variables():
    """A capacitor: its charge, seen through the current that charges it."""
    model = rumo.Model(
        states={"charge": "C"},
        inputs={"voltage": "V"},
        dynamics=lambda x, u, p: {"charge": x.current},
        algebraic={"current": rumo.Algebraic("A", lambda x, u, p: u.voltage - 2.0 * x.current - x.charge / 0.5)},
    )
    problem = rumo.Problem(
        model, horizon=5, sampling_time=0.1, track={"charge": rumo.Weight(1.0)}, moves={"voltage": rumo.Weight(0.1)}
    )
    running = ExtendedKalman({"current": 1e-4}, {"charge": 1e-3}, {"charge": 0.0}, {"charge": 1.0}).start(
        problem, ("current",)
    )
    nothing = np.zeros(0)
    running.update(np.array([np.nan]), np.zeros(1), nothing)
    # Half an ampere at 2 V through 2 ohm: the capacitor is at 1 V, half a coulomb.
    estimate = running.update(np.array([0.5]), np.array([2.0]), nothing)
    assert estimate.x[0] == pytest.approx(0.5, abs=1e-3)
    assert estimate.covariance[0, 0] < 1e-6


def test_parameters_are_those_of_the_sample():
    problem = oscillator()
    running = ExtendedKalman(NOISE, PROCESS).start(problem)
    start, torque = np.array([0.2, 0.1]), np.array([0.5])
    running.update(start, torque, np.array([9.81]))
    estimate = running.update(np.full(2, np.nan), torque, np.array([2.0])).x
    dt = problem.sampling_time
    A = np.linalg.inv(np.eye(2) - dt * np.array([[0.0, 1.0], [-2.0, 0.0]]))
    np.testing.assert_allclose(estimate, A @ (start + dt * np.array([0.0, 0.5])), rtol=1e-12)


def test_in_a_simulation():
    problem = oscillator()
    log = rumo.simulate(
        rumo.RealTimeIteration(problem),
        problem.model,
        [0.3, 0.0],
        {"angle": 0.1},
        4.0,
        sensors=rumo.Sensors({"height": 0.002, "force": 0.05}, ("height", "force"), {"height": 2}),
        estimator=ExtendedKalman(
            {"height": 0.002, "force": 0.05},
            PROCESS,
            x={"angle": 0.25, "rate": 0.0},
            deviations={"angle": 0.1, "rate": 0.2},
            late={"height": 2},
        ),
        faults=[rumo.faults.Missing((1.0, 1.2))],
    )
    error = np.abs(log["estimated"] - log["true_states"])
    assert (error[40:] < 4.0 * log["estimated_deviation"][40:]).all()
    assert float(error[40:].max()) < 0.2
    assert np.isnan(log["measured"]).all()
    assert np.isnan(log["measured_outputs"].sel(measured_output="height")[:2]).all()


@pytest.mark.parametrize(
    ("settings", "measured", "message"),
    [
        ({"x": [0.0]}, ("angle",), "ExtendedKalman.x: got [0.0], expected a mapping from names."),
        ({"x": {"rate": 0.0}, "deviations": 0.1}, ("angle",), "ExtendedKalman.deviations: got 0.1, expected a mapping"),
        ({}, ("angle",), "x: got no value for rate, expected all of rate."),
        ({"x": {"rate": 0.0}}, ("angle",), "deviations: got no value for rate, expected all of rate."),
        ({"x": {"rate": 0.0, "angel": 1.0}}, ("angle",), "x: got 'angel', expected one of rate."),
        (
            {"x": {"rate": 0.0, "angle": 1.0}, "deviations": {"rate": 0.1}},
            ("angle",),
            "deviations: got no value for angle",
        ),
        ({"late": {"rate": 1}}, ("angle",), "late: got 'rate', expected one of angle."),
        ({"late": {"angle": 1}}, ("angle",), "x: got no value for angle, rate, expected all of angle, rate."),
        ({}, ("angel",), "measured: got 'angel', expected one of angle, rate. Did you mean 'angle'?"),
    ],
)
def test_partial_settings_are_checked(settings, measured, message):
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        ExtendedKalman({"angle": 0.02}, PROCESS, **settings).start(pendulum(), measured)
