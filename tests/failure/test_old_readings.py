"""Readings that are old when they come, and are said to be: `Measurement(age=...)`."""

import pickle
from dataclasses import replace
from functools import partial
from itertools import product
from unittest.mock import patch

import numpy as np
import pytest
from problems import BACKENDS, advanced, car, made_with, pendulum, rod

import rumo
from rumo import Measurement, Status
from rumo.controllers.engines.described import core_problem
from rumo.estimation import ExtendedKalman
from rumo.references import SinePath
from rumo.simulation import Scenario, Sensors, load, save
from rumo.simulation.faults import Frozen, LateMeasurement
from rumo.studies import PaperStudy
from rumo.studies.faults import BASE
from rumo.studies.kpis import tracking_error
from rumo.transcription import Transcription
from rumo.vehicles import PAPER_CAR

CONTROLLERS = [rumo.RealTimeIteration, rumo.DirectNlp, rumo.LinearTimeVarying]
H = 0.1
"""Sampling time of the linear model [s]."""
STILL = {"position": 0.0, "speed": 0.0, "heat": 0.0}


def old(**ages):
    return {name: Measurement(age=age) for name, age in ages.items()}


def wagon(decay=0.0, **changes):
    """A position, its speed, and a temperature that decays: linear, so that one iteration is the solution."""
    model = rumo.Model(
        states={"position": "m", "speed": "m/s", "heat": "K"},
        inputs={"force": "N"},
        dynamics=lambda x, u, p: {"position": x.speed, "speed": u.force, "heat": u.force - decay * x.heat},
    )
    settings = {
        "horizon": 20,
        "sampling_time": H,
        "track": {"position": rumo.Weight(1.0), "speed": rumo.Weight(0.1)},
        "moves": {"force": rumo.Weight(0.1)},
        "bounds": {"force": (-2.0, 2.0)},
    }
    return rumo.Problem(model, **(settings | changes))


def wagon_after(x, force, decay):
    """One sample of the wagon, as implicit Euler predicts it."""
    speed = x[1] + H * force
    return np.array([x[0] + H * speed, speed, (x[2] + H * force) / (1.0 + H * decay)])


def simulated(controller, ages, samples, x, wanted, after, kicks=None, spoil=None):
    """States (K, nx) that a plant had, `after` one and an input each, those that plans begin with, and the plans."""
    x, history, plans = np.array(x), [], []
    for k in range(samples):
        x = x + (kicks or {}).get(k, 0.0)
        history.append(x)
        read = np.array([history[max(k - age, 0)][i] for i, age in enumerate(ages)])
        plan = controller.step(read if spoil is None else spoil(k, read), wanted)
        plans.append(plan)
        x = np.array(after(x, plan.command.values))
    return np.array(history), np.array([plan.x.values[0] for plan in plans]), plans


def driven(controller, ages, samples, decay=0.0, kicks=None, spoil=None):
    """The same of the wagon."""

    def after(x, force):
        return wagon_after(x, force[0], decay)

    return simulated(controller, ages, samples, [0.5, 0.2, 0.3], STILL, after, kicks, spoil)


