"""After a surprise a first iteration is never enough: the model was wrong of where the state would be."""

from dataclasses import replace

import numpy as np
import pytest
from problems import advanced

import rumo
from rumo.simulation.loop import ClosedLoop
from rumo.studies.linearization import LinearizationStudy
from rumo.studies.linearization.corners import CORNER, LONG_BEND
from rumo.studies.linearization.study import StartedNlp
from rumo.vehicles import PAPER_CAR

WRONG = 0.05
"""Share of its range by which a command that is wrong is off."""
ICE = replace(CORNER, car=PAPER_CAR, torque=300.0, bends=LONG_BEND, held_speed=True, grip=0.6, ice=0.8, duration=6.0)
"""Very stiff tyres, whose linear model turns the car back at once, by forces that ice does not allow."""


@pytest.fixture(scope="module")
def ice():
    """The problem, samples of a drive, and when the road becomes ice."""
    problem = ICE.problem()
    scenario = ICE.scenario(rumo.RealTimeIteration, problem, ICE.plant())
    samples = list(ClosedLoop(replace(scenario, settings={"gate": None, "backend": "portable"})))
    return problem, samples, scenario.faults[0].samples(problem.sampling_time).start


def iterated(plan):
    """Whether a step took more than one iteration."""
    return bool(np.isfinite(plan.diagnostics.contraction))


def test_first_iterations_on_ice_are_trusted_only_where_they_are_right(ice):
    problem, samples, on_ice = ice
    nlp, errors = StartedNlp(problem, gate=None, max_iterations=1000), []
    for sample in samples[on_ice:]:
        if sample.plan.trusted:
            nlp.reset(applied=sample.applied.values)
            best = nlp.step(sample.estimated, sample.preview.signals)
            assert best.trusted
            errors.append(np.abs(sample.plan.command.values - best.command.values) / problem.input_scales)
    assert len(errors) >= 10
    assert np.max(errors) < WRONG


def test_engines_are_surprised_alike(ice):
    problem, samples, on_ice = ice
    seen = samples[on_ice - 30 : on_ice + 5]
    plans = {}
    for backend in ("portable", "reference"):
        controller = rumo.RealTimeIteration(problem, gate=None, backend=backend)
        controller.reset(applied=seen[0].applied.values)
        plans[backend] = [controller.step(sample.estimated, sample.preview.signals) for sample in seen]
        assert any(iterated(plan) for plan in plans[backend][30:])
    for ours, theirs in zip(*plans.values(), strict=True):
        assert iterated(ours) == iterated(theirs)
        assert ours.status is theirs.status
        allowed = 1e-9 if ours.trusted else 1e-5  # rounding grows over a hundred iterations that do not converge
        assert (np.abs(ours.u.values - theirs.u.values) < allowed * problem.input_scales).all()


def test_where_predictions_are_good_one_iteration_is_enough():
    """Without noise, from sample to sample innovations of a model that is a little wrong are many times the usual."""
    (run,) = LinearizationStudy(("rti",), sweeps={"speed": (14.0,)}).runs().values()
    assert not any(iterated(sample.plan) for sample in ClosedLoop(run.scenario))


MODEL = rumo.Model(
    states={"x": "m", "v": "m/s"}, inputs={"a": "m/s^2"}, dynamics=lambda x, u, p: {"x": x.v, "v": u.a - x.v**3}
)


def mass(**changes):
    """A mass that is to stay where it is."""
    return rumo.Problem(
        MODEL,
        horizon=10,
        sampling_time=0.1,
        track={"x": rumo.Weight(1.0)},
        moves={"a": rumo.Weight(0.1)},
        bounds={"a": (-50.0, 50.0)},
        **changes,
    )


@pytest.mark.parametrize("backend", ["portable", "reference"])
@pytest.mark.parametrize("gate", [None, rumo.InnovationGate()])
def test_a_jump_of_the_state_is_a_surprise(backend, gate):
    """A mass that is where it is predicted, to within noise, until something pushes it."""
    controller, rng = rumo.RealTimeIteration(mass(), gate=gate, backend=backend), np.random.default_rng(0)
    plan = controller.step([0.0, 0.0], {"x": 0.0})
    for _ in range(40):
        plan = controller.step(plan.x.values[1] + 1e-3 * rng.standard_normal(2), {"x": 0.0})
        assert not iterated(plan)
    assert iterated(controller.step(plan.x.values[1] + [0.0, 0.01], {"x": 0.0}))


@pytest.mark.parametrize("backend", ["portable", pytest.param("reference", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("gate", "told"), [(None, True), (rumo.InnovationGate(), True), (rumo.InnovationGate(), False)]
)
def test_the_steps_of_a_sensor_are_no_surprise(backend, gate, told):
    """Nearly all readings are as predicted, but where the sensor goes on by a step."""
    step, rng = 5e-3, np.random.default_rng(0)
    known = {"measurements": dict.fromkeys(("x", "v"), rumo.Measurement(resolution=step))} if told else {}
    controller = rumo.RealTimeIteration(mass(**known), gate=gate, backend=backend)
    x, more = np.zeros(2), []
    for _ in range(500):
        plan = controller.step(step * np.round(x / step), {"x": 0.0})
        more.append(iterated(plan))
        x = advanced(controller, x, plan.command.values) + 2e-4 * rng.standard_normal(2)
    assert sum(more[200:]) <= 3


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_one_wild_reading_at_first_does_not_hide_surprises(backend):
    controller, rng = rumo.RealTimeIteration(mass(), gate=None, backend=backend), np.random.default_rng(0)
    plan = controller.step([0.0, 0.0], {"x": 0.0})
    plan = controller.step([0.0, 1e8], {"x": 0.0})
    plan = controller.step([0.0, 0.0], {"x": 0.0})
    for _ in range(60):
        plan = controller.step(plan.x.values[1] + 1e-3 * rng.standard_normal(2), {"x": 0.0})
    assert iterated(controller.step(plan.x.values[1] + [0.0, 0.01], {"x": 0.0}))
