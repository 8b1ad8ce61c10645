"""What is violated, and what cannot hold together, is named."""

import numpy as np
import pytest
from problems import pendulum

import rumo
from rumo import Status

REFERENCE = {"angle": 0.5, "rate": 0.0}


@pytest.mark.parametrize("backend", ["portable", "reference"])
def test_violations_name_constraint_stage_and_amount(backend):
    soft = pendulum(bounds={"torque": (-2.0, 2.0), "rate": rumo.Bounds(-0.3, 0.3, rumo.Penalty(100.0))})
    plan = rumo.RealTimeIteration(soft, backend=backend).step([0.0, 2.0], {"angle": 0.0})
    worst = plan.violations[0]
    assert worst.constraint == "rate_upper"
    assert worst.amount == pytest.approx(plan.slacks["rate_upper"].max())
    assert worst.amount == plan.slacks["rate_upper"][worst.stage - 1]
    assert worst.share == pytest.approx(worst.amount / 0.6)  # the bounds are 0.6 rad/s apart
    assert str(worst) == f"rate_upper at stage {worst.stage}: {100 * worst.share:.2g} % over"
    shares = [violation.share for violation in plan.violations]
    assert shares == sorted(shares, reverse=True)


def test_nothing_violated_nothing_named():
    plan = rumo.RealTimeIteration(pendulum()).step([0.1, 0.0], REFERENCE)
    assert plan.violations == []
    assert plan.conflict == ()


def test_a_conflict_names_rows_that_cannot_hold_together():
    # The torque cannot turn a pendulum that swings at 3 rad/s within a sample.
    problem = pendulum(delay=0, bounds={"torque": (-2.0, 2.0), "rate": (-1.0, 1.0)})
    plan = rumo.RealTimeIteration(problem).step([0.0, 3.0], REFERENCE)
    assert plan.cause is Status.SOLVER_FAILED
    assert "rate_upper at stage 1" in plan.conflict
    assert "bounds of torque at stage 1" in plan.conflict
    assert all(name.split(" at stage ")[0] in ("rate_upper", "bounds of torque") for name in plan.conflict)


def test_a_conflict_of_move_bounds_is_named():
    problem = pendulum(
        delay=0,
        bounds={"torque": (-20.0, 20.0), "rate": (-1.0, 1.0)},
        move_bounds={"torque": (-0.5, 0.5)},
    )
    plan = rumo.RealTimeIteration(problem).step([0.0, 1.5], REFERENCE)
    assert plan.cause is Status.SOLVER_FAILED
    assert "rate_upper at stage 1" in plan.conflict
    assert "move bounds of torque at stage 1" in plan.conflict


@pytest.mark.parametrize("iterations", [0, 1, 2, 5])
def test_out_of_budget_the_better_of_iterate_and_shifted_plan_is_used(iterations):
    problem = pendulum(bounds={"torque": (-2.0, 2.0)}, move_bounds={"torque": (-0.4, 0.4)})
    controller = rumo.RealTimeIteration(problem, qp=rumo.QpOptions(max_iterations=iterations))
    controller.reset(applied=[1.0])
    previous = 1.0
    for x in ([0.5, 0.0], [-0.6, 1.0], [0.4, -2.0]):
        plan = controller.step(x, {"angle": -1.0, "rate": 0.0})
        moves = np.diff(np.r_[previous, plan.u["torque"][1:]])
        assert np.abs(moves).max() <= 0.4 + 1e-12
        assert np.abs(plan.u["torque"]).max() <= 2.0
        assert np.isfinite(plan.x.values).all()
        previous = plan.command["torque"]
    assert controller.status_counts[Status.BUDGET_EXCEEDED] > 0 or iterations == 5


def test_a_time_limit_is_a_budget():
    problem = pendulum(horizon=60, bounds={"torque": (-1.0, 1.0)}, move_bounds={"torque": (-0.1, 0.1)})
    controller = rumo.RealTimeIteration(problem, qp=rumo.QpOptions(time_limit=1e-9))
    controller.engage(applied=[0.0], x=[2.0, 0.0])
    controller.prepare()  # which no one waits for
    plan = controller.feedback([2.0, 0.0], {"angle": -1.0, "rate": 0.0})
    assert plan.status is Status.BUDGET_EXCEEDED
    assert np.isfinite(plan.diagnostics.step)  # it is a plan of its own
    controller.configure(qp=rumo.QpOptions())
    assert controller.step([2.0, 0.0], {"angle": -1.0, "rate": 0.0}).status is Status.OPTIMAL