@pytest.mark.parametrize(
    ("age", "message"),
    [
        (-1, r"Measurement\.age: got -1, expected a whole number of at least 0"),
        (1.5, r"Measurement\.age: got 1\.5, expected a whole number"),
        (True, r"Measurement\.age: got True, expected a whole number"),
        ("2", r"Measurement\.age: got '2', expected a whole number"),
    ],
)
def test_what_an_age_cannot_be(age, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        Measurement(age=age)


def test_nothing_is_older_than_what_is_predicted():
    assert pendulum(measurements=old(angle=12)).sensors.age.tolist() == [12, 0]
    with pytest.raises(
        rumo.ArgumentError, match=r"measurements\['angle'\]\.age: got 13, expected at most the horizon of 12"
    ):
        pendulum(measurements=old(angle=13))


@pytest.mark.parametrize("make", CONTROLLERS)
@pytest.mark.parametrize("ages", [(2, 0, 0), (3, 3, 0), (1, 4, 2)])
def test_a_plan_begins_where_the_plant_is(make, ages):
    """Once there are as many plans as readings are old. No innovation counts twice: nothing is left, nothing swings."""
    controller = make(wagon(3.0, measurements=old(position=ages[0], speed=ages[1], heat=ages[2])))
    true, believed, _ = driven(controller, ages, 30, decay=3.0)
    settled = 2 * max(ages)
    np.testing.assert_allclose(believed[settled:], true[settled:], atol=1e-6)
    assert np.abs(true[-1, :2]).max() < 0.1


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("age", [1, 2, 5])
def test_a_kick_is_known_when_its_reading_comes_and_then_wholly(backend, age):
    decay, first = 4.0, 12
    kick = np.array([0.01, 0.0, 0.02])
    problem = wagon(decay, measurements=old(position=age, heat=age))
    controller = made_with(problem, backend, gate=None)
    true, believed, _ = driven(controller, (age, 0, age), 30, decay, {first: kick})
    error = true - believed
    kept = 1.0 / (1.0 + H * decay)
    for k in range(first, first + age):
        np.testing.assert_allclose(error[k], kick * [1.0, 0.0, kept ** (k - first)], atol=1e-9)
    np.testing.assert_allclose(error[first + age :], 0.0, atol=1e-9)


def coupled(stiffness, **changes):
    """A position that pulls itself back, undamped, with a stiffness in 1/s^2; or away, where that is negative."""
    model = rumo.Model(
        states={"position": "m", "speed": "m/s"},
        inputs={"force": "N"},
        dynamics=lambda x, u, p: {"position": x.speed, "speed": u.force - stiffness * x.position},
    )
    settings = {
        "horizon": 20,
        "sampling_time": 0.05,
        "track": {"position": rumo.Weight(1.0), "speed": rumo.Weight(0.1)},
        "moves": {"force": rumo.Weight(0.1)},
        "bounds": {"force": (-1000.0, 1000.0)},
    }
    return rumo.Problem(model, **(settings | changes))


def told_of(controller, ages, samples, x, wanted, spoil=None, kicks=None):
    """How far plans begin from where the plant is (K, nx), which is as its model says, and the plans."""
    true, believed, plans = simulated(controller, ages, samples, x, wanted, partial(advanced, controller), kicks, spoil)
    return believed - true, plans


@pytest.mark.parametrize("backend", ["portable", "reference"])
@pytest.mark.parametrize("age", [8, 12])
def test_a_pendulum_all_of_whose_readings_are_old_is_known_as_well_as_its_model(backend, age):
    """Angle and rate turn into each other while readings are under way: neither innovation is of one state alone."""
    controller = made_with(pendulum(measurements=old(angle=age, rate=age)), backend, gate=None)
    rng = np.random.default_rng(0)
    errors, plans = told_of(
        controller,
        (age, age),
        300,
        [0.3, 0.0],
        {"angle": 0.0, "rate": 0.0},
        lambda k, read: read + 1e-3 * rng.standard_normal(2),
    )
    assert np.abs(errors[40:]).max() < 0.02, "it began with what was never read"
    assert all(plan.status is Status.OPTIMAL for plan in plans)


@pytest.mark.parametrize("backend", ["portable", "reference"])
@pytest.mark.parametrize("stiffness", [0.0, 64.0, -64.0])
@pytest.mark.parametrize("ages", [(2, 2), (3, 3), (8, 8), (1, 4), (4, 1), (0, 3)])
def test_all_that_a_kick_does_is_known_with_the_last_reading_of_it(backend, stiffness, ages):
    """Until then it goes on as the linear model says, but for what was read before."""
    problem = coupled(stiffness, measurements=old(position=ages[0], speed=ages[1]))
    controller = made_with(problem, backend, gate=None)
    first, kick = 20, np.array([0.01, -0.02])
    errors, _ = told_of(controller, ages, 50, [0.1, 0.0], {"position": 0.0, "speed": 0.0}, kicks={first: kick})
    A = controller.transcription.sensitivity(np.zeros(2), np.zeros(1), np.zeros(2), np.zeros(0))
    for k in range(min(ages)):
        np.testing.assert_allclose(errors[first + k], -np.linalg.matrix_power(A, k) @ kick, atol=1e-9)
    assert np.abs(errors[first + max(ages) :]).max() < 1e-9


@pytest.mark.parametrize("backend", ["portable", "reference"])
@pytest.mark.parametrize("bad", [30.0, np.nan])
def test_an_old_reading_that_is_held_back_says_nothing_of_other_states(backend, bad):
    """It would of the speed, three samples later; and its own state is as the others say."""
    names = {"position": "m", "speed": "m/s", "heat": "K"}
    model = rumo.Model(
        states=names,
        inputs={"force": "N"},
        dynamics=lambda x, u, p: {
            "position": x.speed,
            "speed": u.force - 16.0 * x.position,
            "heat": x.position - x.heat,
        },
    )
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=0.05,
        track={"position": rumo.Weight(1.0)},
        moves={"force": rumo.Weight(0.1)},
        bounds={"force": (-2.0, 2.0)},
        measurements=old(position=3, speed=3, heat=1),
    )
    rng = np.random.default_rng(1)

    def spoil(k, read):
        return read + 1e-4 * rng.standard_normal(3) + np.array([bad if k in (60, 61) else 0.0, 0.0, 0.0])

    errors, plans = told_of(made_with(problem, backend), (3, 3, 1), 80, [0.5, 0.0, 0.1], {"position": 0.0}, spoil)
    assert all(plan.status is Status.OPTIMAL for plan in plans)
    held = {k: [symptom.state for symptom in plan.health] for k, plan in enumerate(plans) if plan.health}
    assert held == {60: ["position"], 61: ["position"]}
    assert np.abs(errors[6:]).max() < 2e-3


