"""Moving horizon estimation against the Kalman filter, against other solvers, and where it knows more."""

import re
from dataclasses import replace

import numpy as np
import pytest
from filters import NOISE, PROCESS, drive, noisy, pendulum_with_outputs
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import tank
from scipy.optimize import LinearConstraint, least_squares, minimize

import rumo
from rumo.estimation import ExtendedKalman, ExtraState, MovingHorizon, OutlierGate
from rumo.estimation.mhe.program import WindowProgram
from rumo.status import Status
from rumo.transcription import Transcription

FILTER = ExtendedKalman(NOISE, PROCESS)


def told(estimator, problem, samples, torques, measured=None, scheme=None):
    running = estimator.start(problem, measured, scheme)
    return [running.update(y, u, problem.parameters[0]) for y, u in zip(samples, torques, strict=True)], running


@settings(max_examples=8, deadline=None)
@given(
    st.integers(3, 15),
    st.sampled_from([None, rumo.Radau2(), rumo.Rk4()]),
    st.booleans(),
    st.sampled_from(["portable", "reference"]),
    st.integers(0, 999),
)
def test_on_a_linear_model_it_is_the_kalman_filter(window, scheme, late, backend, seed):
    """Whatever the window, with measurements missing or late: states, covariance, innovations."""
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 40, seed)
    samples = noisy(x, seed)
    samples[np.random.default_rng(seed).random(samples.shape) < 0.2] = np.nan
    samples[0] = [0.4, 0.1]
    first = {"x": {"angle": 0.3}, "deviations": {"angle": 0.1}, "late": {"angle": 2}} if late else {}
    kalman = replace(FILTER, backend=backend, **first)
    ours, running = told(MovingHorizon(kalman, window), problem, samples, torques, scheme=scheme)
    theirs, _ = told(kalman, problem, samples, torques, scheme=scheme)
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(one.x, other.x, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(one.covariance, other.covariance, rtol=1e-7, atol=1e-12)
        if one.innovation is not None and not late:
            assert one.innovation.nis == pytest.approx(other.innovation.nis, rel=1e-6, abs=1e-9)
            assert one.innovation.log_likelihood == pytest.approx(other.innovation.log_likelihood, rel=1e-6)
    assert running.counts == {Status.OPTIMAL: 39}


def test_on_a_nonlinear_model_it_comes_to_the_least_squares():
    """While all samples are in the window: against SciPy's on the states themselves, iterated to its end."""
    problem, samples = tank(sampling_time=0.1), 14
    transcription, p = Transcription(problem), problem.parameters[0]
    rng, x, u = np.random.default_rng(0), 1.0, np.array([0.3])
    levels = []
    for _ in range(samples):
        levels.append(x)
        x = transcription.advance(np.array([x]), u, p)[0][0] + 0.02 * rng.normal()
    readings = np.array(levels) + 0.05 * rng.normal(size=samples)
    kalman = ExtendedKalman({"level": 0.05}, {"level": 0.02})
    running = MovingHorizon(kalman, 20).start(problem)
    for reading in readings:
        estimate = running.update(np.array([reading]), u, p)

    def residuals(states):
        ends = [transcription.advance(state[None], u, p)[0][0] for state in states[:-1]]
        return np.concatenate([(states - readings) / 0.05, (states[1:] - ends) / 0.02])

    best = least_squares(residuals, readings, xtol=1e-14, ftol=1e-14)
    deviation = np.sqrt(np.linalg.inv(best.jac.T @ best.jac)[-1, -1])
    assert abs(estimate.x[0] - best.x[-1]) < 0.02 * deviation
    assert np.sqrt(estimate.covariance[0, 0]) == pytest.approx(deviation, rel=0.02)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([np.inf, 0.5, 2.0]), st.booleans())
