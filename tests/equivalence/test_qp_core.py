"""The QP solver of the C core gives what other solvers give, on programs from closed loops and on invented ones."""

from functools import cache

import numpy as np
import pytest
from qps import CoreQp, least_violation, residuals, solve
from qps.others import SEMIDEFINITE, TIGHT, solve_with
from qps.random import degenerate, in_units, program
from qps.recorded import study, textbook

from rumo.status import Status

SOFTNESS = ("hard", "exact", "quadratic", "free", "mixed")
DRIVES = {
    "easy": lambda: study(3.0),
    "at the limit": lambda: study(4.0, at_the_limit=True),
    "hard circles": lambda: study(3.0, at_the_limit=True, hard=True),
    "delay 3": lambda: study(2.0, at_the_limit=True, delay=3),
    "swinging cart": lambda: textbook("swinging_cart", 40),
    "stiff reactor": lambda: textbook("stiff_reactor", 40),
    "cooled reactor": lambda: textbook("cooled_reactor", 40),
}


@cache
def recorded(name):
    return DRIVES[name]()


def assert_solved(p, answer, tolerance=1e-7):
    """What other solvers find is compared where they are accurate; the optimality conditions prove the rest."""
    assert answer.status is Status.OPTIMAL
    proof = residuals(p, answer.v, answer.multipliers)
    assert proof.worst < 1e-8
    for name in TIGHT:
        if name not in SEMIDEFINITE and np.any(np.isfinite(p.l1) & (p.l2 == 0.0)):
            continue  # these need curvature in every slack variable
        other = solve_with(name, p)
        if other is None or residuals(p, other.v, other.multipliers).worst > 1e-9:
            continue  # no solution, or a worse one than ours: it proves nothing
        np.testing.assert_allclose(answer.v, other.v, rtol=0.0, atol=tolerance, err_msg=name)


@pytest.mark.parametrize("name", DRIVES)
def test_programs_from_closed_loops(name):
    programs = recorded(name)
    for p in programs[:: max(1, len(programs) // 25)]:
        answer = solve(p)
        if answer.status is Status.SOLVER_FAILED:
            assert least_violation(p, answer.conflict) > 1e-9
        else:
            assert_solved(p, answer)


@pytest.mark.parametrize("name", DRIVES)
def test_a_working_set_from_the_sample_before_leads_to_the_same(name):
    programs = recorded(name)
    size = programs[0].rows.shape
    kept = CoreQp(size[1], size[0])
    for p in (p for p in programs if p.rows.shape == size):
        cold, warm = solve(p), kept.solve(p, warm=True)
        assert warm.status is cold.status
        if cold.status is Status.OPTIMAL:
            np.testing.assert_allclose(warm.v, cold.v, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("softness", SOFTNESS)
@pytest.mark.parametrize(("n", "m"), [(1, 0), (1, 3), (2, 1), (5, 0), (5, 12), (12, 30), (28, 60), (60, 120)])
def test_random_programs(n, m, softness):
    for seed in range(4):
        p = program(seed, n, m, softness=softness)
        assert_solved(p, solve(p))


@pytest.mark.parametrize("softness", SOFTNESS)
@pytest.mark.parametrize(("n", "m"), [(2, 6), (6, 20), (15, 40)])
def test_degenerate_programs(n, m, softness):
    for seed in range(10):
        p = degenerate(seed, n, m, softness)
        answer = solve(p)
        if answer.status is Status.SOLVER_FAILED:
            assert least_violation(p, answer.conflict) > 1e-9
        else:
            assert answer.status is Status.OPTIMAL
            assert residuals(p, answer.v, answer.multipliers).worst < 1e-8


@pytest.mark.parametrize("softness", SOFTNESS)
def test_units_of_rows_and_cost_do_not_matter(softness):
    for seed in range(6):
        p = program(seed, 10, 24, softness=softness)
        rows = 10.0 ** np.random.default_rng(seed).uniform(-6.0, 6.0, 24)
        np.testing.assert_allclose(solve(in_units(p, rows, 1e5)).v, solve(p).v, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("seed", range(12))
def test_a_conflict_is_one(seed):
    p = program(seed, 8, 16)
    wall = np.random.default_rng(seed).normal(size=8)
    rows = np.vstack([p.rows, wall, wall])
    reach = np.abs(wall).sum()
    p = type(p)(
        p.hessian,
        p.gradient,
        p.lower,
        np.ones(8),
        rows,
        np.r_[p.row_lower, -np.inf, 0.2 * reach],
        np.r_[p.row_upper, 0.1 * reach, np.inf],
        np.r_[p.l1, np.inf, np.inf],
        np.r_[p.l2, 0.0, 0.0],
    )
    answer = solve(p)
    assert answer.status is Status.SOLVER_FAILED
    assert least_violation(p, answer.conflict) > 1e-9
