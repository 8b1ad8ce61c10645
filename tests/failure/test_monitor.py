"""The monitor: tells of readings that drift or stay, and is silent in healthy drives."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from problems import made_with

import rumo
from rumo import InnovationGate
from rumo.controllers.engines.described import lead
from rumo.discretization import ExplicitEuler, Gauss2, ImplicitEuler, Radau2, Trapezoidal
from rumo.references import SinePath
from rumo.simulation import Plant, Scenario, Sensors, load, save
from rumo.simulation.faults import Drift, Fault, Frozen, Offset, Weakened
from rumo.studies import PaperStudy
from rumo.studies.faults import BASE
from rumo.textbook import cart_pendulum, van_de_vusse_reactor
from rumo.vehicles import PAPER_CAR

FIRST = 75
BAD = range(FIRST, FIRST + 25)
RAW = replace(BASE, duration=4.0)
"""A car with noisy sensors, until the last of 25 bad samples: one second of them."""


def drive(study, controller="rti", faults=(), **settings):
    """The log of a drive."""
    scenario = study.scenario(controller, study.problem(), study.plant())
    return replace(scenario, faults=faults, settings=settings or None).run()


def told(log):
    """Samples at which something is said, and of which states."""
    symptoms = log["health"].to_numpy() > 0.0
    return np.flatnonzero(symptoms.any(axis=1)), {str(name) for name in log["state"].to_numpy()[symptoms.any(axis=0)]}


@dataclass(frozen=True)
class Rounded(Fault):
    """Sensors show multiples of a number."""

    step: float

    def sense(self, received, past, bad, signals):
        return self.step * np.round(received / self.step)


def cart(faults=(), seed=0, noise=1.0, known=None, rest=0.0):
    """Keep a pendulum upright on a cart that goes to and fro, after so many seconds of rest."""
    problem = rumo.Problem(
        cart_pendulum(),
        horizon=30,
        sampling_time=0.05,
        track={"position": rumo.Weight(1.0, range=1.0), "angle": rumo.Weight(1.0, range=0.5)},
        moves={"force": rumo.Weight(0.1, range=20.0)},
        bounds={"force": (-10.0, 10.0)},
        measurements=known,
    )
    deviations = {"position": 0.005 * noise, "angle": 0.005 * noise, "speed": 0.02 * noise, "rate": 0.02 * noise}
    start = dict.fromkeys(problem.model.states, 0.0)
    plant = Plant(problem.model, 0.05)
    sensors = Sensors(deviations)

    def wanted(t):
        return to_and_fro(np.maximum(np.asarray(t) - rest, 0.0))

    return Scenario(problem, plant, start, wanted, 8.0 + rest, sensors=sensors, seed=seed, faults=faults).run()


def to_and_fro(t):
    return {"position": 0.5 * np.sin(np.pi * t / 2.0), "angle": np.zeros_like(t)}


def reactor(faults=(), seed=0, noise=True):
    """Samples of half a minute."""
    problem = rumo.Problem(
        van_de_vusse_reactor(),
        horizon=16,
        sampling_time=30.0,
        track={"c_b": rumo.Weight(10.0, range=0.2)},
        moves={"flow": rumo.Weight(0.1, range=30.0), "cooling": rumo.Weight(0.1, range=9000.0)},
        bounds={"flow": (3.0, 35.0), "cooling": (-9000.0, 0.0)},
        delay=1,
    )
    deviations = {"c_a": 0.01, "c_b": 0.005, "temperature": 0.1, "jacket": 0.1} if noise else {}
    start = {"c_a": 2.14, "c_b": 1.09, "temperature": 114.2, "jacket": 112.9}
    plant, sensors = Plant(problem.model, 30.0), Sensors(deviations)

    def wanted(t):
        return {"c_b": 1.0 + 0.05 * np.sin(2.0 * np.pi * np.asarray(t) / 3840.0)}

    return Scenario(problem, plant, start, wanted, 4500.0, sensors=sensors, seed=seed, faults=faults).run()


PLANTS = {"cart": cart, "reactor": reactor}


POSITION = {
    "drift": Drift(BAD, "p_y", 0.02),
    "drift back": Drift(BAD, "p_y", -0.02),
    "stuck": Frozen(BAD, ("p_y",)),
}


@pytest.mark.parametrize(
    ("controller", "speed", "fault"),
    [
        pytest.param(kind, v, fault, id=f"{name}-{v}-{kind}", marks=() if kind == "rti" or odd else pytest.mark.slow)
        for i, kind in enumerate(("rti", "ltv", "nlp"))
        for j, (name, fault) in enumerate(POSITION.items())
        for k, v in enumerate((8.0, 11.0))
        for odd in [(i + j + k) % 2]  # of other controllers any two together, all three in slow tests
    ],
)
def test_a_second_is_enough_to_tell_of_a_position_that_drifts_or_stays(controller, speed, fault):
    path = SinePath(3.0, 60.0, speed, PAPER_CAR)
    samples, states = told(drive(replace(RAW, path=path, seed=5), controller, (fault,)))
    assert samples.size
    assert samples[0] >= FIRST
    assert states == {"p_y"}


@pytest.mark.parametrize(
    "fault",
    [
        Drift(BAD, "p_x", 0.02),
        Drift(BAD, "psi", 0.004),
        Drift(BAD, "v_x", 0.02),
        Drift(BAD, "v_y", 0.02),
        Drift(BAD, "w_f", 0.04),
        Drift(BAD, "delta", 0.004),
        *(Frozen(BAD, (name,)) for name in ("p_x", "psi", "v_x", "v_y", "omega", "w_f", "w_r", "delta")),
    ],
    ids=lambda fault: f"{type(fault).__name__} {getattr(fault, 'signal', '') or fault.signals[0]}",
)
def test_other_sensors_of_the_car_are_told_of_too(fault):
    samples, states = told(drive(replace(RAW, seed=6), faults=(fault,)))
    assert samples.size
    assert samples[0] >= FIRST
    assert getattr(fault, "signal", None) in states or set(getattr(fault, "signals", ())) & states


def test_a_position_that_is_off_by_no_more_than_the_gate_lets_pass_is_told_of():
    path = SinePath(3.0, 60.0, 11.0, PAPER_CAR)
    samples, states = told(drive(replace(RAW, path=path, seed=6), faults=(Offset(BAD, "p_x", -0.45),)))
    assert samples.size
    assert samples[0] >= FIRST
    assert states == {"p_x"}


def test_steering_that_is_dead_shows_in_the_steering_angle():
    samples, states = told(drive(replace(RAW, seed=5), faults=(Weakened(BAD, "steering_rate", 0.0),)))
    assert samples.size
    assert samples[0] >= FIRST
    assert "delta" in states


@pytest.mark.parametrize("speed", [5.0, 8.0, 12.0])
@pytest.mark.parametrize("error", [0.0, 10.0])
@pytest.mark.parametrize("study", [RAW, PaperStudy()], ids=["raw", "filtered"])
def test_nothing_is_told_of_a_healthy_drive(speed, error, study):
    path = SinePath(3.0, 60.0, speed, PAPER_CAR)
    samples, _ = told(drive(replace(study, path=path, seed=7, duration=8.0, initial_error=error)))
    assert not samples.size


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("noise", [True, False], ids=["noisy", "exact"])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_nothing_is_told_of_other_healthy_plants(name, noise, seed):
    samples, _ = told(PLANTS[name](seed=seed, noise=noise))
    assert not samples.size


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.1, 1.0])
@pytest.mark.parametrize("resolution", [0.0, 1e-6, 1e-3])
def test_nothing_is_told_of_a_cart_that_rests_and_then_moves(noise, resolution):
    encoders = (Rounded(range(1000), resolution),) if resolution else ()
    samples, _ = told(cart(encoders, noise=noise, rest=7.5))
    assert not samples.size


@pytest.mark.parametrize("noise", [0.01, 1.0])
@pytest.mark.parametrize(
    "fault", [Drift(range(270, 295), "position", 0.005), Frozen(range(270, 295), ("position",))], ids=["drift", "stuck"]
)
def test_what_is_wrong_after_rest_is_told_of_too(noise, fault):
    samples, states = told(cart((fault,), noise=noise, rest=7.5))
    assert 270 <= samples[0] < 295
    assert "position" in states


@pytest.mark.parametrize(
    ("name", "fault", "state"),
    [
        ("cart", Drift(range(100, 125), "position", 0.005), "position"),
        ("cart", Frozen(range(100, 125), ("position",)), "position"),
        ("cart", Frozen(range(100, 125), ("angle",)), "angle"),
        ("reactor", Drift(range(100, 125), "temperature", 0.05), "temperature"),
        ("reactor", Frozen(range(100, 125), ("temperature",)), "temperature"),
        ("reactor", Frozen(range(100, 125), ("jacket",)), "jacket"),
    ],
)
@pytest.mark.parametrize("noise", [True, False], ids=["noisy", "exact"])
def test_other_plants_with_a_sensor_that_drifts_or_stays_are_told_of(name, fault, state, noise):
    samples, states = told(PLANTS[name]((fault,), seed=3, noise=noise))
    assert samples.size
    assert 100 <= samples[0] < 125
    assert state in states


def test_a_symptom_says_what_is_wrong():
    scenario = RAW.scenario("rti", RAW.problem(), RAW.plant())
    plans = {}
    for fault in (Drift(BAD, "p_y", 0.02), Frozen(BAD, ("v_x",))):
        for sample in rumo.simulation.ClosedLoop(replace(scenario, faults=(fault,))):
            plans[type(fault)] = sample.plan
    (drifting,) = plans[Drift].health
    assert (drifting.state, drifting.kind) == ("p_y", "leaving")
    assert 2.5 < drifting.size < 10.0
    assert 0.2 < drifting.duration <= 1.0
    assert str(drifting).startswith("measured p_y leaves the prediction by")
    stuck = next(symptom for symptom in plans[Frozen].health if symptom.state == "v_x")
    assert (stuck.kind, stuck.size, stuck.duration) == ("stuck", 25.0, 1.0)
    assert str(stuck) == "measured v_x stays as it is, for 1 s"


def test_a_log_says_what_is_wrong_too(tmp_path):
    log = drive(RAW, faults=(Drift(BAD, "p_y", 0.02), Frozen(BAD, ("v_x",)), Offset(range(60, 62), "psi", 2.0)))
    log = load(save(log, tmp_path / "drive.nc"))
    kinds = log["symptom"]
    assert np.array_equal(kinds.values != "", log["health"].values > 0.0)
    assert kinds.sel(state="psi").values[59:63].tolist() == ["", "held", "held", ""]
    assert set(kinds.sel(state="p_y").values) == {"", "leaving"}
    assert kinds.sel(state="v_x").values[-1] == "stuck"


def test_the_core_and_the_reference_tell_the_same():
    problem = RAW.problem()
    scenario = replace(RAW.scenario("rti", problem, RAW.plant()), faults=(Drift(BAD, "p_y", 0.02),))
    riccati, condensing, reference = (
        scenario.run(made_with(problem, backend))["health"].to_numpy()
        for backend in ("riccati", "condensing", "reference")
    )
    assert riccati.max() > 2.5
    np.testing.assert_allclose(condensing, riccati, rtol=1e-6)
    np.testing.assert_allclose(reference, riccati, rtol=1e-3)


def double_integrator():
    """A mass that is pushed: 20 samples a second."""
    model = rumo.Model(
        states={"position": "m", "speed": "m/s"},
        inputs={"force": "N"},
        parameters={"mass": rumo.Parameter("kg", 1.0)},
        dynamics=lambda x, u, p: {"position": x.speed, "speed": u.force / p.mass},
    )
    return rumo.Problem(
        model,
        horizon=20,
        sampling_time=0.05,
        track={"position": rumo.Weight(1.0, range=1.0)},
        moves={"force": rumo.Weight(0.1, range=2.0)},
        bounds={"force": (-1.0, 1.0)},
    )


def push(controller, drift, again=lambda controller: None, samples=220, noise=0.01, jump=0.0):
    """Symptoms (sample, state, kind, size) of a drive whose position drifts from a sample on [m per sample].

    A preparation is followed by what is done `again`; the mass jumps at the tenth sample [m].
    """
    rng, x, told = np.random.default_rng(0), np.zeros(2), []
    begin, rate = drift
    for k in range(samples):
        x[0] += jump if k == 10 else 0.0
        measured = x + noise * rng.standard_normal(2) + [rate * max(0, k - begin), 0.0]
        controller.prepare()
        again(controller)
        plan = controller.feedback(measured, {"position": 0.5 * np.sin(0.05 * k)})
        told += [(k, symptom.state, symptom.kind, symptom.size) for symptom in plan.health]
        force = plan.command["force"]
        x = x + 0.05 * np.array([x[1] + 0.025 * force, force])
    return told


@cache
def pushed(backend, again=lambda controller: None):
    """Symptoms of a drive whose position drifts from sample 200 on."""
    controller = rumo.RealTimeIteration(double_integrator(), backend=backend, gate=InnovationGate())
    return push(controller, (200, 0.01), again, samples=212)


@pytest.mark.parametrize("backend", ["portable", pytest.param("reference", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "again",
    [lambda controller: controller.prepare(), lambda controller: controller.update(parameters={"mass": 1.0})],
    ids=["prepare", "update"],
)
def test_a_sample_that_is_prepared_again_is_compared_all_the_same(backend, again):
    once, twice = pushed(backend), pushed(backend, again)
    assert once[0][:3] == (207, "position", "leaving")
    assert [symptom[:3] for symptom in twice] == [symptom[:3] for symptom in once]
    np.testing.assert_allclose([symptom[3] for symptom in twice], [symptom[3] for symptom in once], rtol=1e-6)


@pytest.mark.parametrize("jump", [0.0, 0.5, 5.0])
def test_a_jump_while_learning_does_not_blind(jump):
    """To a hundred deviations of the noise and more."""
    controller = rumo.RealTimeIteration(double_integrator(), backend="portable", gate=InnovationGate())
    told = push(controller, (200, 0.004), jump=jump, samples=225, noise=0.002)
    first = next(k for k, state, *_ in told if k >= 200)
    assert first <= 212
    assert {state for k, state, *_ in told if k >= 200} == {"position"}


@pytest.mark.parametrize("off", [0.5, 3.0])
def test_readings_that_jump_while_learning_do_not_blind(off):
    study = replace(BASE, duration=13.0, seed=5)
    faults = Offset(range(20, 25), "p_y", off), Drift(range(300, 325), "p_y", 0.02)
    samples, states = told(drive(study, faults=faults))
    assert 300 <= samples[samples > 25][0] < 325
    assert states == {"p_y"}


def test_without_a_gate_there_is_no_monitor():
    samples, _ = told(drive(RAW, faults=(Drift(BAD, "p_y", 0.02),), gate=None))
    assert not samples.size


def test_what_a_sensor_is_known_for_is_not_told():
    drift = Drift(range(100, 125), "position", 0.005)
    assert not told(cart((drift,), seed=3, known={"position": rumo.Measurement(noise=0.1)}))[0].size


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_what_stays_at_rest_or_always_repeats_is_not_stuck(backend):
    """One sensor shows tenths; another's state is at rest."""
    model = rumo.Model(
        states={"temperature": "degC", "valve": "1"},
        inputs={"heating": "W", "speed": "1/s"},
        dynamics=lambda x, u, p: {
            "temperature": 0.01 * (20.0 - x.temperature) + 0.1 * u.heating,
            "valve": u.speed,
        },
    )
    problem = rumo.Problem(
        model,
        horizon=20,
        sampling_time=1.0,
        track={"temperature": rumo.Weight(1.0, range=10.0), "valve": rumo.Weight(1.0)},
        moves={"heating": rumo.Weight(1.0, range=10.0), "speed": rumo.Weight(1.0)},
        bounds={"heating": (0.0, 10.0), "speed": (-1.0, 1.0)},
    )
    controller, x, valve = rumo.RealTimeIteration(problem, backend=backend, gate=InnovationGate()), 20.0, 0.0
    for k in range(300):
        wanted = {"temperature": 25.0 + 3.0 * np.sin(0.02 * k), "valve": 0.5 if k > 20 else 0.0}
        plan = controller.step([round(x, 1), valve], wanted)
        assert plan.health == ()
        x += 0.01 * (20.0 - x) + 0.1 * plan.command["heating"]
        valve = round(valve + plan.command["speed"], 6)


def test_after_a_reset_everything_is_learned_anew():
    problem, reference = RAW.problem(), {"p_x": 0.0, "p_y": 0.0, "psi": 0.0, "v_x": 8.0}
    controller, rng = rumo.RealTimeIteration(problem, backend="portable"), np.random.default_rng(0)
    start = {name: 8.0 if name == "v_x" else 0.0 for name in problem.model.states}
    start |= dict.fromkeys(("w_f", "w_r"), 8.0 / PAPER_CAR.r)
    for scale in (0.001, 0.02):
        x = np.array(list(start.values()))
        for _ in range(60):
            plan = controller.step(x + scale * rng.standard_normal(len(x)), reference)
            assert not [symptom for symptom in plan.health if symptom.kind != "held"]
            x = plan.x.values[1]
        controller.reset()


def test_a_scheme_of_first_order_predicts_too_far_or_not_far_enough():
    assert lead(ImplicitEuler()) == pytest.approx(0.5, abs=1e-3)
    assert lead(ImplicitEuler(4)) == pytest.approx(0.125, abs=1e-3)
    assert lead(ExplicitEuler()) == pytest.approx(-0.5, abs=1e-3)
    assert lead(Trapezoidal()) == lead(Gauss2()) == lead(Radau2()) == 0.0
