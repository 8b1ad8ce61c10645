"""The core's filter equals the textbook's, and both keep covariances that are covariances."""

import numpy as np
import pytest
from filters import NOISE, PROCESS, drive, estimates, noisy, pendulum_with_outputs
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import pendulum

import rumo
from rumo.estimation import ExtendedKalman, ExtraState, OutlierGate
from rumo.studies import PaperStudy
from rumo.studies.paper import kalman_filter


def assert_same(problem, samples, torques, rtol=1e-7, **settings):
    """Both engines, sample by sample; returns what they agree on."""
    both = [
        estimates(problem, samples, torques, backend=backend, **settings)[0] for backend in ("reference", "portable")
    ]
    for one, other in zip(*both, strict=True):
        np.testing.assert_allclose(one.x, other.x, rtol=rtol, atol=1e-9)
        if one.covariance is not None:
            np.testing.assert_allclose(one.covariance, other.covariance, rtol=rtol, atol=1e-12)
            np.testing.assert_allclose(list(one.parameters.values()), list(other.parameters.values()), rtol=rtol)
            np.testing.assert_allclose(list(one.biases.values()), list(other.biases.values()), rtol=rtol, atol=1e-9)
        if one.innovation is not None:
            np.testing.assert_array_equal(one.innovation.used, other.innovation.used)
            np.testing.assert_allclose(one.innovation.values, other.innovation.values, rtol=rtol, atol=1e-9)
            np.testing.assert_allclose(one.innovation.deviations, other.innovation.deviations, rtol=rtol)
            np.testing.assert_allclose(one.innovation.nis, other.innovation.nis, rtol=1e-6, atol=1e-9)
            np.testing.assert_allclose(
                one.innovation.log_likelihood, other.innovation.log_likelihood, rtol=1e-6, atol=1e-6
            )
    return both[0]


SCHEMES = (None, rumo.Radau2(), rumo.Trapezoidal(substeps=2), rumo.Rk4(substeps=2), rumo.Sdirk2())


@settings(max_examples=15, deadline=None)
@given(
    st.sampled_from(SCHEMES),
    st.sets(st.sampled_from(["angle", "rate", "height", "force"]), min_size=1),
    st.sampled_from([{}, {"gravity": ExtraState(0.1, 1.0)}, {"gravity": ExtraState(0.1, 1.0, 9.0)}]),
    st.booleans(),
    st.sampled_from([None, OutlierGate(2.0, 1), OutlierGate(3.0, 0)]),
    st.sampled_from([{}, {"rate": 0.08}]),
    st.sampled_from([0.0, 1.0, 0.4, 2.3]),
    st.integers(0, 2**31),
)
def test_the_core_is_the_reference(scheme, names, extra, biased, gate, floor, late, seed):
    problem, names = pendulum_with_outputs(), tuple(sorted(names))
    x, torques = drive(problem, 30, seed % 7)
    every = {"angle": x[:, 0], "rate": x[:, 1], "height": x[:, 0] ** 2, "force": torques[:, 0] - 9.81 * x[:, 0]}
    rng = np.random.default_rng(seed)
    samples = np.column_stack([every[name] for name in names]) + 0.05 * rng.normal(size=(30, len(names)))
    samples[rng.random(samples.shape) < 0.2] = np.nan
    samples[rng.random(samples.shape) < 0.1] += 3.0
    assert_same(
        problem,
        samples,
        torques,
        measured=names,
        scheme=scheme,
        noise=dict.fromkeys(names, 0.05),
        x={"angle": 0.3, "rate": 0.0},
        deviations={"angle": 0.2, "rate": 0.2},
        late={names[0]: late},
        extra=extra | ({names[-1]: ExtraState(0.01, 0.1)} if biased else {}),
        gate=gate,
        floor=floor,
    )


