"""What DirectNlp calls solved is the solution, whatever violations cost."""

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo import Status
from rumo.controllers.engines import polish
from rumo.controllers.engines.polish import Polish
from rumo.transcription import Transcription

PRICES = [1.0, 1e2, 1e4, 1e6]
EXACT = rumo.QpOptions(tolerance=1e-12)


def priced(l1):
    """A linear plant beside its limits: one quadratic program, which a real-time iteration solves exactly."""
    soft = rumo.Penalty(l1)
    bounds = {"torque": (-1.0, 1.0), "rate": rumo.Bounds(-0.3, 0.3, soft), "angle": rumo.Bounds(-0.2, 0.2, soft)}
    return pendulum(horizon=20, bounds=bounds)


def samples():
    rng = np.random.default_rng(1)
    return [rng.normal(size=2) * [0.3, 0.5] for _ in range(8)]


WANTED = {"angle": 0.1, "rate": 0.1}


@pytest.mark.parametrize("l1", PRICES)
def test_commands_are_those_of_the_exact_solution(l1):
    problem = priced(l1)
    solved = 0
    for x in samples():
        plan = rumo.DirectNlp(problem, gate=None).step(x, WANTED)
        exact = rumo.RealTimeIteration(problem, qp=EXACT, backend="portable", gate=None).step(x, WANTED)
        assert exact.status.solved
        if not plan.status.solved:
            assert plan.cause is Status.BUDGET_EXCEEDED
            continue
        solved += 1
        assert plan.status is exact.status
        np.testing.assert_allclose(plan.u.values, exact.u.values, atol=1e-6 * problem.input_scales[0])
    assert solved >= 7


def polished(problem, x, plan, end=np.inf, off=0.0):
    """What a plan's trajectory becomes, and its status, if the free inputs are `off` first."""
    transcription, u = Transcription(problem), plan.u.values.copy()
    u[problem.delay :] += off
    inner = transcription.inner_between(plan.x.values[:-1], plan.x.values[1:])
    trajectory = polish.Trajectory(u, plan.x.values, inner)
    window = {name: np.full(problem.horizon + 1, value) for name, value in WANTED.items()}
    return Polish(transcription)(trajectory, x, window, np.zeros((1, 1)), end)


def test_a_solution_stays_and_what_is_none_becomes_one():
    problem, x = priced(100.0), samples()[0]
    exact = rumo.RealTimeIteration(problem, qp=EXACT, backend="portable", gate=None).step(x, WANTED)
    trajectory, status = polished(problem, x, exact)
    assert status is Status.OPTIMAL
    np.testing.assert_array_equal(trajectory.u, exact.u.values)
    trajectory, status = polished(problem, x, exact, off=0.1)
    assert status is Status.OPTIMAL
    np.testing.assert_allclose(trajectory.u, exact.u.values, atol=1e-9)


def test_what_does_not_settle_is_no_solution(monkeypatch):
    """Iterations that go to and fro: the first trajectory stays, and is not called optimal."""
    problem, x = priced(100.0), samples()[0]
    exact = rumo.RealTimeIteration(problem, qp=EXACT, backend="portable", gate=None).step(x, WANTED)
    iterate = polish.NumpyRti.iterate

    def to_and_fro(method, *arguments):
        candidate = iterate(method, *arguments)
        candidate.diagnostics[polish.DIAGNOSTICS.index("step")] = 0.05
        return candidate

    monkeypatch.setattr(polish.NumpyRti, "iterate", to_and_fro)
    trajectory, status = polished(problem, x, exact, off=0.05)
    assert status is Status.BUDGET_EXCEEDED
    np.testing.assert_allclose(trajectory.u[1:] - exact.u.values[1:], 0.05, atol=1e-12)


def test_without_time_nothing_is_known_against_it():
    problem, x = priced(100.0), samples()[0]
    exact = rumo.RealTimeIteration(problem, qp=EXACT, backend="portable", gate=None).step(x, WANTED)
    trajectory, status = polished(problem, x, exact, end=0.0, off=0.05)
    assert status is Status.OPTIMAL
    np.testing.assert_allclose(trajectory.u[1:] - exact.u.values[1:], 0.05, atol=1e-12)
