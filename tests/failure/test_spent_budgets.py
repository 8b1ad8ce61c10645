"""A solution that ran out of its budget leaves nothing behind that the next one could take for true."""

import numpy as np
import pytest
from problems import BACKENDS, made_with

import rumo


def two_lags():
    """Coupled, with a soft bound between hard ones of both inputs."""
    model = rumo.Model(
        states={"x": "1", "y": "1"},
        inputs={"u": "1", "w": "1"},
        dynamics=lambda x, u, p: {"x": u.u - x.x + 0.3 * x.y, "y": u.w + 0.5 * u.u - x.y},
    )
    return rumo.Problem(
        model,
        horizon=4,
        sampling_time=0.5,
        track={"x": rumo.Weight(1.0), "y": rumo.Weight(1.0)},
        moves={"u": rumo.Weight(1e-2), "w": rumo.Weight(1e-2)},
        bounds={"u": (-1.0, 1.0), "w": (-1.0, 1.0), "x": rumo.Bounds(-0.5, 0.5, rumo.Penalty(1.0, 0.1))},
    )


@pytest.mark.parametrize("backend", BACKENDS[1:])
@pytest.mark.parametrize("iterations", range(8))
def test_what_is_solved_is_solved(backend, iterations):
    short, enough = (made_with(two_lags(), backend, gate=None, preparation_iterations=n) for n in (1, 0))
    short.configure(qp=rumo.QpOptions(max_iterations=iterations, tolerance=1e-12, solver=backend))
    rng = np.random.default_rng(iterations)
    for _ in range(600):
        x, wanted = rng.normal(size=2), np.tile(2.0 * rng.normal(size=2), (5, 1))
        enough.reset(applied=short.applied)
        plan = short.step(x, wanted)
        if plan.status.solved:
            np.testing.assert_allclose(plan.u.values, enough.step(x, wanted).u.values, atol=1e-8)
