"""A0, A1, B, D, E and the outputs' derivatives against central differences of the stage functions."""

import numpy as np
import pytest
from problems import PROBLEMS

from rumo.transcription import Transcription

NATURAL = {
    "car": ([0.3, 1.0, 0.2, 8.0, 0.1, 0.05, 13.4, 13.3, 0.05], [20.0, 0.1]),
    "swinging_cart": ([0.5, -0.3, 0.4, 1.0], [2.0]),
    "stiff_reactor": ([0.7, 1e-5, 0.3], [0.02]),
    "cooled_reactor": ([2.1, 1.1, 114.0, 112.0], [14.0, -1000.0]),
}


def central(function, point):
    """Derivative by central differences, with steps that fit each entry's size."""
    columns = []
    for j, value in enumerate(point):
        # Error of the difference: step^2 by curvature, 1e-16 / step by rounding; the cube root balances them.
        step = 6e-6 * max(abs(value), 1e-3)
        high, low = point.copy(), point.copy()
        high[j] += step
        low[j] -= step
        columns.append((function(high) - function(low)) / (high[j] - low[j]))
    return np.column_stack(columns)


@pytest.mark.parametrize("name", PROBLEMS)
def test_linearisation_against_finite_differences(name):
    problem, *_ = PROBLEMS[name]()
    transcription = Transcription(problem)
    x, u = (np.array(values) for values in NATURAL[name])
    z, p = x * 1.01 + 1e-3 * np.abs(x), problem.parameters
    N = problem.horizon
    guess_x = np.vstack([x] + [z] * N)
    stages = transcription.linearize(guess_x, np.tile(u, (N, 1)))

    def residual(z, x, u):
        return transcription.residual(z, x, u, p).full().ravel()

    def outputs(z, u):
        return transcription.outputs(z, u, p).full().ravel()

    def constraints(z, u):
        return transcription.constraints(z, u, p).full().ravel()

    # phi = F - z, so dF/dz = I + dphi/dz.
    checks = {
        "A1": np.eye(len(x)) + central(lambda v: residual(v, x, u), z),
        "A0": central(lambda v: residual(z, v, u), x),
        "B": central(lambda v: residual(z, x, v), u),
        "Cx": central(lambda v: outputs(v, u), z),
        "Cu": central(lambda v: outputs(z, v), u),
        "D": central(lambda v: constraints(v, u), z),
        "E": central(lambda v: constraints(z, v), u),
    }
    for key, expected in checks.items():
        exact = getattr(stages, key)[0]
        # Rows differ by many orders of magnitude in a stiff model: compare each with its own largest entry.
        size = np.maximum(np.abs(exact).max(axis=1, keepdims=True), 1e-9) if exact.size else 1.0
        assert np.max(np.abs(exact - expected) / size, initial=0.0) < 2e-6, key
    np.testing.assert_array_equal(stages.defect[0], residual(z, x, u))
    np.testing.assert_array_equal(stages.y[0], outputs(z, u))
    np.testing.assert_array_equal(stages.G[0], constraints(z, u))


@pytest.mark.parametrize("name", PROBLEMS)
def test_stages_do_not_mix(name):
    problem, *_ = PROBLEMS[name]()
    transcription = Transcription(problem)
    x, u = (np.array(values) for values in NATURAL[name])
    N = problem.horizon
    growth = 1.0 + 0.01 * np.arange(N + 1)[:, None]
    guess_x, guess_u = x * growth, u * growth[:-1]
    stages = transcription.linearize(guess_x, guess_u)
    for k in (0, N // 2, N - 1):
        alone = transcription.linearize(np.vstack([guess_x[k]] + [guess_x[k + 1]] * N), np.tile(guess_u[k], (N, 1)))
        for key in ("defect", "A0", "A1", "B", "y", "Cx", "Cu", "G", "D", "E"):
            np.testing.assert_array_equal(getattr(stages, key)[k], getattr(alone, key)[0], err_msg=key)
