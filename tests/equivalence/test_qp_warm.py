"""Wherever the QP solver of the C core starts from, it ends at the same solution."""

from dataclasses import replace

import numpy as np
import pytest
from qps import CoreQp, assert_answered, solve
from qps.random import SOFTNESS, degenerate, program, size

from rumo.status import Status


def changed(p, rng):
    """A program a little further on in time."""
    gradient = p.gradient + 0.1 * np.abs(p.gradient).max() * rng.normal(size=p.gradient.shape)
    upper = p.row_upper + 0.05 * np.abs(rng.normal(size=p.row_upper.shape))
    return replace(p, gradient=gradient, row_upper=upper)


def impossible(p):
    """Bounds that exclude each other's rows."""
    n = len(p.gradient)
    rows = np.vstack([np.ones(n), p.rows[1:]])
    upper = np.r_[-2.0 * n, p.row_upper[1:]]
    return replace(p, rows=rows, row_lower=np.r_[-np.inf, p.row_lower[1:]], row_upper=upper)


def same(core, p):
    warm, cold = core.solve(p, warm=True), solve(p)
    assert warm.status is cold.status
    if cold.status is Status.OPTIMAL:
        np.testing.assert_allclose(warm.v, cold.v, atol=1e-8)
    assert_answered(p, warm)
    return warm, cold


def sequence(make, softness, seed, length=6):
    n, m = size(seed, rows=1)
    rng = np.random.default_rng([seed, 4])
    p = make(seed, n, m, softness=softness)
    yield CoreQp(n, m), p, rng
    for _ in range(length):
        p = changed(p, rng)
        yield CoreQp(n, m), p, rng


@pytest.mark.parametrize("softness", SOFTNESS)
@pytest.mark.parametrize("make", [program, degenerate])
def test_from_the_program_before(make, softness):
    for seed in range(20):
        steps = list(sequence(make, softness, seed))
        core = steps[0][0]
        for _, p, _ in steps:
            same(core, p)


def test_a_warm_start_takes_fewer_changes():
    warm_changes = cold_changes = 0
    for seed in range(20):
        steps = list(sequence(program, "hard", seed))
        core = steps[0][0]
        core.solve(steps[0][1])
        for _, p, _ in steps[1:]:
            warm, cold = same(core, p)
            warm_changes += warm.iterations
            cold_changes += cold.iterations
    assert warm_changes < 0.5 * cold_changes


@pytest.mark.parametrize("softness", SOFTNESS)
def test_from_a_program_that_has_nothing_to_do_with_it(softness):
    for seed in range(20):
        n, m = size(seed)
        core = CoreQp(n, m)
        for other in range(4):
            same(core, program(1000 * other + seed, n, m, softness=softness))


@pytest.mark.parametrize("softness", SOFTNESS)
def test_after_an_infeasible_one(softness):
    for seed in range(20):
        core, p, rng = next(sequence(program, softness, seed))
        broken = impossible(p)
        p = replace(p, rows=broken.rows, row_upper=np.maximum(p.row_upper, p.row_lower))
        for _ in range(3):
            core.solve(p, warm=True)
            failed, _ = same(core, replace(broken, l1=np.r_[np.inf, p.l1[1:]]))
            assert failed.status is Status.SOLVER_FAILED
            p = changed(p, rng)
            same(core, p)


@pytest.mark.parametrize("softness", SOFTNESS)
@pytest.mark.parametrize("budget", [0, 1, 3, 10])
def test_after_the_budget_ran_out(softness, budget):
    for seed in range(10):
        for core, p, _ in sequence(program, softness, seed, 2):
            stopped = core.solve(p, qp_iterations=budget)
            assert stopped.status in (Status.OPTIMAL, Status.BUDGET_EXCEEDED)
            same(core, p)


def test_after_data_that_are_no_numbers():
    for seed in range(10):
        core, p, _ = next(sequence(program, "mixed", seed))
        core.solve(p)
        assert core.solve(replace(p, gradient=np.nan * p.gradient), warm=True).status is Status.SOLVER_FAILED
        same(core, p)


def test_after_enormous_data():
    for seed in range(10):
        for power in (20, 100, 300):
            core, p, _ = next(sequence(program, "mixed", seed))
            core.solve(replace(p, gradient=10.0**power * p.gradient), warm=True)
            same(core, p)


def test_with_other_prices_and_limits():
    # Multipliers in the ranges of former prices are not in those of the new ones; members may lose their limits.
    kinds = ("hard", "exact", "quadratic", "free", "mixed")
    for seed in range(20):
        n, m = size(seed)
        core = CoreQp(n, m)
        base = program(seed, n, m)
        for softness in (*kinds, *reversed(kinds)):
            other = program(seed, n, m, softness=softness)
            same(core, replace(base, l1=other.l1, l2=other.l2))
        same(core, replace(base, row_upper=np.full(m, np.inf)))
        same(core, replace(base, row_lower=np.full(m, -np.inf)))
        same(core, replace(base, lower=np.full(n, -np.inf), upper=np.full(n, np.inf)))
        same(core, base)


def test_when_there_is_nothing_left_to_do():
    # What rounding leaves behind is compared with an exact zero.
    for seed in range(20):
        core, p, _ = next(sequence(program, "mixed", seed))
        core.solve(p)
        rest = replace(
            p,
            gradient=np.zeros_like(p.gradient),
            row_lower=np.minimum(p.row_lower, -1e-3),
            row_upper=np.maximum(p.row_upper, 1e-3),
        )
        solution = core.solve(rest, warm=True)
        assert solution.status is Status.OPTIMAL
        np.testing.assert_allclose(solution.v, 0.0, atol=1e-12)
