"""Expressions evaluated in buffers, and what solves equations."""

import casadi as ca
import numpy as np

from rumo.simulation.observer import Buffered, fast


def vectors(*sizes):
    return [ca.SX.sym(f"x{i}", size) for i, size in enumerate(sizes)]


def test_the_same_as_casadis_own_call_to_the_last_bit():
    x, u, p = vectors(3, 2, 0)
    function = ca.Function("f", [x, u, p], [ca.vertcat(ca.sin(x[0]) / u[1], ca.exp(x[2]) * x[1], u[0] ** 3)])
    observe, rng = fast(function), np.random.default_rng(0)
    assert isinstance(observe, Buffered)
    for _ in range(20):
        given = rng.normal(size=3), rng.normal(size=2), np.zeros(0)
        np.testing.assert_array_equal(observe(*given), function(*given).full().ravel())


def test_results_are_ones_own_and_arguments_stay():
    (x,) = vectors(2)
    observe, given = fast(ca.Function("f", [x], [2.0 * x])), np.array([1.0, np.nan])
    first = observe(given)
    second = observe(np.array([3.0, 4.0]))
    np.testing.assert_array_equal(first, [2.0, np.nan])
    np.testing.assert_array_equal(second, [6.0, 8.0])
    np.testing.assert_array_equal(given, [1.0, np.nan])


def test_nothing_to_observe_and_constants():
    (x,) = vectors(2)
    assert fast(ca.Function("f", [x], [ca.SX(0, 1)]))(np.zeros(2)).shape == (0,)
    sparse = ca.Function("f", [x], [ca.vertcat(ca.SX(1, 1), x[1])])
    np.testing.assert_array_equal(fast(sparse)(np.array([1.0, 2.0])), [0.0, 2.0])


def test_roots_are_found():
    z, p = vectors(1, 1)
    root = ca.rootfinder("root", "newton", ca.Function("g", [z, p], [z**2 - p]))
    given = ca.MX.sym("p")
    observe = fast(ca.Function("f", [given], [root(1.0, given)]))
    np.testing.assert_allclose(observe(np.array([4.0])), [2.0], rtol=1e-9)
