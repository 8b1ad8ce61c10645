"""Whatever the QP solver of the C core calls solved satisfies the optimality conditions; they need no other solver."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from qps import assert_answered, solve
from qps.random import SOFTNESS, degenerate, in_units, program, size

from rumo.bench.qp import QuadraticProgram


def check(p, tolerance=1e-9):
    """A proof of either answer."""
    answer = solve(p)
    assert_answered(p, answer, tolerance)
    return answer


@pytest.mark.parametrize("softness", SOFTNESS)
@pytest.mark.parametrize("make", [program, degenerate])
def test_random(make, softness):
    for seed in range(100):
        check(make(seed, *size(seed), softness=softness))


@pytest.mark.parametrize("softness", SOFTNESS)
def test_ill_conditioned(softness):
    for condition in (1e4, 1e6, 1e8, 1e10):
        for seed in range(40):
            check(program(seed, *size(seed), softness=softness, condition=condition))


def test_in_any_units():
    for seed in range(100):
        n, m = size(seed)
        rng = np.random.default_rng([seed, 5])
        rows, cost = 10.0 ** rng.uniform(-6.0, 6.0, m), 10.0 ** rng.uniform(-10.0, 10.0)
        check(in_units(program(seed, n, m, softness="mixed"), rows, cost))


def test_prices_from_almost_nothing_to_almost_hard():
    for seed in range(100):
        n, m = size(seed, rows=1)
        rng = np.random.default_rng([seed, 6])
        p = program(seed, n, m, softness="mixed")
        soft = np.isfinite(p.l1)
        l1 = np.where(soft, 10.0 ** rng.uniform(-9.0, 6.0, m), np.inf)
        l2 = np.where(soft & (rng.uniform(size=m) < 0.7), 10.0 ** rng.uniform(-9.0, 6.0, m), 0.0)
        check(replace(p, l1=l1, l2=l2))


@pytest.mark.slow
@pytest.mark.parametrize("softness", SOFTNESS)
@pytest.mark.parametrize("make", [program, degenerate])
def test_thousands(make, softness):
    for seed in range(1000, 4000):
        check(make(seed, *size(seed), softness=softness))


@pytest.mark.slow
@pytest.mark.parametrize("condition", [1e6, 1e8])
def test_thousands_of_ill_conditioned(condition):
    for seed in range(1000, 4000):
        check(program(seed, *size(seed), softness="mixed", condition=condition))


whole = st.integers(-3, 3).map(float)


@st.composite
def small_programs(draw):
    """Small whole numbers: ties and dependent rows everywhere."""
    n, m = draw(st.integers(1, 5)), draw(st.integers(0, 9))
    J = draw(arrays(float, (n, n), elements=whole))
    lower = draw(arrays(float, m, elements=whole))
    kind = draw(arrays(int, m, elements=st.integers(0, 3)))
    both = draw(arrays(bool, m))
    price = draw(arrays(float, m, elements=st.integers(1, 4).map(float)))
    width = draw(arrays(float, m, elements=st.integers(0, 3).map(float)))
    bound = draw(st.sampled_from([1.0, 2.0, np.inf]))
    return QuadraticProgram(
        hessian=J @ J.T + np.eye(n),
        gradient=draw(arrays(float, n, elements=whole)),
        lower=np.full(n, -bound),
        upper=np.full(n, bound),
        rows=draw(arrays(float, (m, n), elements=whole)),
        row_lower=np.where(both, lower, -np.inf),
        row_upper=lower + width,
        l1=np.array([np.inf, 1.0, 1.0, 0.0])[kind] * price,
        l2=np.array([0.0, 0.0, 1.0, 1.0])[kind] * price,
    )


@given(small_programs())
@settings(max_examples=300, deadline=None)
def test_small_whole_numbers(p):
    check(p)


def test_it_does_not_cycle_in_a_corner():
    # Beale's example, on which the simplex method cycles, as the rows of a projection; and all facets that meet in one
    # corner of a cross-polytope.
    beale = np.array([[0.25, -60.0, -0.04, 9.0], [0.5, -90.0, -0.02, 3.0], [0.0, 0.0, 1.0, 0.0]])
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 6)).reshape(6, -1).T
    for rows, upper, gradient in (
        (beale, np.array([0.0, 0.0, 1.0]), np.array([-0.75, 150.0, -0.02, 6.0])),
        (signs, np.ones(64), -10.0 * np.eye(6)[0]),
        (signs, np.zeros(64), np.arange(6.0)),
    ):
        n, m = rows.shape[1], len(rows)
        for small in (1.0, 1e-3, 1e-6):
            p = QuadraticProgram(
                small * np.eye(n), gradient, np.full(n, -np.inf), np.full(n, np.inf), rows,
                np.full(m, -np.inf), upper, np.full(m, np.inf), np.zeros(m),
            )  # fmt: skip
            lower = replace(p, lower=np.zeros(n))
            for q in (p, lower):
                assert check(q).iterations < 100


def alone(l1, l2, gradient, lower=-np.inf, upper=0.0):
    """One variable, one soft row: minimise v^2 / 2 + gradient v with lower <= v <= upper + s."""
    one = np.ones(1)
    return QuadraticProgram(
        np.eye(1), gradient * one, -np.inf * one, np.inf * one, np.eye(1), lower * one, upper * one, l1 * one, l2 * one
    )


@pytest.mark.parametrize(
    ("l1", "l2", "gradient", "v", "multiplier"),
    [
        (1.0, 0.0, -0.5, 0.0, 0.5),  # the price is above what the limit is worth: it holds
        (1.0, 0.0, -3.0, 2.0, 1.0),  # and here below
        (1.0, 0.5, -3.0, 1.0, 2.0),
        (0.0, 0.5, -3.0, 1.5, 1.5),
        (0.0, 0.0, -3.0, 3.0, 0.0),  # no price, no limit
        (np.inf, 0.0, -3.0, 0.0, 3.0),
        (1.0, 1e-12, -3.0, 2.0, 1.0),
        (1.0, 1e12, -3.0, 0.0, 3.0),
    ],
)
def test_a_soft_row(l1, l2, gradient, v, multiplier):
    solution = check(alone(l1, l2, gradient))
    np.testing.assert_allclose(solution.v, v, atol=1e-9)
    np.testing.assert_allclose(solution.multipliers, [0.0, multiplier], atol=1e-9)


def test_the_lower_limit_of_a_soft_row_is_hard():
    solution = check(alone(0.1, 0.1, gradient=5.0, lower=-1.0))
    np.testing.assert_allclose(solution.v, -1.0)
    np.testing.assert_allclose(solution.multipliers, [0.0, -4.0])