@pytest.mark.parametrize("age", [1, 3])
def test_noise_of_an_old_reading_is_no_larger_than_when_it_was_read(age):
    """A state that decays within a sample would swing for ever, were innovations moved along as they are."""
    rng = np.random.default_rng(0)
    noise = 0.01 * rng.standard_normal(400)
    controller = rumo.RealTimeIteration(wagon(200.0, measurements=old(position=age, heat=age)), gate=None)

    def noisy(k, read):
        return read + noise[k] * np.array([1.0, 0.0, 1.0])

    true, believed, _ = driven(controller, (age, 0, age), 400, 200.0, spoil=noisy)
    error = (true - believed)[20:].std(axis=0)
    assert error[0] == pytest.approx(noise[20:].std(), rel=0.05)
    assert error[2] < 0.1 * noise.std()


@pytest.mark.parametrize("make", CONTROLLERS)
def test_as_long_as_less_is_known_readings_are_as_old_as_plans_go_back(make):
    controller = make(wagon(measurements=old(position=3)))
    for _ in range(2):  # and anew after a reset
        plans = [controller.step([1.0, 0.5, 0.0], STILL) for _ in range(5)]
        began = np.array([plan.x.values[0, 0] for plan in plans])
        ways = np.array([plan.x.values[1, 0] - plan.x.values[0, 0] for plan in plans])
        np.testing.assert_allclose(began, [1.0 + ways[max(k - 3, 0) : k].sum() for k in range(5)], atol=1e-9)
        controller.reset()