def test_programs_are_solved(seed, huber, bounded):
    """Against SciPy, on small ones with everything in them."""
    rng = np.random.default_rng(seed)
    G, r = rng.normal(size=(7, 4)), 3.0 * rng.normal(size=7)
    E = rng.normal(size=(3, 4))
    limit = rng.uniform(0.1, 0.5, 3) if bounded else np.full(3, np.inf)
    v, status = WindowProgram(G, r, E, -limit, limit, huber).solve()
    assert status is Status.OPTIMAL

    def cost(v):
        size = np.abs(r - G @ v)
        loss = np.where(size <= huber, 0.5 * size**2, huber * size - 0.5 * np.minimum(huber, 1e9) ** 2)
        return 0.5 * v @ v + loss.sum()

    within = [LinearConstraint(E, -limit, limit)] if bounded else []
    other = minimize(cost, v * 0.9, method="SLSQP", constraints=within, options={"ftol": 1e-13, "maxiter": 300})
    assert (np.abs(E @ v) <= limit + 1e-7).all()
    assert cost(v) <= other.fun + 1e-7 * (1.0 + abs(other.fun))


def test_an_outlier_pulls_no_harder_than_a_small_one():
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 200)
    spoilt = noisy(x)
    spoilt[np.arange(200) % 10 == 5, 0] += 1.0
    rms = {}
    for name, estimator in (
        ("robust", MovingHorizon(FILTER, 8, huber=2.0)),
        ("squares", MovingHorizon(FILTER, 8)),
        ("kalman", FILTER),
        ("gated", replace(FILTER, gate=OutlierGate(4.0))),
        ("clean", FILTER),
    ):
        found, running = told(estimator, problem, noisy(x) if name == "clean" else spoilt, torques)
        error = np.array([estimate.x for estimate in found]) - x
        rms[name] = np.sqrt((error[20:, 0] ** 2).mean())
        if name == "robust":
            assert running.counts == {Status.OPTIMAL: 199}
    assert rms["squares"] == pytest.approx(rms["kalman"], rel=1e-6)
    assert rms["robust"] < 0.4 * rms["kalman"]
    assert rms["robust"] < 1.6 * rms["clean"]
    assert rms["gated"] < rms["kalman"]


def test_bounds_are_kept_and_help():
    """A level is never negative: near empty, and with a poor sensor, that is worth more than the readings."""
    model = rumo.Model(
        states={"level": "m"},
        inputs={"inflow": "m/s"},
        dynamics=lambda x, u, p: {"level": u.inflow - 0.5 * x.level},
    )
    problem = rumo.Problem(
        model, horizon=3, sampling_time=0.1, track={"level": rumo.Weight(1.0)}, moves={"inflow": rumo.Weight(1.0)}
    )
    rng = np.random.default_rng(0)
    kalman = ExtendedKalman({"level": 0.3}, {"level": 0.05}, {"level": 0.5}, {"level": 0.5})
    samples = 0.3 * rng.normal(size=(150, 1))
    bounded = MovingHorizon(kalman, 8, bounds={"level": (0.0, 5.0)})
    both = [np.array([e.x[0] for e in told(one, problem, samples, np.zeros((150, 1)))[0]]) for one in (bounded, kalman)]
    assert both[0][1:].min() > -1e-6
    assert both[1].min() < -0.02
    assert np.sqrt((both[0][30:] ** 2).mean()) < np.sqrt((both[1][30:] ** 2).mean())


def test_noise_is_kept_within_bounds():
    """What the model misses may only raise the rate: readings below the prediction are noise."""
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 60)
    upward = MovingHorizon(FILTER, 6, noise_bounds={"rate": (0.0, np.inf), "angle": (0.0, np.inf)})
    ours, running = told(upward, problem, noisy(x), torques)
    transcription, p = Transcription(problem), problem.parameters[0]
    states = [running._start_x, *(interval.x for interval in running._recent)]
    for begin, interval in zip(states[:-1], running._recent, strict=True):
        assert (interval.x - transcription.advance(begin, interval.applied, p)[0] > -1e-6).all()
    assert running.counts[Status.OPTIMAL] == 59
    assert np.isfinite([estimate.x for estimate in ours]).all()


