"""The innovation gate: holds back what cannot be, and cannot lock itself out."""

import casadi as ca
import numpy as np
import pytest
from problems import advanced, car, cooled_reactor, made_with, pendulum, stiff_reactor, swinging_cart

import rumo
from rumo import InnovationGate, Status
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.ipopt import Ipopt
from rumo.controllers.engines.numpy import NumpyRti
from rumo.transcription import Transcription

REFERENCE = {"angle": 0.5, "rate": 0.0}
GOOD, WILD = [0.1, 0.0], [100.0, 0.0]
CONTROLLERS = [rumo.RealTimeIteration, rumo.DirectNlp, rumo.LinearTimeVarying]
BACKENDS = ["portable", "reference"]
WITH_SLOW = ["portable", pytest.param("reference", marks=pytest.mark.slow)]


@pytest.mark.parametrize("make", CONTROLLERS)
@pytest.mark.parametrize("wild", [WILD, [-100.0, 0.0], [0.1, 1e9], [1e300, -1e300]])
def test_a_wild_sample_follows_the_shifted_plan_and_the_next_good_one_is_solved(make, wild):
    controller = make(pendulum())
    good = controller.step(GOOD, REFERENCE)
    for later in (1, 2, 3):
        plan = controller.step(wild, REFERENCE)
        assert plan.status is Status.BAD_MEASUREMENT
        np.testing.assert_array_equal(plan.command.values, good.u.values[1 + later])
    assert controller.step(GOOD, REFERENCE).status is Status.OPTIMAL


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("patience", [0, 1, 5, 8])
def test_it_never_locks_itself_out(backend, patience):
    controller = rumo.RealTimeIteration(pendulum(), gate=InnovationGate(patience=patience), backend=backend)
    controller.step(GOOD, REFERENCE)
    statuses = [controller.step(WILD, REFERENCE).status for _ in range(patience + 4)]
    assert statuses == [Status.BAD_MEASUREMENT] * patience + [Status.OPTIMAL] * 4


@pytest.mark.parametrize("make", CONTROLLERS)
@pytest.mark.parametrize("wild", [[WILD, WILD], [WILD, [-100.0, 0.0]]], ids=["agreeing", "disagreeing"])
def test_without_a_plan_there_is_no_gate(make, wild):
    controller = make(pendulum(horizon=6), gate=InnovationGate(patience=10**6))
    controller.step(GOOD, REFERENCE)
    statuses = [controller.step(wild[k % 2], REFERENCE).status for k in range(6)]
    # Horizon 6 with delay 1 leaves 4 inputs to follow.
    assert statuses == [Status.BAD_MEASUREMENT] * 4 + [Status.PLAN_EXHAUSTED, Status.OPTIMAL]


@pytest.mark.parametrize("make", CONTROLLERS)
def test_a_sample_that_is_not_finite_neither_counts_nor_ends_the_count(make):
    controller = make(pendulum(), gate=InnovationGate(patience=3))
    controller.step(GOOD, REFERENCE)
    nothing = [np.nan, 0.0]
    samples = [WILD, nothing, WILD, nothing, nothing, WILD, WILD]
    statuses = [controller.step(x, REFERENCE).status for x in samples]
    assert statuses == [Status.BAD_MEASUREMENT] * 6 + [Status.OPTIMAL]


@pytest.mark.parametrize("make", CONTROLLERS)
def test_none_lets_all_finite_measurements_pass(make):
    controller = make(pendulum(), gate=None)
    controller.step(GOOD, REFERENCE)
    assert controller.step(WILD, REFERENCE).status is Status.OPTIMAL


def test_an_infinite_gate_is_spelt_none():
    with pytest.raises(rumo.ArgumentError, match=r"InnovationGate\.width: got inf"):
        InnovationGate(width=np.inf)


def test_it_is_on_by_default_and_wide():
    for make in CONTROLLERS:
        assert make(pendulum()).settings.gate == InnovationGate()
    # A pendulum hit by something, that swings at a rate its motor would take more than a second for, is believed.
    controller = rumo.RealTimeIteration(pendulum())
    controller.step(GOOD, REFERENCE)
    assert controller.step([0.3, 3.0], REFERENCE).status is Status.OPTIMAL


