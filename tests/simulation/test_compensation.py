"""Delays of fractions of a sample that are compensated: a loop with them is the loop without, later."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import pendulum

import rumo
from rumo.estimation import fit_process_noise
from rumo.references import Sine
from rumo.simulation import DelayWatch, Scenario, replay

DT = 0.05
NOISE, PROCESS = {"angle": 1e-5, "rate": 1e-5}, {"angle": 1e-3, "rate": 1e-3}


def exactly(problem):
    return rumo.Plant(problem.model, DT, tolerance=1e-11)


def late(seconds, computation=0.0):
    return rumo.Actuation({"torque": rumo.Actuator(dead_time=seconds)}, computation)


def run(problem, x, reference, **changes):
    return Scenario(
        problem,
        changes.pop("plant", None) or exactly(problem),
        x,
        reference,
        changes.pop("duration", 2.0),
        discretization=rumo.Radau3(substeps=2),
        settings=rumo.Settings(gate=None),
        **changes,
    ).run()


class Later:
    """A reference that is another's, so much later."""

    def __init__(self, reference, by):
        self._reference, self._by = reference, by

    def preview(self, times, x):
        return self._reference.preview(times + self._by, x)


@settings(max_examples=12, deadline=None)
@given(st.floats(0.02, 0.98), st.integers(0, 2))
def test_a_compensated_loop_is_one_without_the_fraction(share, delay):
    """That begins where the first input leads, and whose reference has gone on."""
    wanted, first, x = Sine("angle", 0.1, 0.2, 1.5), [0.4], np.array([0.3, 0.0])
    problem = pendulum(delay=delay)
    log = run(problem, x, wanted, applied=first, actuation=late(share * DT, delay * DT))
    begin = exactly(problem).advance(x, np.array(first), np.array([9.81]), share * DT)
    plain = run(problem, begin, Later(wanted, share * DT), applied=first)
    for name in ("commanded", "applied", "estimated", "predicted_states"):
        np.testing.assert_allclose(log[name], plain[name], atol=2e-6, err_msg=name)
    # Wanted is what is wanted at the sample, not then.
    sine = 0.1 + 0.2 * np.sin(2.0 * np.pi * log["time"].to_numpy() / 1.5)
    np.testing.assert_allclose(log["reference"].to_numpy()[:, 0], sine, atol=1e-9)


@pytest.mark.parametrize("engine", ["portable", "reference"])
def test_with_a_filter_as_well(engine):
    """Which knows that inputs change within its samples: without noise it finds the state."""
    estimator = rumo.ExtendedKalman(NOISE, PROCESS, backend=engine)
    problem = pendulum(delay=1)
    log = run(problem, [0.3, 0.0], {"angle": 0.1}, actuation=late(0.03, DT), estimator=estimator)
    exact = run(problem, [0.3, 0.0], {"angle": 0.1}, actuation=late(0.03, DT))
    assert np.abs(log["innovation"].to_numpy()[1:]).max() < 1e-7
    np.testing.assert_allclose(log["plant"], exact["plant"], atol=1e-6)


def test_a_filter_with_half_the_samples_says_the_same():
    """One whose samples are half as long, every other one without measurements."""
    problem = pendulum(sampling_time=DT)
    half = pendulum(sampling_time=DT / 2.0)
    process = {name: value / np.sqrt(2.0) for name, value in PROCESS.items()}
    noise = {"angle": 0.01, "rate": 0.05}
    scheme = rumo.Radau2()
    whole = rumo.ExtendedKalman(noise, PROCESS).start(problem, discretization=scheme)
    whole.input_age = 0.5
    fine = rumo.ExtendedKalman(noise, process).start(half, discretization=scheme)
    rng, before, p = np.random.default_rng(0), np.array([0.2]), problem.parameters[0]
    for k in range(20):
        measured, u = rng.normal(size=2), rng.normal(size=1)
        estimate = whole.update(measured, u, p)
        if k:
            fine.update(np.full(2, np.nan), before, p)
        other = fine.update(measured, u, p)
        np.testing.assert_allclose(estimate.x, other.x, atol=1e-9)
        np.testing.assert_allclose(estimate.covariance, other.covariance, atol=1e-10)
        before = u