def test_the_car_in_wind_as_well():
    study = PaperStudy(duration=2.0)
    log, problem = study.scenario("rti", study.problem(), study.plant()).run(), study.problem()
    names = tuple(problem.model.states)
    filters = kalman_filter()
    assert_same(
        problem,
        log["received"].to_numpy(),
        log["applied"].to_numpy(),
        measured=names,
        scheme=rumo.Radau2(),
        noise=filters.noise,
        process=filters.process,
        extra={"wind_speed": ExtraState(0.5, 1.0)},
        gate=OutlierGate(),
        rtol=1e-6,
    )


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_covariances_stay_what_they_are_over_long_runs(backend):
    """States of sizes 1e9 apart, hardly any process noise, and sensors that are nearly exact, or hardly say a thing."""
    model = rumo.Model(
        states={"far": "m", "near": "m", "slow": "1"},
        inputs={"push": "m/s"},
        dynamics=lambda x, u, p: {"far": 1e5 * x.near + u.push, "near": x.slow * 1e-3 - x.near, "slow": -0.1 * x.slow},
    )
    problem = rumo.Problem(
        model, horizon=2, sampling_time=0.01, track={"far": rumo.Weight(1.0)}, moves={"push": rumo.Weight(1.0)}
    )
    running = ExtendedKalman(
        {"far": 1e3, "near": 1e-7},
        {"far": 1e-9, "near": 1e-10, "slow": 1e-12},
        {"slow": 0.0},
        {"slow": 10.0},
        backend=backend,
    ).start(problem, ("far", "near"))
    rng, u, nothing = np.random.default_rng(0), np.zeros(1), np.zeros(0)
    for k in range(100_000 if backend == "portable" else 2_000):
        estimate = running.update(rng.normal(size=2) * [1e3, 1e-7], u, nothing)
        if k % 500 == 0:
            P = estimate.covariance
            np.testing.assert_array_equal(P, P.T)
            scale = np.sqrt(np.diag(P))
            assert (scale > 0.0).all()
            assert np.linalg.eigvalsh(P / np.outer(scale, scale)).min() > -1e-12
    assert np.abs(estimate.x / scale).max() < 10.0  # it has kept listening, and believes no more than it knows


def test_measurements_of_algebraic_variables_are_for_the_reference():
    model = rumo.Model(
        states={"charge": "C"},
        inputs={"voltage": "V"},
        dynamics=lambda x, u, p: {"charge": x.current},
        algebraic={"current": rumo.Algebraic("A", lambda x, u, p: u.voltage - 2.0 * x.current - x.charge / 0.5)},
    )
    problem = rumo.Problem(
        model, horizon=5, sampling_time=0.1, track={"charge": rumo.Weight(1.0)}, moves={"voltage": rumo.Weight(0.1)}
    )
    seen = {"noise": {"current": 0.1}, "process": {"charge": 0.1}, "x": {"charge": 0.0}, "deviations": {"charge": 1.0}}
    assert ExtendedKalman(**seen).start(problem, ("current",)).backend == "reference"
    with pytest.raises(rumo.ArgumentError, match="a measurement depends on algebraic variables"):
        ExtendedKalman(**seen, backend="portable").start(problem, ("current",))
    direct = ExtendedKalman({"charge": 0.1}, {"charge": 0.1})
    assert direct.start(problem).backend == "portable"
    assert direct.start(problem).update(np.array([0.5]), np.ones(1), np.zeros(0)).x == [0.5]


def test_a_linear_filter_is_the_textbooks():
    """Against the recursion in covariances, Joseph's form, written out."""
    problem = pendulum()
    x, torques = drive(pendulum_with_outputs(), 40)
    samples = noisy(x)
    told, _ = estimates(problem, samples, torques)
    dt = problem.sampling_time
    A = np.linalg.inv(np.eye(2) - dt * np.array([[0.0, 1.0], [-9.81, 0.0]]))
    Q, R = (np.diag(np.square(list(sigma.values()))) for sigma in (PROCESS, NOISE))
    state, P = samples[0], R
    for k in range(1, 40):
        state, P = A @ (state + dt * np.array([0.0, torques[k, 0]])), A @ P @ A.T + Q
        gain = P @ np.linalg.inv(P + R)
        innovation = samples[k] - state
        nis = innovation @ np.linalg.solve(P + R, innovation)
        likelihood = -0.5 * (nis + np.linalg.slogdet(2.0 * np.pi * (P + R))[1])
        state = state + gain @ innovation
        P = (np.eye(2) - gain) @ P @ (np.eye(2) - gain).T + gain @ R @ gain.T
        np.testing.assert_allclose(told[k].x, state, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(told[k].covariance, P, rtol=1e-9)
        assert told[k].innovation.nis == pytest.approx(nis, rel=1e-8)
        assert told[k].innovation.log_likelihood == pytest.approx(likelihood, rel=1e-8)
