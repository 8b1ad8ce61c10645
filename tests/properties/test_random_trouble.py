"""Whatever is measured, whatever fails: the command is finite and within its bounds, and nothing raises."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import PROBLEMS, car, pendulum

import rumo
from rumo.registry import CONTROLLERS

anything = st.floats(allow_nan=True, allow_infinity=True, width=64)
plausible = st.floats(-2.0, 2.0)
measurements = st.lists(st.tuples(plausible | anything, plausible | anything), min_size=1, max_size=12)


def assert_admissible(problem, plan, previous):
    for inputs in (plan.command.values[None], plan.u.values):
        assert np.isfinite(inputs).all()
        assert (inputs >= problem.input_lower).all()
        assert (inputs <= problem.input_upper).all()
    move = plan.command.values - previous
    assert (move >= problem.move_lower - 1e-12).all()
    assert (move <= problem.move_upper + 1e-12).all()


@cache
def limited(name, delay):
    """A controller of a pendulum with limits of every kind, made once for all sequences."""
    problem = pendulum(
        horizon=6,
        delay=delay,
        bounds={"torque": (-2.0, 1.5), "rate": (-3.0, 3.0), "angle": rumo.Bounds(-1.0, 1.0, rumo.Penalty(5.0))},
        move_bounds={"torque": (-0.5, 0.4)},
    )
    return CONTROLLERS[name](problem)


any_sequence = given(sequence=measurements, delay=st.integers(0, 3), reference=anything | plausible)


@pytest.mark.parametrize("name", CONTROLLERS)
@settings(max_examples=15, deadline=None)
@any_sequence
def test_any_sequence_of_measurements(name, sequence, delay, reference):
    survives(name, sequence, delay, reference)


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTROLLERS)
@settings(max_examples=100, deadline=None)
@any_sequence
def test_many_sequences_of_measurements(name, sequence, delay, reference):
    survives(name, sequence, delay, reference)


def survives(name, sequence, delay, reference):
    """A controller goes through a sequence, with commands that are admissible, and good samples are solved after it."""
    controller = limited(name, delay)
    problem = controller.problem
    controller.reset()
    previous = controller.applied[-1]
    for x in sequence:
        plan = controller.step(x, {"angle": reference, "rate": 0.0})
        assert_admissible(problem, plan, previous)
        previous = plan.command.values
    # Nothing that came before keeps good samples from being solved; the gate may ask to see them a few times.
    good = [[0.1 + 1e-3 * k, 0.0] for k in range(9)]
    statuses = [controller.step(x, {"angle": 0.0, "rate": 0.0}).status for x in good]
    assert statuses[-1].solved
    assert not any(status is rumo.Status.SOLVER_FAILED for status in statuses)


@pytest.mark.parametrize("name", ["rti", "nlp"])
def test_a_car_with_wild_measurements(name, capfd):
    problem, x, reference = car()
    controller = CONTROLLERS[name](problem)
    rng = np.random.default_rng(0)
    previous = controller.applied[-1]
    for k in range(40):
        measured = np.array(x) + 1e-6 * k  # a good sensor never repeats itself
        if k % 4 > 1:
            measured[rng.integers(9)] = rng.choice([np.nan, np.inf, -np.inf, 1e300, 1e6, -50.0, 0.0])
        plan = controller.step(measured, reference)
        assert_admissible(problem, plan, previous)
        previous = plan.command.values
        # A wild but finite sample may spoil the guess; the second good one is solved at the latest.
        if k % 4 == 1:
            assert plan.status.solved, (k, plan.status)
    printed = capfd.readouterr()
    assert printed.out + printed.err == "", "a step never prints"


@pytest.mark.parametrize("name", PROBLEMS)
def test_steps_leave_their_arguments_alone(name):
    problem, x, reference = PROBLEMS[name]()
    x = np.array(x)
    x_before = x.copy()
    reference = {key: np.array(values) for key, values in reference.items()}
    reference_before = {key: values.copy() for key, values in reference.items()}
    controller = rumo.RealTimeIteration(problem)
    plan = controller.step(x, reference)
    first = plan.u.values.copy()
    controller.step(x, reference)
    np.testing.assert_array_equal(x, x_before)
    for key, values in reference.items():
        np.testing.assert_array_equal(values, reference_before[key])
    np.testing.assert_array_equal(plan.u.values, first)
