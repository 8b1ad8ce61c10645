"""Angles: a full turn is no difference, for measurements and for what is wanted."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from problems import car, pendulum

import rumo
from rumo.simulation.faults import Offset
from rumo.studies import PaperStudy
from rumo.studies.faults import BASE
from rumo.studies.paper import CLOSE_WEIGHTS
from rumo.textbook import cart_pendulum
from rumo.turns import unturned
from rumo.vehicles import PAPER_CAR, four_wheel

TURN = 2.0 * np.pi
CONTROLLERS = [("rti", "portable"), ("rti", "reference"), ("ltv", "auto"), ("nlp", "auto")]


def angles(problem):
    return [name for name, turn in zip(problem.model.states, problem.sensors.turn, strict=True) if turn]


def turning(heading, **changes):
    """Something that turns at a rate and goes where it looks; `heading` is what else depends on its heading."""
    model = rumo.Model(
        states={"aside": "m", "heading": "rad"},
        inputs={"rate": "rad/s"},
        dynamics=lambda x, u, p: {"aside": ca.sin(x.heading), "heading": u.rate + heading(x)},
        outputs={"look": rumo.Output("rad", lambda x, u, p: x.heading + 0.1 * u.rate)},
    )
    settings = {
        "horizon": 10,
        "sampling_time": 0.1,
        "track": {"aside": rumo.Weight(1.0), "heading": rumo.Weight(0.1)},
        "moves": {"rate": rumo.Weight(0.1)},
        "bounds": {"rate": (-2.0, 2.0)},
    }
    return rumo.Problem(model, **(settings | changes))


def still(x):
    """Nothing depends on the heading but where it goes."""
    return 0.0


def held(x):
    """By a spring, which counts turns."""
    return -0.1 * x.heading


@pytest.mark.parametrize(
    ("heading", "found"),
    [
        (lambda x: 0.0, True),
        (lambda x: 0.1 * ca.sin(3.0 * x.heading - 1.0), True),
        (lambda x: ca.tan(x.heading) * x.aside, True),
        (lambda x: 0.1 * ca.cos(-2 * (x.heading + x.aside)), True),
        (lambda x: ca.atan2(ca.sin(x.heading), ca.cos(x.heading)), True),
        (lambda x: -0.1 * x.heading, False),
        (lambda x: ca.sin(0.5 * x.heading), False),
        (lambda x: ca.sin(x.heading * x.aside), False),
        (lambda x: ca.fmod(x.heading, TURN), False),
    ],
)
def test_angles_are_found_by_what_the_model_does_with_them(heading, found):
    assert angles(turning(heading)) == (["heading"] if found else [])


def test_what_else_depends_on_an_angle_counts():
    assert angles(turning(still, bounds={"rate": (-2.0, 2.0), "heading": (-1.0, 1.0)})) == []
    limit = {"front": rumo.Constraint(lambda x, u, p: ca.cos(x.heading) - 0.9)}
    assert angles(turning(still, constraints=limit)) == ["heading"]
    assert angles(turning(still, track={"look": rumo.Weight(1.0)})) == []
    assert angles(pendulum()) == []
    assert angles(pendulum(measurements={"angle": rumo.Measurement(angle=True)})) == ["angle"]
    assert angles(turning(still, measurements={"heading": rumo.Measurement(angle=False)})) == []
    assert angles(BASE.problem()) == ["psi"]


def test_dynamics_of_models_that_turn():
    model = four_wheel(PAPER_CAR)
    assert unturned(model.f, 0, model.states.index("psi"))
    model = cart_pendulum()
    assert [unturned(model.f, 0, i) for i in range(4)] == [True, False, True, False]


@cache
def undisturbed_drive(name, backend):
    """A drive's scenario, its controller, and its log."""
    study = replace(BASE, duration=2.4)
    scenario = study.scenario(name, study.problem(), study.plant())
    if name == "rti":
        scenario = replace(scenario, backend=backend)
    controller = scenario.make_controller()
    return scenario, controller, scenario.run(controller)


@pytest.mark.parametrize(("name", "backend"), CONTROLLERS)
@pytest.mark.parametrize(("count", "turns"), [(2, 1), (5, -1), (25, 3)])
def test_a_heading_off_by_full_turns_disturbs_nothing(name, backend, count, turns):
    scenario, controller, undisturbed = undisturbed_drive(name, backend)
    log = replace(scenario, faults=(Offset(range(25, 25 + count), "psi", turns * TURN),)).run(controller)
    np.testing.assert_allclose(log.plant.values, undisturbed.plant.values, atol=1e-6)
    assert set(log.status.values) <= {"OPTIMAL", "SOFT_VIOLATED"}