def sequence(rng, x, jumps, length):
    """Good samples near x, broken by jumps in one state and by samples that are not finite, a few in a row."""
    samples = []
    while len(samples) < length:
        offset = np.zeros(len(x))
        kind = rng.integers(4)
        column = rng.integers(len(x))
        offset[column] = [0.0, jumps[column], -jumps[column], np.nan][kind]
        samples += [x + offset + 1e-3 * rng.standard_normal(len(x)) for _ in range(rng.integers(1, 14))]
    return samples[:length]


def statuses(problem, backend, gate, samples, reference):
    controller = rumo.RealTimeIteration(problem, backend=backend, gate=gate)
    return [controller.step(x, reference).status for x in samples]


@pytest.mark.parametrize("seed", range(8))
def test_backends_judge_alike_sample_by_sample(seed):
    rng = np.random.default_rng(seed)
    gate = InnovationGate(width=float(rng.uniform(1.0, 6.0)), patience=int(rng.integers(0, 10)))
    samples = sequence(rng, np.array(GOOD), [50.0, 200.0], 120)
    seen = [statuses(pendulum(), backend, gate, samples, REFERENCE) for backend in BACKENDS]
    assert seen[0] == seen[1]
    assert {Status.OPTIMAL, Status.BAD_MEASUREMENT} <= set(seen[0])


def test_backends_judge_a_car_alike():
    problem, x, reference = car()
    rng = np.random.default_rng(0)
    jumps = [100.0, 100.0, 0.0, 60.0, 60.0, 60.0, 150.0, 150.0, 15.0]
    good = np.array(x)
    samples = [good]
    for column, jump in enumerate(jumps):
        if not jump:  # a heading is never far from another, give or take full turns
            continue
        # Fewer than the gate's patience, so that none is believed.
        wild = good.copy()
        wild[column] += rng.choice([-1.0, 1.0]) * jump
        samples += [wild] * int(rng.integers(1, 8)) + [good] * 2
    for column in range(0, 9, 2):  # and some in which most readings are wild
        samples += [good + np.where(np.arange(9) == column, 0.0, 200.0)] * 3 + [good] * 2
    plans = [[], []]
    for made, backend in zip(plans, BACKENDS, strict=True):
        controller = rumo.RealTimeIteration(problem, backend=backend)
        made += [controller.step(sample, reference) for sample in samples]
    for core, numpy, sample in zip(*plans, samples, strict=True):
        assert core.status is numpy.status
        np.testing.assert_allclose(core.x.values[0], numpy.x.values[0], atol=1e-6)
        wild = np.abs(sample - good) > 1.0
        assert (core.status is Status.BAD_MEASUREMENT) == (wild.sum() > 4)
        np.testing.assert_allclose(core.x.values[0][~wild] if wild.sum() < 5 else good[~wild], good[~wild])
        assert np.abs(core.x.values[0] - sample)[wild].min(initial=np.inf) > 10.0


def drifting(count):
    return [[0.01 * k, 0.0] for k in range(count)]


@pytest.mark.parametrize("make", CONTROLLERS)
def test_frozen_measurements_of_a_moving_plant_follow_the_plan(make):
    controller = make(pendulum(horizon=20))
    reference = {"angle": 1.0, "rate": 0.0}
    x = np.array([0.1, 0.0])
    for k in range(7):
        plan = controller.step(x + 1e-9 * k, reference)
        assert plan.status is Status.OPTIMAL
        x = plan.x.values[1]
    last = controller.step(x, reference)
    assert last.status is Status.OPTIMAL
    for _ in range(4):
        assert controller.step(x, reference).status is Status.BAD_MEASUREMENT
    assert controller.step(x + 1e-3, reference).status is Status.OPTIMAL


def test_a_long_horizon_does_not_widen_the_gate():
    widths = []
    for horizon in (20, 60):
        method = NumpyRti(Transcription(pendulum(horizon=horizon)), rumo.Settings())
        engine = Guarded(method, rumo.Settings())
        engine.step(GOOD, REFERENCE)
        engine.prepare()
        widths.append(method.reach())
    np.testing.assert_allclose(widths[1], widths[0], rtol=0.3)


