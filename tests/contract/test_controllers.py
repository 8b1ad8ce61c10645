"""What holds for every controller that comes with Rumo, on every problem."""

import inspect

import numpy as np
import pytest
from problems import PROBLEMS, pendulum

import rumo
from rumo.registry import CONTROLLERS

every_controller = pytest.mark.parametrize("name", CONTROLLERS)
every_problem = pytest.mark.parametrize("problem_name", PROBLEMS)


def task(problem_name):
    """A problem, its state, and a reference that names every state."""
    problem, x, reference = PROBLEMS[problem_name]()
    held = dict(zip(problem.model.states, x, strict=True))
    return problem, np.array(x, dtype=float), held | dict(reference)


def drive(name, problem_name, steps=4, seed=0):
    """Plans for a few noisy measurements."""
    problem, x, reference = task(problem_name)
    controller, rng = CONTROLLERS[name](problem), np.random.default_rng(seed)
    measurements = x + 1e-3 * np.abs(x) * rng.standard_normal((steps, len(x)))
    return controller, [controller.step(measurement, reference) for measurement in measurements]


@every_controller
def test_registered_under_its_name(name):
    controller = CONTROLLERS[name]
    assert controller.name == name
    assert issubclass(controller, rumo.Controller)
    assert getattr(rumo, controller.__name__) is controller


@every_controller
def test_documented_with_every_parameter(name):
    controller = CONTROLLERS[name]
    assert controller.__doc__.splitlines()[0].endswith(".")
    for method in ("step", "prepare", "feedback", "reset"):
        assert getattr(controller, method).__doc__
    # A class may leave out what its base class documents.
    documented = "\n".join(cls.__doc__ or "" for cls in controller.__mro__[:-1])
    for parameter in inspect.signature(controller).parameters:
        assert f"{parameter} :" in documented or f"**{parameter}\n" in documented


@every_controller
@every_problem
def test_plans_have_the_shapes_of_the_problem(name, problem_name):
    controller, plans = drive(name, problem_name)
    problem = controller.problem
    nx, nu, nc = len(problem.model.states), len(problem.model.inputs), len(problem.constraints)
    for plan in plans:
        assert plan.command.shape == (nu,)
        assert plan.u.shape == (problem.horizon, nu)
        assert plan.x.shape == (problem.horizon + 1, nx)
        assert plan.slacks.shape == (problem.horizon, nc)
        assert plan.command.signals.names == plan.u.signals.names == problem.model.inputs.names
        assert plan.x.signals.names == problem.model.states.names
        assert plan.slacks.signals.names == tuple(row.name for row in problem.constraints)


@every_controller
@every_problem
def test_inputs_are_finite_and_within_bounds(name, problem_name):
    controller, plans = drive(name, problem_name)
    problem, previous = controller.problem, controller.problem.safe_input
    for plan in plans:
        planned = plan.u.values
        assert np.isfinite(planned).all()
        assert (planned >= problem.input_lower).all()
        assert (planned <= problem.input_upper).all()
        np.testing.assert_array_equal(plan.command.values, planned[problem.delay])
        move = plan.command.values - previous
        # A sum and its difference: rounding relative to the input.
        slack = 1e-12 * np.maximum(np.abs(previous), 1.0)
        assert (move >= problem.move_lower - slack).all()
        assert (move <= problem.move_upper + slack).all()
        previous = plan.command.values


@every_controller
@every_problem
def test_solved_plans_are_finite_and_start_at_the_measurement(name, problem_name):
    problem, x, reference = task(problem_name)
    plan = CONTROLLERS[name](problem).step(x, reference)
    assert plan.status.solved
    assert np.isfinite(plan.x.values).all()
    assert np.isfinite(plan.slacks.values).all()
    assert (plan.slacks.values >= 0.0).all()
    np.testing.assert_array_equal(plan.x.values[0], x)


@every_controller
@every_problem
def test_decided_inputs_lead_the_plan(name, problem_name):
    problem, x, reference = task(problem_name)
    controller = CONTROLLERS[name](problem)
    first = controller.step(x, reference)
    second = controller.step(x, reference)
    d = problem.delay
    np.testing.assert_array_equal(first.u.values[:d], np.tile(problem.safe_input, (d, 1)))
    if d:
        np.testing.assert_array_equal(second.u.values[d - 1], first.command.values)


@every_controller
@every_problem
def test_same_measurements_give_the_same_plans(name, problem_name):
    (_, plans), (_, again) = drive(name, problem_name), drive(name, problem_name)
    for plan, other in zip(plans, again, strict=True):
        assert plan.status is other.status
        for part in ("command", "u", "x", "slacks"):
            np.testing.assert_array_equal(getattr(plan, part).values, getattr(other, part).values)


@every_controller
def test_other_measurements_give_other_plans(name):
    (_, plans), (_, others) = drive(name, "car", seed=0), drive(name, "car", seed=1)
    assert not np.allclose(plans[-1].command.values, others[-1].command.values)


@every_controller
def test_every_step_is_counted(name):
    controller, plans = drive(name, "swinging_cart")
    assert controller.status_counts.total() == len(plans)
    assert all(controller.status_counts[plan.status] > 0 for plan in plans)
    controller.reset()
    assert controller.status_counts.total() == 0


@every_controller
def test_times_are_reported(name):
    _, plans = drive(name, "swinging_cart")
    for plan in plans:
        assert plan.timings.prepare >= 0.0
        assert plan.timings.feedback > 0.0
        assert plan.timings.total == plan.timings.prepare + plan.timings.feedback
        assert plan.timings.waited == pytest.approx(plan.timings.total)  # each was a step


@every_controller
def test_no_one_waits_for_what_was_prepared_before(name):
    problem = pendulum()
    controller = CONTROLLERS[name](problem)
    controller.step([0.1, 0.0], {"angle": 0.5, "rate": 0.0})
    controller.prepare()
    for call in (controller.feedback, controller.step):
        plan = call([0.1, 0.0], {"angle": 0.5, "rate": 0.0})
        assert plan.timings.waited == plan.timings.feedback
        controller.prepare()


@every_controller
def test_lost_measurement_is_survived(name):
    problem, x, reference = task("car")
    controller = CONTROLLERS[name](problem)
    first = controller.step(x, reference)
    lost = controller.step(np.full_like(x, np.nan), reference)
    assert lost.status is rumo.Status.BAD_MEASUREMENT
    # The plan before, one sample later.
    np.testing.assert_allclose(lost.command.values, first.u.values[problem.delay + 1], rtol=1e-12)
    assert controller.step(x, reference).status.solved


@every_controller
def test_a_step_that_raises_prepares_nothing(name):
    problem, x, reference = task(next(iter(PROBLEMS)))
    controller = CONTROLLERS[name](problem)
    with pytest.raises(rumo.UnknownNameError):
        controller.step(x, reference | {"nonsense": 0.0})
    with pytest.raises(rumo.CallOrderError):
        controller.feedback(x, reference)