def test_input_ages_are_shares():
    running = rumo.ExtendedKalman(NOISE, PROCESS).start(pendulum())
    for wrong in (-0.1, 1.0, np.nan):
        with pytest.raises(rumo.ArgumentError, match="input_age"):
            running.input_age = wrong


def test_other_estimators_get_the_mean_of_two_inputs():
    seen = []

    class Plain:
        def start(self, problem, measured=None, discretization=None):
            return self

        def update(self, measured, applied, parameters):
            seen.append(float(applied[0]))
            return rumo.estimation.Estimate(measured.copy())

    log = run(pendulum(delay=0), [0.3, 0.0], {"angle": 0.1}, actuation=late(0.02), estimator=Plain())
    commands = np.concatenate([[0.0], log["commanded"].to_numpy()[:, 0]])
    np.testing.assert_allclose(seen[1:], 0.4 * commands[:-2] + 0.6 * commands[1:-1], atol=1e-12)


def test_a_reading_that_is_missing_is_none_ahead_either():
    missing = rumo.faults.Missing(when=range(10, 13))
    log = run(pendulum(delay=0), [0.3, 0.0], {"angle": 0.1}, actuation=late(0.02), faults=(missing,))
    assert np.isnan(log["estimated"].to_numpy()[10:13]).all()
    assert set(log["status"].to_numpy()[10:13]) == {"BAD_MEASUREMENT"}
    assert np.isfinite(log["commanded"]).all()


def test_compensation_is_worth_something():
    """An unstable plant, 60 ms late: told of it, the controller holds it about as well as one that is not late."""
    model = rumo.Model(
        {"angle": "rad", "rate": "rad/s"},
        {"torque": "N m"},
        lambda x, u, p: {"angle": x.rate, "rate": 12.0 * x.angle + u.torque},
    )
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=DT,
        delay=1,
        track={"angle": rumo.Weight(1.0)},
        moves={"torque": rumo.Weight(0.01, 4.0)},
        bounds={"torque": (-8.0, 8.0)},
    )

    def worst(truth, **changes):
        log = run(problem, [0.2, 0.0], {"angle": 0.0}, actuation=truth, **changes)
        return float(np.abs(log["plant"].to_numpy()[20:, 0]).max())

    in_time, told = worst(rumo.Actuation(computation=DT)), worst(late(0.035, DT))
    assert told < in_time + 0.01
    assert worst(late(0.035, DT), believed=rumo.Actuation(computation=DT)) > 4.0 * told
    # A belief that is nearly right is nearly as good.
    assert worst(late(0.035, DT), believed=late(0.03, DT)) < told + 0.01


def test_dead_times_of_single_channels_are_predicted():
    """By a model with the rest as states, which a filter finds from the commands."""
    base = rumo.Model(
        {"a": "m", "b": "m"},
        {"early": "m/s^2", "late": "m/s"},
        lambda x, u, p: {"a": 2.0 * x.a + u.early, "b": 3.0 * x.b + u.late},
    )
    actuation = rumo.Actuation({"late": rumo.Actuator(dead_time=0.09)})
    plant = rumo.Plant(base, DT)

    def worst(model, believed):
        problem = rumo.Problem(
            model,
            horizon=20,
            sampling_time=DT,
            track={"a": rumo.Weight(1.0), "b": rumo.Weight(1.0)},
            moves={"early": rumo.Weight(0.01), "late": rumo.Weight(0.01)},
        )
        others = {name: 0.0 for name in model.states if name not in base.states}
        estimator = rumo.ExtendedKalman(
            noise={"a": 1e-4, "b": 1e-4},
            process=dict.fromkeys(model.states, 1e-4),
            x=others,
            deviations=dict.fromkeys(others, 1e-3),
        )
        log = run(
            problem,
            [0.2, 0.2],
            {"a": 0.0, "b": 0.0},
            plant=plant,
            actuation=actuation,
            believed=believed,
            sensors=rumo.Sensors(measured=("a", "b")),
            estimator=estimator,
        )
        return float(np.abs(log["plant"].to_numpy()[30:]).max())

    known = worst(rumo.with_actuators(base, actuation), None)
    assert known < 0.01
    assert worst(base, rumo.Actuation()) > 10.0 * known