def random_samples(rng, good, spread, count):
    """Readings that wander, with some that are wild, missing, repeated or turned."""
    x, samples = np.array(good, dtype=float), []
    for _ in range(count):
        x = x + 0.02 * spread * rng.standard_normal(len(x))
        sample = x.copy()
        r, kind = rng.integers(len(x)), rng.integers(12)
        if kind == 0:
            sample[r] += 200.0 * spread[r]
        elif kind == 1:
            sample[r] = np.nan
        elif kind == 2 and samples:
            sample = samples[-1].copy()
        samples.append(sample)
    return samples


@pytest.mark.parametrize("seed", range(6))
def test_backends_agree_sample_by_sample(seed):
    rng = np.random.default_rng(seed)
    ages = {name: int(rng.integers(0, 6)) for name in ("angle", "rate")}
    grid = rumo.Grid.geometric(10, 0.05, 1.1) if seed == 3 else 12
    problem = pendulum(measurements=old(**ages), horizon=grid, delay=seed % 3)
    gate = None if seed == 5 else rumo.InnovationGate(patience=3)
    samples = random_samples(rng, [0.1, 0.0], np.array([0.1, 0.3]), 80)
    agree(problem, samples, {"angle": 0.5, "rate": 0.0}, gate)


def agree(problem, samples, reference, gate=None, backends=BACKENDS):
    controllers = [made_with(problem, backend, gate=gate) for backend in backends]
    for sample in samples:
        plans = [controller.step(sample, reference) for controller in controllers]
        assert len({plan.status for plan in plans}) == 1
        for plan in plans[1:]:
            np.testing.assert_allclose(plan.x.values, plans[0].x.values, rtol=1e-6, atol=1e-7)
            np.testing.assert_allclose(plan.u.values, plans[0].u.values, rtol=1e-6, atol=1e-7)


def test_backends_agree_on_a_car():
    problem, x, reference = car()
    rng, names = np.random.default_rng(2), problem.model.states.names
    ages = {name: int(age) for name, age in zip(names, rng.integers(0, 4, len(names)), strict=True)}
    problem = told(PaperStudy(path=SinePath(3.0, 60.0, 8.0, PAPER_CAR)), old(**ages))
    agree(problem, random_samples(rng, x, np.full(9, 0.1), 40), reference, rumo.InnovationGate())


def test_backends_agree_on_a_model_without_maps():
    problem = rod(cells=40, measurements=old(t_3=2, t_4=3, t_20=1))
    assert problem.sensors.age.sum() == 6
    rng, good = np.random.default_rng(0), np.zeros(len(problem.model.states))
    samples = [good + 0.1 * rng.standard_normal(len(good)) for _ in range(12)]
    agree(problem, samples, dict.fromkeys(problem.outputs, 1.0), None, ["reference", "portable"])


def told(study, measurements):
    """The problem of a study, told of its sensors."""
    with patch("rumo.studies.paper.study.Problem", partial(rumo.Problem, measurements=measurements)):
        return study.problem()


def drive(speed, controller="rti", age=0, known=True, seed=0, faults=(), **settings):
    """The log of a drive with positions that come some samples late."""
    late = dict.fromkeys(("p_x", "p_y"), age) if age else {}
    base = replace(BASE, duration=5.0, seed=seed, path=replace(BASE.path, speed=speed))
    scenario = base.scenario(controller, base.problem(), base.plant())
    if known:
        problem = told(base, old(**late))
        scenario = replace(scenario, problem=problem, sensors=replace(scenario.sensors, late=late))
    else:
        faults = (LateMeasurement(range(10**6), tuple(late), by=age), *faults)
    return replace(scenario, faults=faults, settings=settings or None).run()