@pytest.mark.parametrize("estimator", [rumo.Butterworth(cutoff=3.5), "kalman"])
def test_nor_does_it_through_an_estimator(estimator):
    from rumo.studies.paper.study import kalman_filter

    chosen = kalman_filter() if estimator == "kalman" else estimator
    study = PaperStudy(weights=CLOSE_WEIGHTS, estimator=chosen, initial_error=0.0, duration=4.0)
    scenario = study.scenario("rti", study.problem(), study.plant())
    controller = scenario.make_controller()
    undisturbed = scenario.run(controller)
    log = replace(scenario, faults=(Offset(range(50, 55), "psi", TURN),)).run(controller)
    np.testing.assert_allclose(log.plant.values, undisturbed.plant.values, atol=1e-6)


@pytest.mark.parametrize(
    "estimator",
    [
        rumo.Butterworth(cutoff=1.0),
        rumo.ExtendedKalman({"aside": 0.1, "heading": 0.1}, {"aside": 0.1, "heading": 0.1}),
    ],
    ids=["low-pass", "kalman"],
)
@pytest.mark.parametrize(
    ("heading", "known", "angle"), [(still, None, True), (still, False, False), (held, None, False), (held, True, True)]
)
def test_estimators_take_for_angles_what_the_problem_does(estimator, heading, known, angle):
    problem = turning(heading, measurements={"heading": rumo.Measurement(angle=known)})
    running = estimator.start(problem)
    for reading in (0.0, 0.0, TURN, TURN):
        estimate = running.update(np.array([0.0, reading]), np.zeros(1), np.zeros(0)).x[1]
    assert (abs(estimate) < 1e-9) == angle


@pytest.mark.parametrize("backend", ["portable", pytest.param("reference", marks=pytest.mark.slow)])
@pytest.mark.parametrize("of", ["measurement", "reference", "both"])
def test_a_compass_that_goes_from_pi_to_minus_pi_makes_no_difference(backend, of):
    """A vehicle that turns all the time, by more than one turn within the run."""

    ours = turning_commands(backend, of != "reference", of != "measurement")
    np.testing.assert_allclose(ours, turning_commands(backend, False, False), atol=1e-9)


@cache
def turning_commands(backend, compass, wanted):
    """Commands, where a compass shows the heading, and where one says what is wanted."""
    controller = rumo.RealTimeIteration(turning(lambda x: 0.0), backend=backend)
    x, commands = np.array([0.0, 2.0]), []
    for k in range(80):
        window = 2.0 + 0.1 * (k + np.arange(11))
        reference = {"aside": 0.0, "heading": (window + np.pi) % TURN - np.pi if wanted else window}
        measured = [x[0], (x[1] + np.pi) % TURN - np.pi] if compass else x
        commands.append(controller.step(measured, reference).command.values[0])
        x = x + 0.1 * np.array([np.sin(x[1]), commands[-1]])
    return np.array(commands)


def test_the_first_sample_may_be_turns_away_from_what_is_wanted():
    problem, commands = turning(lambda x: 0.0), []
    for turns in (0, 1, -3):
        controller = rumo.RealTimeIteration(problem)
        plan = controller.step([0.1, 0.2 + turns * TURN], {"aside": 0.0, "heading": 0.0})
        commands.append(plan.command.values)
    np.testing.assert_allclose(commands[1:], [commands[0]] * 2, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"noise": -1.0}, r"Measurement\.noise: got -1\.0, expected a number of at least 0"),
        ({"resolution": np.inf}, r"Measurement\.resolution: got inf, expected a finite number"),
        ({"range": (1.0, -1.0)}, r"Measurement\.range: got \(1\.0, -1\.0\), expected two limits"),
        ({"angle": "yes"}, r"Measurement\.angle: got 'yes', expected True, False"),
    ],
)
def test_what_a_measurement_cannot_be(change, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        rumo.Measurement(**change)


def test_measurements_are_those_of_states():
    with pytest.raises(rumo.UnknownNameError, match="measurements"):
        pendulum(measurements={"speed": rumo.Measurement()})
    with pytest.raises(rumo.ArgumentError, match="measurements"):
        pendulum(measurements={"angle": 0.1})


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_an_angle_beyond_all_turns_does_not_stay(backend):
    """It has no digits that say where it points: readings next to it would have none either."""
    problem, x, reference = car()
    controller = rumo.RealTimeIteration(problem, backend=backend, gate=None)
    i = problem.model.states.index("psi")
    x = np.array(x)
    wild = x.copy()
    wild[i] = 4e18
    for measured in (x, x, wild, wild, x, x):
        plan = controller.step(measured, reference)
    assert plan.x.values[0, i] == x[i]