def test_unknowns_beside_the_states_have_bounds_too():
    problem = pendulum_with_outputs()
    x, torques = drive(problem, 250, parameters={"gravity": 7.0})
    kalman = replace(FILTER, extra={"gravity": ExtraState(0.01, 2.0)})
    found, _ = told(MovingHorizon(kalman, 8), problem, noisy(x), torques)
    assert found[-1].parameters["gravity"] == pytest.approx(7.0, abs=4.0 * found[-1].deviations["gravity"])
    held, _ = told(MovingHorizon(kalman, 8, bounds={"gravity": (8.0, 12.0)}), problem, noisy(x), torques)
    assert held[-1].parameters["gravity"] == pytest.approx(8.0, abs=1e-4)


def test_it_goes_on_where_bounds_contradict_and_starts_anew_where_the_model_has_no_value():
    fast, still = {"angle": (1.0, 1.1), "rate": (5.0, 6.0)}, {"angle": (-1e-6, 1e-6)}
    contradictory = MovingHorizon(FILTER, 3, bounds=fast, noise_bounds=still)
    found, running = told(contradictory, pendulum_with_outputs(), np.full((6, 2), 0.5), np.zeros((6, 1)))
    assert running.counts == {Status.SOLVER_FAILED: 5}
    assert np.isfinite([estimate.x for estimate in found]).all()
    problem, kalman = tank(sampling_time=0.1), ExtendedKalman({"level": 0.1}, {"level": 0.1})
    levels = np.array([[0.5], [0.4], [-0.3], [-0.3], [0.4], [0.4]])
    found, running = told(MovingHorizon(kalman, 3), problem, levels, np.full((6, 1), 0.6))
    assert found[-1].x[0] == pytest.approx(0.4, abs=0.05)


def test_in_a_loop():
    problem = pendulum_with_outputs()
    estimator = MovingHorizon(
        replace(FILTER, x={"angle": 0.3}, deviations={"angle": 0.1}, late={"angle": 1}), 6, huber=3.0
    )
    log = rumo.simulate(
        rumo.RealTimeIteration(problem),
        problem.model,
        [0.3, 0.0],
        {"angle": 0.1},
        2.0,
        sensors=rumo.Sensors(NOISE, late={"angle": 1}),
        estimator=estimator,
    )
    error = np.abs(log["estimated"] - log["true_states"])
    assert (error[10:] < 5.0 * log["estimated_deviation"][10:]).all()
    assert np.isfinite(log["nis"][5:]).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MovingHorizon(NOISE), "filter: got {'angle': 0.02, 'rate': 0.1}, expected a rumo.ExtendedKalman"),
        (lambda: MovingHorizon(FILTER, 0), "window: got 0, expected a whole number of at least 1"),
        (lambda: MovingHorizon(FILTER, huber=-1.0), "huber: got -1.0"),
        (lambda: MovingHorizon(replace(FILTER, gate=OutlierGate())), "filter.gate: got OutlierGate"),
        (lambda: start(bounds={"speed": (0.0, 1.0)}), "bounds: got 'speed', expected one of angle, rate"),
        (lambda: start(bounds={"angle": (1.0, 0.0)}), "bounds['angle']: got (1.0, 0.0), expected two limits"),
        (lambda: start(noise_bounds={"rate": (1.0, 2.0)}), "noise_bounds: got limits without 0 between them"),
        (lambda: start({"rate": 0.5}), "filter: got fractions of samples among ages"),
        (lambda: start({"rate": 3.0}), "window: got 3, expected more than the 3 samples that measurements are late"),
    ],
)
def test_settings_are_checked(make, message):
    with pytest.raises(rumo.ArgumentError, match=re.escape(message)):
        make()


def start(late=None, **settings):
    first = {"x": {"rate": 0.0}, "deviations": {"rate": 1.0}} if late else {}
    kalman = replace(FILTER, late=late or {}, **first)
    return MovingHorizon(kalman, 3, **settings).start(pendulum_with_outputs())
