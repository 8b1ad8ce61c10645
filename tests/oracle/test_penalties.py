"""A soft bound with l1 = 1 is kept wherever it can be kept, whatever its unit and the horizon."""

import casadi as ca
import numpy as np
import pytest

import rumo

GRAVITY, ROPE = 9.81, 5.0


def crane(penalty, horizon, sway=1.0):
    """A trolley with a hanging load; `sway` is the size of the unit of its angle, in parts of a radian."""
    model = rumo.Model(
        states={"position": "m", "speed": "m/s", "sway": "1", "sway_rate": "1/s"},
        inputs={"acceleration": "m/s^2"},
        dynamics=lambda x, u, p: {
            "position": x.speed,
            "speed": u.acceleration,
            "sway": x.sway_rate,
            "sway_rate": sway * -(GRAVITY * ca.sin(x.sway / sway) + u.acceleration * ca.cos(x.sway / sway)) / ROPE,
        },
    )
    return rumo.Problem(
        model,
        horizon=horizon,
        sampling_time=0.1,
        track={"position": rumo.Weight(1.0, range=10.0)},
        moves={"acceleration": rumo.Weight(0.01, range=2.0)},
        bounds={"acceleration": (-1.0, 1.0), "sway": rumo.Bounds(-0.05 * sway, 0.05 * sway, penalty)},
    )


@pytest.mark.parametrize("horizon", [15, 30, 60])
@pytest.mark.parametrize("sway", [1.0, 1e-4, 1e4])
def test_it_is_the_hard_bound_where_that_can_be_met(horizon, sway):
    soft, hard = (rumo.RealTimeIteration(crane(penalty, horizon, sway)) for penalty in (rumo.Penalty(1.0), None))
    x, at_limit = np.zeros(4), 0
    for _ in range(30):
        plan, expected = (controller.step(x, {"position": 10.0}) for controller in (soft, hard))
        assert plan.status is expected.status is rumo.Status.OPTIMAL
        np.testing.assert_allclose(plan.u.values, expected.u.values, atol=1e-7)
        at_limit += bool((np.abs(plan.constraints.values) < 1e-9 * sway).any())
        x = expected.x.values[1]
    assert at_limit == 30


def test_a_price_a_thousand_times_lower_does_not_keep_it():
    plan = rumo.RealTimeIteration(crane(rumo.Penalty(0.001), 30)).step(np.zeros(4), {"position": 10.0})
    assert plan.status is rumo.Status.SOFT_VIOLATED