@pytest.mark.parametrize(
    ("controller", "speed"),
    [
        ("rti", 8.0),
        ("rti", 11.0),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in product(("nlp", "ltv"), (8.0, 11.0))),
    ],
)
def test_a_car_whose_position_comes_late_drives_as_well_as_one_whose_does_not(controller, speed):
    after = slice(25, None)  # it starts without a reading, from the safe input
    healthy, unknown, known = (
        float(np.sqrt((tracking_error(log)[after] ** 2).mean()))
        for log in (drive(speed, controller), drive(speed, controller, 2, False), drive(speed, controller, 2))
    )
    assert unknown > 2.5 * healthy
    assert known < 1.1 * healthy


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_a_wild_old_reading_is_held_back_and_no_other(backend):
    _, x, reference = car()
    problem = told(PaperStudy(path=SinePath(3.0, 60.0, 8.0, PAPER_CAR)), old(p_x=2, p_y=2))
    controller = rumo.RealTimeIteration(problem, backend=backend)
    history = [np.array(x)]
    for k in range(60):
        read = history[-1].copy()
        read[:2] = history[max(k - 2, 0)][:2]
        if wild := k in (50, 51, 55):
            read[1] += 30.0
        plan = controller.step(read, reference)
        assert plan.status.solved
        assert [symptom.state for symptom in plan.health] == (["p_y"] if wild else [])
        np.testing.assert_allclose(plan.x.values[0], history[-1], atol=1e-4 if k > 2 else 2.0)
        history.append(plan.x.values[1])


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_a_frozen_old_reading_is_told_of_as_stuck(backend):
    """It stays as it is, although what it is said to mean of now does not."""
    late = {"p_x": 2, "p_y": 2}
    base = replace(BASE, duration=4.0)
    scenario = base.scenario("rti", told(base, old(**late)), base.plant())
    stuck = Frozen(range(75, 100), ("p_x",))
    log = replace(scenario, sensors=replace(scenario.sensors, late=late), faults=(stuck,), backend=backend).run()
    symptoms = log["symptom"].sel(state="p_x").to_numpy()
    assert (symptoms[:75] == "").all()
    assert "stuck" in symptoms[75:] or "held" in symptoms[75:], symptoms[75:]


def test_a_drive_can_be_sent_kept_and_driven_again(tmp_path):
    """Ages are a part of the problem: of copies of it, of what is exported, and of what a log's readings lead to."""
    late = {"position": 2, "heat": 1}
    problem = wagon(3.0, measurements=old(**late))
    for same in (problem, pickle.loads(pickle.dumps(problem)), problem.changed(weights={"position": 2.0})):
        assert same.sensors.age.tolist() == [2, 0, 1]
        assert core_problem(Transcription(same)).values["sensors_age"].tolist() == [2, 0, 1]
    sensors = Sensors({"position": 0.01}, late=late)
    scenario = Scenario(
        pickle.loads(pickle.dumps(problem)), problem.model, [0.5, 0.0, 0.0], STILL, 2.0, sensors=sensors
    )
    log = scenario.run()
    save(log, tmp_path / "log.nc")
    again = rumo.RealTimeIteration(problem)
    for x, command in zip(load(tmp_path / "log.nc")["received"].values, log["commanded"].values, strict=True):
        np.testing.assert_array_equal(again.step(x, STILL).command.values, command)


def test_a_loop_wants_sensors_as_late_as_they_are_said_to_be():
    problem = wagon(measurements=old(position=2))

    def loop(late, estimator=None):
        Scenario(
            problem, problem.model, [0.5, 0.0, 0.0], STILL, 1.0, sensors=Sensors(late=late), estimator=estimator
        ).run()

    loop({"position": 2})
    with pytest.raises(rumo.ArgumentError, match=r"sensors\.late\['position'\]: got 0, expected the 2 samples"):
        loop({})
    noise = dict.fromkeys(problem.model.states, 0.01)
    corrects = ExtendedKalman(noise=noise, process=noise, late={"position": 2})
    with pytest.raises(rumo.ArgumentError, match=r"got 2, expected the 4 samples that estimator and problem"):
        loop({"position": 2}, corrects)