@pytest.mark.parametrize("gate", [InnovationGate(), InnovationGate(1.0, 2), None])
def test_backends_judge_sequences_with_freezes_and_jumps_alike(gate):
    rng = np.random.default_rng(3)
    controllers = [rumo.RealTimeIteration(pendulum(), backend=backend, gate=gate) for backend in BACKENDS]
    x, seen = np.array(GOOD), set()
    for k in range(120):
        kind = rng.integers(0, 8) if k % 20 > 9 else 0
        if kind < 4:
            x = x + 0.01 * rng.standard_normal(2)
        sample = x + np.array([30.0, 0.0]) if kind == 7 else x
        statuses = [controller.step(sample, REFERENCE).status for controller in controllers]
        assert statuses[0] is statuses[1], (k, statuses)
        seen.add(statuses[0])
    assert (Status.BAD_MEASUREMENT in seen) == (gate is not None)


@pytest.mark.parametrize(
    ("make", "state", "jump"),
    [(stiff_reactor, 2, 1.0), (cooled_reactor, 1, 3.0), (car, 2, 3.0), (swinging_cart, 1, 3.0)],
    ids=["stiff_reactor", "cooled_reactor", "car", "swinging_cart"],
)
def test_after_a_believed_jump_backends_judge_guesses_alike(make, state, jump):
    problem, x, reference = make()
    gate = InnovationGate(width=1.0, patience=0)
    controllers = [made_with(problem, backend, gate=gate) for backend in BACKENDS]
    x = np.array(x)
    for k in range(12):
        x[state] += jump if k == 3 else 0.0
        plans = [controller.step(x, reference) for controller in controllers]
        apart = (plans[1].u.values - plans[0].u.values) / problem.input_scales
        assert np.abs(apart).max() < 1e-5, k
        x = plans[0].x.values[1].copy()


@pytest.mark.parametrize("make", [rumo.RealTimeIteration, rumo.DirectNlp])
def test_a_state_that_inputs_could_not_move_at_first_is_judged_once_they_can(make):
    model = rumo.Model(
        states={"aside": "m", "speed": "m/s", "heading": "rad"},
        inputs={"push": "m/s^2", "turn": "rad/s"},
        dynamics=lambda x, u, p: {"aside": x.speed * x.heading, "speed": u.push, "heading": u.turn},
    )
    problem = rumo.Problem(
        model,
        horizon=8,
        sampling_time=0.1,
        track={"aside": rumo.Weight(1.0), "speed": rumo.Weight(1.0)},
        moves={"push": rumo.Weight(0.01), "turn": rumo.Weight(0.01)},
        bounds={"push": (-1.0, 1.0), "turn": (-1.0, 1.0)},
    )
    controller, wanted = make(problem), {"aside": 0.1, "speed": 1.0}
    x = np.zeros(3)
    for _ in range(5):
        plan = controller.step(x, wanted)
        assert plan.status is Status.OPTIMAL
        x = plan.x.values[1].copy()
    assert abs(controller.step([1e6, *x[1:]], wanted).x["aside"][0]) < 1.0


def test_the_gate_of_ipopt_follows_the_numbers():
    problem = pendulum()
    methods = NumpyRti(Transcription(problem), rumo.Settings()), Ipopt(Transcription(problem), rumo.NlpSettings())
    reached = []
    for method, settings in zip(methods, (rumo.Settings(), rumo.NlpSettings()), strict=True):
        engine = Guarded(method, settings)
        engine.step(GOOD, REFERENCE)
        engine.update(method.transcription.renumbered(problem.changed(parameters={"gravity": 100.0})))
        engine.prepare()
        reached.append(method.reach())
    np.testing.assert_allclose(reached[1], reached[0])


