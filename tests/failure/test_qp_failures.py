"""What the QP solver of the C core says when there is no solution, no time or no number."""

from dataclasses import replace

import numpy as np
import pytest
from qps import CoreQp, assert_solved, least_violation, solve
from qps.random import degenerate, program, size

from rumo.bench.qp import QuadraticProgram
from rumo.status import Status


def contradictory(seed):
    """Random rows of which some, of any number, exclude each other by a little or a lot."""
    n, m = size(seed, rows=3)
    rng = np.random.default_rng([seed, 7])
    p = degenerate(seed, n, m) if seed % 2 else program(seed, n, m)
    several = int(rng.integers(1, min(n, m - 1) + 1))
    chosen = rng.choice(m - 1, several, replace=False)
    share = rng.uniform(0.1, 1.0, several)
    rows, lower = p.rows.copy(), p.row_lower.copy()
    upper = np.where(np.isfinite(p.row_upper), p.row_upper, np.maximum(lower, 0.0) + 1.0)
    # The last row wants a sum of others to be greater than their limits allow.
    rows[-1] = share @ rows[chosen]
    lower[-1] = share @ upper[chosen] + max(np.linalg.norm(rows[-1]), 1.0) * 10.0 ** rng.uniform(-5.0, 1.0)
    upper[-1] = lower[-1] + 1.0
    return replace(p, rows=rows, row_upper=upper, row_lower=lower)


def test_infeasible_rows_are_named():
    for seed in range(150):
        p = contradictory(seed)
        answer = solve(p)
        assert answer.status is Status.SOLVER_FAILED
        assert least_violation(p, answer.conflict) > 1e-9
        assert len(set(answer.conflict)) == len(answer.conflict)


def test_the_conflict_names_what_matters():
    n = 6
    p = program(0, n, 4)
    rows, upper = p.rows.copy(), np.full(4, 100.0)
    lower = np.full(4, -100.0)
    rows[2], lower[2] = np.eye(n)[1] + np.eye(n)[4], 2.5  # the bounds allow 2
    answer = solve(replace(p, upper=np.ones(n), rows=rows, row_lower=lower, row_upper=upper))
    assert answer.status is Status.SOLVER_FAILED
    assert set(answer.conflict) == {1, 4, n + 2}


def test_limits_that_cross():
    p = program(0, 6, 4)
    for name, other, index, row in (("lower", "upper", 2, 2), ("row_lower", "row_upper", 1, 7)):
        limits = getattr(p, name).copy()
        limits[index] = getattr(p, other)[index] + 0.1
        answer = solve(replace(p, **{name: limits}))
        assert answer.status is Status.SOLVER_FAILED
        assert answer.conflict == (row,)


def test_limits_that_cross_by_rounding():
    p = program(0, 6, 4)
    p = replace(p, lower=np.r_[0.3 + 1e-15, p.lower[1:]], upper=np.r_[0.3, p.upper[1:]])
    answer = solve(p)
    assert answer.status is Status.OPTIMAL
    np.testing.assert_allclose(answer.v[0], 0.3)


def test_a_row_of_zeros():
    p = program(0, 6, 4)
    rows = np.vstack([np.zeros(6), p.rows[1:]])
    for upper, status in ((1.0, Status.OPTIMAL), (0.0, Status.OPTIMAL), (-1e-3, Status.SOLVER_FAILED)):
        zero_row = replace(
            p, rows=rows, row_lower=np.r_[-np.inf, p.row_lower[1:]], row_upper=np.r_[upper, p.row_upper[1:]]
        )
        answer = solve(zero_row)
        assert answer.status is status
        assert answer.conflict == ((6,) if status is Status.SOLVER_FAILED else ())
        soft = replace(zero_row, l1=np.r_[0.5, p.l1[1:]], l2=np.r_[0.25, p.l2[1:]])
        assert_solved(soft, solve(soft))


@pytest.mark.parametrize("budget", [0, 1, 2, 5, 20])
def test_few_changes(budget):
    exceeded = 0
    for seed in range(40):
        p = program(seed, *size(seed), softness="mixed")
        answer = solve(p, qp_iterations=budget)
        assert answer.status in (Status.OPTIMAL, Status.BUDGET_EXCEEDED)
        assert answer.iterations <= budget
        assert np.isfinite(answer.v).all()
        if answer.status is Status.OPTIMAL:
            assert_solved(p, answer)
        exceeded += answer.status is Status.BUDGET_EXCEEDED
    assert exceeded > 10


@pytest.mark.parametrize("seconds", [0.0, 1e-9, 1e-6])
def test_little_time(seconds):
    for seed in range(40):
        p = program(seed, 50, 100, softness="mixed")
        answer = solve(p, seconds=seconds)
        assert answer.status is Status.BUDGET_EXCEEDED
        assert np.isfinite(answer.v).all()


def test_plenty_of_time():
    p = program(0, 50, 100, softness="mixed")
    assert_solved(p, solve(p, seconds=60.0))


FIELDS = tuple(vars(program(0, 2, 2)))
HARMLESS = {("lower", -np.inf), ("upper", np.inf), ("row_lower", -np.inf), ("row_upper", np.inf), ("l1", np.inf)}


def spoiled(p, name, value):
    """The program with each number of an array replaced in turn; of the Hessian, the upper triangle is what counts."""
    for index in np.ndindex(getattr(p, name).shape):
        if name != "hessian" or index[0] <= index[1]:
            array = getattr(p, name).copy()
            array[index] = value
            yield replace(p, **{name: array})


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", FIELDS)
def test_data_that_are_no_numbers(name, value):
    p = program(3, 5, 7, softness="mixed")
    core = CoreQp(5, 7)
    for other in spoiled(p, name, value):
        answer = core.solve(other, warm=True)
        if (name, value) in HARMLESS:
            assert answer.status is Status.OPTIMAL or answer.conflict
        else:
            assert answer.status is Status.SOLVER_FAILED
    assert_solved(p, core.solve(p, warm=True))


@pytest.mark.parametrize("value", [1e300, -1e300, 1e200, 1e155, 1e100, -1e20])
@pytest.mark.parametrize("name", FIELDS)
def test_enormous_data_end_somehow(name, value):
    p = program(3, 5, 7, softness="mixed")
    for other in spoiled(p, name, value):
        answer = solve(other)
        if answer.status is Status.OPTIMAL:
            assert np.isfinite(answer.v).all()
            assert np.isfinite(answer.multipliers).all()


@pytest.mark.parametrize("hessian", [np.diag([1.0, -1.0]), np.diag([1.0, 0.0]), np.ones((2, 2)), np.zeros((2, 2))])
def test_a_hessian_that_is_not_definite(hessian):
    p = QuadraticProgram(
        hessian, np.ones(2), -np.ones(2), np.ones(2), np.zeros((0, 2)), *(np.zeros(0) for _ in range(4))
    )
    answer = solve(p)
    assert answer.status is Status.SOLVER_FAILED
    assert answer.conflict == ()


@pytest.mark.parametrize("seed", range(20))
def test_bounds_hold_however_steep_the_cost(seed):
    """A solution at bounds alone is exact, and refinement must not spoil it by what rounding leaves of 1e20."""
    rng = np.random.default_rng(seed)
    p = program(seed, 8, 0, condition=1e9)
    p = replace(p, gradient=1e20 * rng.normal(size=8), upper=np.ones(8))
    answer = solve(p)
    assert answer.status is Status.OPTIMAL
    assert max((p.lower - answer.v).max(), (answer.v - p.upper).max()) < 1e-10
