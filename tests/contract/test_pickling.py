"""What a worker elsewhere needs can be sent to it: pickled, in a process that starts afresh, and deep-copied."""

import copy
import multiprocessing
import pickle

import numpy as np
import pytest
from problems import PROBLEMS, pendulum

import rumo
from rumo.controllers.engines.described import core_problem
from rumo.kernel.tailored import _sources
from rumo.registry import DISCRETIZATIONS, MODELS
from rumo.transcription import Transcription

WAYS = {"pickle": lambda thing: pickle.loads(pickle.dumps(thing)), "deepcopy": copy.deepcopy}
every_way = pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)


def plans(problem, x, window, steps=3, **settings):
    controller = rumo.RealTimeIteration(problem, **settings)
    return [controller.step(x, window) for _ in range(steps)]


def numbers(plan):
    parts = (plan.u, plan.x, plan.z, plan.constraints)
    return np.concatenate([part.values.ravel() for part in parts])


@every_way
@pytest.mark.parametrize("name", MODELS)
def test_models(way, name):
    model = MODELS[name]()
    other = way(model)
    x = np.linspace(0.5, 1.5, len(model.variables))
    arguments = x, np.ones(len(model.inputs)), model.default_parameters
    for function in ("f", "g"):
        expected = getattr(model, function)(*arguments).full()
        np.testing.assert_array_equal(getattr(other, function)(*arguments).full(), expected)
    assert [other.unit(key) for signals in other.signals for key in signals] == [
        model.unit(key) for signals in model.signals for key in signals
    ]
    for key in (*model.states, *model.algebraic, *model.outputs):
        assert str(other.expression(key, "track")) == str(model.expression(key, "track"))
    # Expressions of the user's own meet the new symbols.
    state, _, _ = other.symbols
    assert other.depends(other.scalar(state[model.states.names[0]] ** 2, "expression"))


@every_way
@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_a_problem_gives_the_same_plans(way, name, backend):
    problem, x, window = PROBLEMS[name]()
    for expected, got in zip(
        plans(problem, x, window, backend=backend), plans(way(problem), x, window, backend=backend), strict=True
    ):
        np.testing.assert_array_equal(numbers(got), numbers(expected))
        assert got.status is expected.status


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("scheme", [rumo.ImplicitEuler(), rumo.Radau2(substeps=2)], ids=repr)
def test_a_problem_has_the_same_tailored_build(name, scheme):
    problem, _, _ = PROBLEMS[name]()
    first, second = (
        core_problem(Transcription(each, scheme)) for each in (problem, pickle.loads(pickle.dumps(problem)))
    )
    assert _sources(first) == _sources(second)


@every_way
def test_a_copy_cannot_be_changed_behind_its_controllers_either(way):
    with pytest.raises(ValueError, match="read-only"):
        way(pendulum()).parameters[0] = 1.0


@every_way
def test_plans_and_what_is_in_them(way):
    problem, x, window = PROBLEMS["car"]()
    controller = rumo.RealTimeIteration(problem)
    plan = [controller.step(x, window) for _ in range(2)][-1]
    other = way(plan)
    np.testing.assert_array_equal(numbers(other), numbers(plan))
    assert (other.status, other.cause, other.timings) == (plan.status, plan.cause, plan.timings)
    assert str(other.diagnostics) == str(plan.diagnostics)  # some of which are NaN
    assert other.command["torque"] == plan.command["torque"]
    assert str(way(controller.explain(plan))) == str(controller.explain(plan))
    assert way(plan.x).signals.names == plan.x.signals.names


@every_way
@pytest.mark.parametrize(
    "thing",
    [
        rumo.Weight([1.0, 2.0], range=3.0),
        rumo.Penalty(1.0, 2.0),
        rumo.Bounds(-1.0, 2.0, rumo.Penalty(1.0)),
        rumo.Parameter("kg", 1.0),
        rumo.Grid.geometric(5, 0.1, 1.2),
        rumo.InputBlocks([1, 2, 3]),
        rumo.IncrementBlocks([1, 2]),
        *rumo.Status,
        *(scheme(substeps=3) for scheme in DISCRETIZATIONS.values()),
    ],
    ids=repr,
)
def test_terms_grids_and_schemes(way, thing):
    assert way(thing) == thing


ERRORS = [
    rumo.ArgumentError("x", "1", "2", "Write 2."),
    rumo.ShapeError("x", "shape (1,)", "shape (2,)"),
    rumo.UnknownNameError("track", "angel", ["angle", "rate"]),
    rumo.UnknownAttributeError("Problem", "horizn", ["horizon"]),
    rumo.FrozenError("Problem.horizon cannot be set."),
    rumo.CallOrderError("feedback() needs a preparation."),
    rumo.PlantError("The plant could not be integrated.", log={"angle": [1.0]}),
]


@every_way
@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_errors(way, error):
    other = way(error)
    assert type(other) is type(error)
    assert str(other) == str(error)
    assert vars(other) == vars(error)


def commands_of(problem, x, window):
    return [plan.command.values for plan in plans(problem, x, window)]


def refuse(problem):
    rumo.RealTimeIteration(problem).step([0.0], {})


def test_a_process_that_starts_afresh():
    problem, x, window = PROBLEMS["car"]()
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply(commands_of, (problem, x, window))
        with pytest.raises(rumo.ShapeError, match="expected shape"):
            pool.apply(refuse, (problem,))
        plan = pool.apply(plans, (problem, x, window))[-1]
    np.testing.assert_array_equal(there, commands_of(problem, x, window))
    assert plan.status.solved