@pytest.mark.parametrize("make", CONTROLLERS)
def test_one_wild_reading_of_many_is_replaced_by_the_prediction(make):
    problem, x, reference = car()
    controller = make(problem)
    for _ in range(3):
        plan = controller.step(x, reference)
        x = plan.x.values[1].copy()
    for value in (np.nan, np.inf, 500.0):
        wild = x.copy()
        wild[1] = value
        plan = controller.step(wild, reference)
        assert plan.status.solved
        np.testing.assert_allclose(plan.x.values[0], x)
        x = plan.x.values[1].copy()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_reading_that_never_comes_is_predicted_as_long_as_a_plan_is_good(backend):
    problem, x, reference = car()
    controller = rumo.RealTimeIteration(problem, backend=backend)
    good = np.array(x)
    controller.step(good, reference)
    nothing = np.where(np.arange(9) == 0, np.nan, good)
    statuses = [controller.step(nothing, reference).status for _ in range(problem.horizon)]
    k = problem.horizon - problem.delay - 1
    assert all(status.solved for status in statuses[:k])
    assert statuses[k] is Status.BAD_MEASUREMENT


@pytest.mark.parametrize("backend", BACKENDS)
def test_readings_beyond_what_a_sensor_can_show_are_none(backend):
    problem = pendulum(
        measurements={"angle": rumo.Measurement(range=(-1.0, 1.0)), "rate": rumo.Measurement(range=(-3.0, 3.0))}
    )
    controller = rumo.RealTimeIteration(problem, backend=backend)
    assert controller.step([1.1, 0.0], REFERENCE).status is Status.PLAN_EXHAUSTED
    controller.step(GOOD, REFERENCE)
    assert [controller.step([1.1, 0.0], REFERENCE).status for _ in range(4)] == [Status.BAD_MEASUREMENT] * 4


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_usual_is_learned(backend):
    """The wide gate would let all of these pass; noise of the usual size passes always."""
    rng = np.random.default_rng(0)
    slow = {"angle": rumo.Weight(1.0), "rate": rumo.Weight(0.1)}
    controller = rumo.RealTimeIteration(pendulum(track=slow, horizon=20), backend=backend)
    x, reference = np.array(GOOD), {"angle": 0.5, "rate": 0.0}
    for _ in range(120):
        plan = controller.step(x + 0.002 * rng.standard_normal(2), reference)
        assert plan.status is Status.OPTIMAL
        x = plan.x.values[1]
    for jump in ([0.5, 0.0], [0.0, 2.0], [-0.5, 2.0]):
        plan = controller.step(x + jump, reference)
        assert plan.status is Status.BAD_MEASUREMENT
        x = plan.x.values[1]
    assert controller.step(x, reference).status is Status.OPTIMAL


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_sensor_may_be_off_by_what_it_is_said_to_be(noise, backend):
    """However good it was before."""
    slow = {"angle": rumo.Weight(1.0), "rate": rumo.Weight(0.1)}
    problem = pendulum(track=slow, horizon=20, measurements={"angle": rumo.Measurement(noise=noise)})
    controller, x = rumo.RealTimeIteration(problem, backend=backend), np.array(GOOD)
    for _ in range(60):
        x = controller.step(x, REFERENCE).x.values[1]
    for jump, passes in ((0.3, noise > 0.0), (1.5, False)):
        plan = controller.step(x + np.array([jump, 0.0]), REFERENCE)
        assert (plan.status is Status.OPTIMAL) == passes
        x = plan.x.values[1]


@pytest.mark.parametrize("backend", WITH_SLOW)
def test_noise_of_a_car_at_rest_is_no_fault(backend):
    """At rest steering moves nothing sideways, so that there is nothing to compare noise with."""
    problem, x, reference = car()
    rng, names = np.random.default_rng(1), problem.model.states.names
    sigma = np.array([0.05 if name[0] in "pv" else 0.01 for name in names])
    still = {name: np.zeros(problem.horizon + 1) for name in reference}
    # The model's slip is not defined at rest.
    x = np.array([0.01 if name in ("v_x", "w_f", "w_r") else 0.0 for name in names])
    controller = rumo.RealTimeIteration(problem, backend=backend)
    sigma[[3, 6, 7]] = 0.0
    plans = [controller.step(x + sigma * rng.standard_normal(9), still) for _ in range(200)]
    assert Status.BAD_MEASUREMENT not in [plan.status for plan in plans]