def test_a_noise_fit_knows_when_inputs_act():
    """Else the model would seem to miss what an input does in between."""
    noise = {"angle": 1e-3, "rate": 1e-3}
    estimator = rumo.ExtendedKalman(noise, {"angle": 1e-3, "rate": 3e-3})
    problem = pendulum(delay=0)
    log = run(
        problem,
        [0.3, 0.0],
        Sine("angle", 0.1, 0.3, 0.7),
        actuation=late(0.025),
        estimator=estimator,
        sensors=rumo.Sensors(noise),
        duration=6.0,
    )
    told, not_told = (
        fit_process_noise(estimator, problem, each, rumo.Radau3(substeps=2), skip=5).process["rate"]
        for each in (log, log.drop_attrs().assign_attrs(sampling_time_s=DT))
    )
    assert told < 0.2 * not_told


def test_a_drive_can_be_told_again():
    wanted, problem = Sine("angle", 0.1, 0.2, 1.5), pendulum(delay=1)
    log = run(problem, [0.3, 0.0], wanted, actuation=late(0.03, DT))
    recording = replay.recorded(problem, log, wanted)
    times = log["time"].to_numpy()[: len(recording), None] + 0.03 + problem.times
    np.testing.assert_allclose(recording.reference[..., 0], 0.1 + 0.2 * np.sin(2.0 * np.pi * times / 1.5), atol=1e-12)


@pytest.mark.parametrize("seconds", [0.05, 0.08, 0.17])
def test_monitors_find_delays(seconds, caplog):
    """Of an integral with noise, while the controller believes in no more than a sample."""
    model = rumo.Model({"angle": "rad"}, {"rate": "rad/s"}, lambda x, u, p: {"angle": u.rate})
    problem = rumo.Problem(
        model,
        horizon=15,
        sampling_time=DT,
        delay=1,
        track={"angle": rumo.Weight(1.0)},
        moves={"rate": rumo.Weight(0.3)},
    )
    actuation = rumo.Actuation({"rate": rumo.Actuator(dead_time=seconds - DT)}, computation=DT)
    log = Scenario(
        problem,
        model,
        [0.0],
        Sine("angle", 0.0, 0.5, 2.0),
        20.0,
        sensors=rumo.Sensors({"angle": 0.005}),
        actuation=actuation,
        believed=rumo.Actuation(computation=DT),
        monitors={"turning": DelayWatch("rate", "angle", integral=True)},
    ).run()
    found = log["found_delay"].sel(monitor="turning").to_numpy()[150:]
    np.testing.assert_allclose(found, seconds, atol=0.006)
    assert float(log["expected_delay"].sel(monitor="turning")) == pytest.approx(DT)
    said = [record.message for record in caplog.records if "turning" in record.message]
    assert len(said) == (seconds > 2.0 * DT)


def test_monitors_know_names():
    problem = pendulum()
    with pytest.raises(rumo.UnknownNameError, match=r"monitors\['a'\].command: got 'force'"):
        run(problem, [0.3, 0.0], {"angle": 0.1}, monitors={"a": DelayWatch("force", "angle")})
    with pytest.raises(rumo.UnknownNameError, match=r"monitors\['a'\].response: got 'speed'"):
        run(problem, [0.3, 0.0], {"angle": 0.1}, monitors={"a": DelayWatch("torque", "speed")})
    with pytest.raises(rumo.ArgumentError, match=r"monitors\['a'\]: got 3"):
        run(problem, [0.3, 0.0], {"angle": 0.1}, monitors={"a": 3})
    with pytest.raises(rumo.ArgumentError, match="window: got 2"):
        run(problem, [0.3, 0.0], {"angle": 0.1}, monitors={"a": DelayWatch("torque", "rate", window=2)})
