"""A problem in other units is the same problem."""

import numpy as np
import pytest

import rumo


def slider(state=1.0, force=1.0, cost=1.0, soft=False):
    """A mass with a limited speed, its states, input and cost in units of the given size."""
    model = rumo.Model(
        states={"position": "1", "speed": "1"},
        inputs={"force": "1"},
        dynamics=lambda x, u, p: {
            "position": x.speed,
            "speed": state * (u.force / force) - x.speed,
        },
    )
    limit = 0.2 * state
    penalty = rumo.Penalty(0.2 * cost) if soft else None
    return rumo.Problem(
        model,
        horizon=20,
        sampling_time=0.1,
        track={"position": rumo.Weight(cost, range=state)},
        moves={"force": rumo.Weight(0.01 * cost, range=force)},
        bounds={"force": (-force, force), "speed": rumo.Bounds(-limit, limit, penalty)},
    )


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize(
    ("state", "force", "cost"),
    [(1e-9, 1.0, 1.0), (1e-4, 1e6, 1.0), (1e8, 1e-8, 1.0), (1.0, 1.0, 1e-10), (1.0, 1.0, 1e10), (1e-6, 1e3, 1e-6)],
)
def test_real_time_iteration(state, force, cost, soft):
    expected = rumo.RealTimeIteration(slider(soft=soft)).step([0.0, 0.0], {"position": 1.0})
    plan = rumo.RealTimeIteration(slider(state, force, cost, soft)).step([0.0, 0.0], {"position": state})
    assert plan.status is expected.status is rumo.Status.OPTIMAL
    np.testing.assert_allclose(plan.u.values / force, expected.u.values, atol=1e-7)
    np.testing.assert_allclose(plan.x.values / state, expected.x.values, atol=1e-7)
    assert plan.x["speed"].max() / state == pytest.approx(0.2, abs=1e-7)


@pytest.mark.parametrize("cost", [1e-10, 1e-4, 1e6])
def test_cost_of_the_nlp(cost):
    expected = rumo.DirectNlp(slider()).step([0.0, 0.0], {"position": 1.0})
    plan = rumo.DirectNlp(slider(cost=cost)).step([0.0, 0.0], {"position": 1.0})
    np.testing.assert_allclose(plan.u.values, expected.u.values, atol=1e-6)


@pytest.mark.parametrize("state", [1e-8, 1e8])
def test_violation_is_judged_by_the_scale_of_the_bound(state):
    problem = slider(state, soft=True)
    plan = rumo.RealTimeIteration(problem).step([0.0, 0.5 * state], {"position": 0.0})
    assert plan.status is rumo.Status.SOFT_VIOLATED
    assert plan.slacks["speed_upper"][0] == pytest.approx((0.5 - 0.1) / 1.1 * state - 0.2 * state, rel=1e-6)