@pytest.mark.parametrize("told", [False, True])
@pytest.mark.parametrize("backend", WITH_SLOW)
def test_a_thermometer_of_coarse_steps_is_not_frozen(backend, told):
    """It shows tenths of a degree, and its plant moves by less in a sample."""
    model = rumo.Model(
        states={"temperature": "degC"},
        inputs={"heating": "W"},
        dynamics=lambda x, u, p: {"temperature": 0.01 * (20.0 - x.temperature) + 0.1 * u.heating},
    )
    known = {"temperature": rumo.Measurement(resolution=0.1)} if told else None
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=1.0,
        track={"temperature": rumo.Weight(1.0, range=10.0)},
        moves={"heating": rumo.Weight(1.0, range=10.0)},
        bounds={"heating": (0.0, 10.0)},
        measurements=known,
    )
    controller, x, statuses = rumo.RealTimeIteration(problem, backend=backend), 20.0, []
    for k in range(400):
        wanted = 25.0 + 3.0 * np.sin(0.02 * k)
        plan = controller.step([round(x, 1)], {"temperature": wanted})
        statuses.append(plan.status)
        x += 0.01 * (20.0 - x) + 0.1 * plan.command["heating"]
    assert statuses.count(Status.BAD_MEASUREMENT) == 0
    last = round(x, 1)
    frozen = [controller.step([last], {"temperature": 40.0}).status for _ in range(8)]
    assert Status.BAD_MEASUREMENT in frozen, "but what stays while the plant moves on is"


@pytest.mark.parametrize("coarse", [0.05, 0.2, 1.0])
@pytest.mark.parametrize("backend", WITH_SLOW)
def test_sensors_that_are_not_said_to_be_coarse_are_not_frozen_nor_held_back(backend, coarse):
    """A boat goes a few steps of its sensors in each of its samples, or fewer."""
    model = rumo.Model(
        states={"p_x": "m", "p_y": "m", "yaw": "rad", "rate": "rad/s", "speed": "m/s"},
        inputs={"rudder": "1", "thrust": "m/s^2"},
        dynamics=lambda x, u, p: {
            "p_x": x.speed * ca.cos(x.yaw),
            "p_y": x.speed * ca.sin(x.yaw),
            "yaw": x.rate,
            "rate": 2.0 * (u.rudder * x.speed - x.rate),
            "speed": u.thrust - 0.5 * x.speed,
        },
    )
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=0.2,
        delay=1,
        track={"p_y": rumo.Weight(1.0, 5.0), "yaw": rumo.Weight(0.1), "speed": rumo.Weight(1.0, 2.0)},
        moves={"rudder": rumo.Weight(0.1), "thrust": rumo.Weight(0.1)},
        bounds={"rudder": (-1.0, 1.0), "thrust": (-2.0, 2.0)},
    )
    controller, steps = rumo.RealTimeIteration(problem, backend=backend), coarse * np.array([0.5, 0.5, 0.05, 0.05, 0.1])
    x, applied, plans = np.array([0.0, 0.0, 0.0, 0.0, 1.0]), np.zeros(2), []
    for k in range(300):
        ahead = 0.2 * (k + np.arange(21))
        wanted = {"p_y": 3.0 * np.sin(0.02 * ahead), "yaw": 0.0, "speed": 1.0}
        plans.append(controller.step(steps * np.round(x / steps), wanted))
        x = advanced(controller, x, applied)
        applied = plans[-1].command.values
    assert Status.BAD_MEASUREMENT not in [plan.status for plan in plans]
    held = [symptom for plan in plans[100:] for symptom in plan.health if symptom.kind == "held"]
    assert len(held) <= 3


@pytest.mark.parametrize("make", CONTROLLERS)
def test_health_says_which_readings_were_not_used(make):
    problem, x, reference = car()
    controller = make(problem)
    for _ in range(5):
        plan = controller.step(x, reference)
        assert plan.health == ()
        x = plan.x.values[1].copy()
    for k in (1, 2, 3):
        wild = x.copy()
        wild[1], wild[3] = 500.0, np.nan
        plan = controller.step(wild, reference)
        aside, speed = plan.health
        assert (aside.state, aside.duration) == ("p_y", pytest.approx(0.04 * k))
        assert aside.size > 100.0
        assert str(aside).startswith("measured p_y leaves the prediction by")
        assert (speed.state, speed.size) == ("v_x", np.inf)
        assert str(speed) == f"measured v_x is no reading, for {0.04 * k:.3g} s"
        x = plan.x.values[1].copy()
    assert controller.step(x, reference).health == ()
