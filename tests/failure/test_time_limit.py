"""A limit of time holds for the whole step, whatever it was doing when the time was over."""

import time

import numpy as np
import pytest
from problems import BACKENDS, balanced_cart, pendulum

import rumo
from rumo import Status

WANTED = {"angle": 0.5, "rate": 0.0}
SHORT = 1e-9
"""Over before anything begins [s]."""


def with_limit(problem, backend, seconds, **settings):
    solver = backend if backend in BACKENDS[1:] else "auto"
    qp = rumo.QpOptions(time_limit=seconds, solver=solver)
    if backend == "ltv":
        return rumo.LinearTimeVarying(problem, qp=qp)
    name = "portable" if backend in BACKENDS[1:] else backend
    return rumo.RealTimeIteration(problem, qp=qp, backend=name, **settings)


@pytest.mark.parametrize("backend", [*BACKENDS, "ltv"])
def test_out_of_time_the_plan_before_is_followed_and_the_next_step_is_as_ever(backend):
    limited = with_limit(pendulum(), backend, np.inf)
    good = limited.step([0.1, 0.0], WANTED)
    assert good.status is Status.OPTIMAL
    limited.configure(qp=rumo.QpOptions(time_limit=SHORT))
    for samples_later in (1, 2, 3):
        plan = limited.step([0.1, 0.0], WANTED)
        assert plan.status is Status.BUDGET_EXCEEDED
        np.testing.assert_array_equal(plan.command.values, good.u.values[1 + samples_later])
        assert np.isnan(plan.diagnostics.step)
    limited.configure(qp=rumo.QpOptions())
    assert limited.step([0.1, 0.0], WANTED).status is Status.OPTIMAL


@pytest.mark.parametrize("backend", [*BACKENDS, "ltv"])
def test_without_a_plan_there_is_the_safe_input(backend):
    plan = with_limit(pendulum(safe_input={"torque": 0.25}), backend, SHORT).step([0.1, 0.0], WANTED)
    assert (plan.status, plan.cause) == (Status.PLAN_EXHAUSTED, Status.BUDGET_EXCEEDED)
    assert plan.command["torque"] == 0.25


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_measurement_that_cannot_be_is_told_all_the_same(backend):
    limited = with_limit(pendulum(), backend, SHORT)
    assert limited.step([np.nan, 0.0], WANTED).cause is Status.BAD_MEASUREMENT


@pytest.mark.parametrize("solver", BACKENDS)
def test_a_guess_that_had_no_time_is_kept(solver):
    """The step after one that was out of time goes on from where that stood, not from rest."""
    problem, plans = cart(40), []
    for interrupted in (False, True):
        controller = with_limit(problem, solver, np.inf, gate=None)
        for _ in range(5):
            plan = controller.step([0.2, 0.0, 0.05, 0.0], dict.fromkeys(problem.outputs, 0.0))
        predicted = plan.x.values[1]
        if interrupted:
            controller.configure(qp=rumo.QpOptions(time_limit=SHORT))
            controller.step(predicted, dict.fromkeys(problem.outputs, 0.0))
            controller.configure(qp=rumo.QpOptions())
            predicted = plan.x.values[2]
        plans.append(controller.step(predicted, dict.fromkeys(problem.outputs, 0.0)))
    assert plans[1].status.solved
    assert plans[1].diagnostics.step < 10.0 * plans[0].diagnostics.step + 0.05
    assert np.isnan(plans[1].diagnostics.contraction)  # one iteration is enough


def cart(horizon):
    return balanced_cart(horizon, force=(-3.0, 3.0), speed=rumo.Bounds(-0.12, 0.12, rumo.Penalty(0.01)))


def computing_time(controller, outputs):
    """Of the fastest of five first steps [s]: a process that shares its processor is often interrupted."""
    times = []
    for _ in range(5):
        controller.reset()
        begin = time.thread_time()
        controller.step([0.2, 0.0, 0.05, 0.0], dict.fromkeys(outputs, 0.0))
        times.append(time.thread_time() - begin)
    return min(times)


@pytest.mark.parametrize("solver", BACKENDS[1:])
def test_preparation_and_solution_end_with_the_time(solver):
    """At 500 intervals, one iteration: within the fifth part of the time that a whole step takes, and hardly more."""
    problem = cart(500)
    plain = {"gate": None, "trusted_step": np.inf}
    whole = computing_time(with_limit(problem, solver, np.inf, **plain), problem.outputs)
    limit = 0.2 * whole
    limited = computing_time(with_limit(problem, solver, limit, **plain), problem.outputs)
    assert limited < 2.0 * limit
