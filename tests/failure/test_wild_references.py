"""A reference that nobody can follow, however far: what is predicted is what the inputs lead to."""

import numpy as np
import pytest
from problems import BACKENDS, made_with

import rumo


def chain(horizon):
    """Two lags in a row, with one input within bounds."""
    model = rumo.Model(
        states={"x": "1", "y": "1"},
        inputs={"u": "1"},
        dynamics=lambda x, u, p: {"x": u.u - x.x + 0.3 * x.y, "y": u.u - x.y},
    )
    return rumo.Problem(
        model,
        horizon=horizon,
        sampling_time=0.5,
        track={"x": rumo.Weight(1.0)},
        moves={"u": rumo.Weight(1e-2)},
        bounds={"u": (-1.0, 1.0)},
    )


@pytest.mark.parametrize("backend", BACKENDS[1:])
@pytest.mark.parametrize("horizon", [1, 2, 3, 6])
@pytest.mark.parametrize("wild", [1e12, 1e20, 1e100, 1e300])
def test_predictions_follow_from_inputs(backend, horizon, wild):
    controller = made_with(chain(horizon), backend, gate=None)
    rng = np.random.default_rng(0)
    A, B = np.array([[-1.0, 0.3], [0.0, -1.0]]), np.array([[1.0], [1.0]])
    for _ in range(30):
        wanted = np.tile(rng.normal(), (horizon + 1, 1))
        wanted[rng.integers(1, horizon + 1)] = wild * rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0)
        plan = controller.step(rng.normal(size=2), wanted)
        if plan.status.solved:
            x, u = plan.x.values, plan.u.values
            np.testing.assert_allclose(x[1:] - x[:-1], 0.5 * (x[1:] @ A.T + u @ B.T), atol=1e-9)
    assert controller.status_counts[rumo.Status.OPTIMAL] > 20
