"""A0, M, B, D, E and the outputs' derivatives against central differences of the stage functions."""

import numpy as np
import pytest
from problems import PROBLEMS

import rumo
from rumo.transcription import Transcription

NATURAL = {
    "car": ([0.3, 1.0, 0.2, 8.0, 0.1, 0.05, 13.4, 13.3, 0.05], [20.0, 0.1]),
    "swinging_cart": ([0.5, -0.3, 0.4, 1.0], [2.0]),
    "stiff_reactor": ([0.7, 1e-5, 0.3], [0.02]),
    "cooled_reactor": ([2.1, 1.1, 114.0, 112.0], [14.0, -1000.0]),
}


SCHEMES = {
    "implicit_euler": rumo.ImplicitEuler(),
    "two_implicit_euler": rumo.ImplicitEuler(substeps=2),
    "radau2": rumo.Radau2(),
    "bdf2": rumo.Bdf2(),
    "five_explicit": rumo.Rk4(substeps=5),
}
PAIRS = [
    pytest.param(name, scheme, id=f"{name}-{of}")
    for name in PROBLEMS
    for of, scheme in SCHEMES.items()
    if not (scheme.explicit and name in ("car", "stiff_reactor"))  # which leave the numbers within a step
]


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


@pytest.mark.parametrize(("name", "scheme"), PAIRS)
def test_linearisation_against_finite_differences(name, scheme):
    problem, *_ = PROBLEMS[name]()
    transcription = Transcription(problem, scheme)
    x, u = (np.array(values) for values in NATURAL[name])
    N = problem.horizon
    z, p = x * 1.01 + 1e-3 * np.abs(x), problem.parameters[0]
    guess_x = np.vstack([x] + [z] * N)
    inner = 1.001 * transcription.inner_between(guess_x[:-1], guess_x[1:])
    stages = transcription.linearize(guess_x, np.tile(u, (N, 1)), inner, problem.parameters)
    w = np.r_[z, inner[0]]

    def residual(w, x, u):
        return transcription.interval(w, x, u, p).full().ravel()

    def outputs(z, u):
        return transcription.outputs(z, u, p).full().ravel()

    def constraints(z, u):
        return transcription.constraints(z, u, p).full().ravel()

    checks = {
        "M": -central(lambda v: residual(v, x, u), w),
        "A0": central(lambda v: residual(w, v, u), x),
        "B": central(lambda v: residual(w, x, v), u),
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
    assert len(stages.defect[0]) == len(w) == transcription.unknowns
    np.testing.assert_allclose(stages.defect[0], residual(w, x, u), rtol=1e-14, atol=1e-14)
    np.testing.assert_array_equal(stages.y[0], outputs(z, u))
    np.testing.assert_array_equal(stages.G[0], constraints(z, u) - problem.numbers.limits[0])


@pytest.mark.parametrize(("name", "scheme"), PAIRS)
def test_stages_do_not_mix(name, scheme):
    problem, *_ = PROBLEMS[name]()
    transcription = Transcription(problem, scheme)
    x, u = (np.array(values) for values in NATURAL[name])
    N = problem.horizon
    growth = 1.0 + 0.01 * np.arange(N + 1)[:, None]
    guess_x, guess_u = x * growth, u * growth[:-1]
    inner = transcription.inner_between(guess_x[:-1], guess_x[1:])
    stages = transcription.linearize(guess_x, guess_u, inner, problem.parameters)
    for k in (0, N // 2, N - 1):
        same_x = np.vstack([guess_x[k]] + [guess_x[k + 1]] * N)
        same = np.tile(guess_u[k], (N, 1)), np.tile(inner[k], (N, 1)), problem.parameters
        alone = transcription.linearize(same_x, *same)
        for key in ("defect", "A0", "M", "B", "y", "Cx", "Cu", "G", "D", "E"):
            np.testing.assert_array_equal(getattr(stages, key)[k], getattr(alone, key)[0], err_msg=key)
