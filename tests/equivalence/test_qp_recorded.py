"""On programs that controllers meet: the core's QP solver against others, cold and warm; and whole plans against it."""

from dataclasses import replace

import numpy as np
import pytest
from problems import made_with, reference_with
from qps import CoreQp, assert_solved, least_violation, solve
from qps.others import assert_agreement
from qps.recorded import study, textbook
from test_backends import CASES, PENALTIES, drive

from rumo.bench.qp import condense
from rumo.controllers.engines.qp import solve as solve_sparse
from rumo.status import Status

SHORT = {
    "easy": lambda: study(1.6),
    "at_the_limit": lambda: study(2.4, at_the_limit=True),
    "hard_circles": lambda: study(2.4, at_the_limit=True, hard=True),
    "no_delay": lambda: study(1.2, delay=0),
    "delay_2": lambda: study(1.2, delay=2),
    "delay_3": lambda: study(1.2, delay=3),
    "swinging_cart": lambda: textbook("swinging_cart", 30),
    "stiff_reactor": lambda: textbook("stiff_reactor", 30),
    "cooled_reactor": lambda: textbook("cooled_reactor", 30),
}
LONG = {
    "easy": lambda: study(24.0),
    "at_the_limit": lambda: study(24.0, at_the_limit=True),
    "hard_circles": lambda: study(24.0, at_the_limit=True, hard=True),
    "easy_30": lambda: study(8.0, horizon=30),
    "at_the_limit_30": lambda: study(12.0, at_the_limit=True, horizon=30),
    "at_the_limit_50": lambda: study(6.0, at_the_limit=True, horizon=50),
    "no_delay": lambda: study(12.0, at_the_limit=True, delay=0),
    "delay_2": lambda: study(12.0, at_the_limit=True, delay=2),
    "delay_3": lambda: study(12.0, at_the_limit=True, delay=3),
    "swinging_cart": lambda: textbook("swinging_cart", 300),
    "stiff_reactor": lambda: textbook("stiff_reactor", 300),
    "cooled_reactor": lambda: textbook("cooled_reactor", 300),
}


def check(programs, every):
    """All are solved, cold and warm alike, soft and as hard rows; every so many are shown to the other solvers."""
    assert len(programs) >= 20
    solvers = {}
    for i, soft in enumerate(programs):
        for kind, p in (("soft", soft), ("hard", replace(soft, l1=np.full(len(soft.l1), np.inf)))):
            shape = (len(p.gradient), len(p.rows))
            warm = solvers.setdefault((kind, *shape), CoreQp(*shape)).solve(p, warm=True)
            cold = solve(p)
            assert warm.status is cold.status
            if kind == "hard" and cold.status is Status.SOLVER_FAILED:
                assert least_violation(p, cold.conflict) > 1e-9
                continue
            assert_solved(p, cold)
            assert_solved(p, warm)
            np.testing.assert_allclose(warm.v, cold.v, atol=1e-9)
            if i % every == 0:
                assert assert_agreement(p, cold)


@pytest.mark.parametrize("name", SHORT)
def test_a_short_drive(name):
    check(SHORT[name](), every=3)


@pytest.mark.slow
@pytest.mark.parametrize("name", LONG)
def test_a_long_drive(name):
    check(LONG[name](), every=1)


OVER_LONG = dict.fromkeys(CASES, 100) | {"cart_pendulum": 40, "van_der_pol": 40}
"""Intervals, of unstable models as many as a condensed program of full accuracy has."""


@pytest.mark.slow
@pytest.mark.parametrize("softness", PENALTIES)
@pytest.mark.parametrize("name", OVER_LONG)
def test_plans_over_long_horizons(name, softness):
    """By the Riccati recursion and by condensing; others solve the reference's program at the same guess, condensed."""
    problem, x, wanted = CASES[name](OVER_LONG[name], 1, PENALTIES[softness])
    programs = []

    def recorded(program, options):
        programs.append(condense(program))
        return solve_sparse(program, options)

    reference = reference_with(problem, recorded)
    ours = [made_with(problem, solver) for solver in ("riccati", "condensing")]
    for *plans, _ in drive([*ours, reference], problem, x, wanted):
        guess, p = reference._engine.method.about.u, programs[-1]
        answer = solve(p)
        if answer.status is Status.SOLVER_FAILED:
            assert least_violation(p, answer.conflict) > 1e-9
            assert all(plan.cause is Status.SOLVER_FAILED for plan in plans)
            continue
        assert assert_agreement(p, answer)
        for plan in plans:
            v = (plan.u.values - guess)[problem.delay :] / problem.input_scales
            np.testing.assert_allclose(v.ravel(), answer.v, atol=1e-8)