def test_a_rescue_counts_an_innovation_once():
    """The plan found elsewhere takes the place of the step's, at the same sample."""
    problem = wagon(3.0, measurements=old(position=2, heat=2))
    controller = rumo.RealTimeIteration(problem, rescue=rumo.DirectNlp, trusted_step=1e-9, settling_iterations=0)
    kicks = {15: np.array([0.05, 0.0, 0.05])}
    true, believed, plans = driven(controller, (2, 0, 2), 30, 3.0, kicks)
    assert any(plan.rescued for plan in plans[17:20])
    np.testing.assert_allclose(believed[17:], true[17:], atol=1e-6)


def test_a_reading_out_of_its_sensors_range_is_none_wherever_it_is_now():
    near = {"position": Measurement(age=2, range=(-1.0, 0.45))}
    controller = rumo.RealTimeIteration(wagon(measurements=near))
    _, _, plans = driven(controller, (2, 0, 0), 4)
    assert plans[0].status is Status.PLAN_EXHAUSTED
    fast = rumo.RealTimeIteration(wagon(measurements=near))
    began = [fast.step([0.44, 3.0, 0.0], STILL).x.values[0, 0] for _ in range(3)]
    assert began[-1] > 0.5, "it was still in range when it was read"


def bent(ages):
    """Speed and heat depend on each other, and on where they are."""
    model = rumo.Model(
        states={"position": "m", "speed": "m/s", "heat": "K"},
        inputs={"force": "N"},
        dynamics=lambda x, u, p: {
            "position": x.speed,
            "speed": u.force - 2.0 * x.speed**3 - x.position**3,
            "heat": 4.0 * x.speed**2 - (3.0 + 40.0 * x.speed**2) * x.heat,
        },
    )
    return rumo.Problem(
        model,
        horizon=15,
        sampling_time=0.1,
        track={"position": rumo.Weight(1.0), "speed": rumo.Weight(0.1)},
        moves={"force": rumo.Weight(0.02)},
        bounds={"force": (-10.0, 10.0)},
        measurements=old(**dict(zip(model.states, ages, strict=True))),
    )


@pytest.mark.parametrize("gate", [None, rumo.InnovationGate()])
def test_backends_agree_after_plans_that_were_found_elsewhere(gate):
    """What comes next depends on the state as on these plans, not as on those that they replace."""
    ages, kicks = (2, 3, 2), {k: np.array([0.3, 0.8, 0.1]) for k in (7, 22, 37)}
    rng, samples, began = np.random.default_rng(0), [], {}

    def spoil(k, read):
        samples.append(read + 0.01 * rng.standard_normal(3))
        return samples[-1]

    def controller(backend):
        return rumo.RealTimeIteration(
            bent(ages), backend=backend, gate=gate, rescue=rumo.DirectNlp, settling_iterations=0
        )

    wanted = {"position": 1.0, "speed": 0.0}
    _, plans = told_of(controller("portable"), ages, 45, [0.5, 0.0, 0.1], wanted, spoil, kicks)
    assert sum(plan.rescued for plan in plans) > 20
    reference = controller("reference")
    again = [reference.step(sample, wanted) for sample in samples]
    for which, of in (("plans", plans), ("again", again)):
        began[which] = np.array([plan.x.values[0] for plan in of])
    np.testing.assert_allclose(began["again"], began["plans"], rtol=1e-6, atol=1e-7)


def test_a_rescue_takes_the_state_of_now_although_no_sensor_could_read_it():
    near = {"position": Measurement(age=2, range=(-1.0, 0.45))}
    problem = wagon(bounds={"force": (-200.0, 200.0)}, measurements=near)
    controller = rumo.RealTimeIteration(problem, rescue=rumo.DirectNlp, trusted_step=1e-9, settling_iterations=0)
    plans = [controller.step([0.44, 3.0, 0.0], STILL) for _ in range(4)]
    assert plans[-1].x.values[0, 0] > 0.45
    assert all(plan.rescued and plan.status is Status.OPTIMAL for plan in plans)
