"""The QP seam against qpOASES, an active-set solver, on random problems with soft and hard rows."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.sparse import csc_array

from rumo.controllers import QpOptions
from rumo.controllers.engines.conditions import KKT_TOLERANCE, Conditions, Point, SparseProgram
from rumo.controllers.engines.qp import solve
from rumo.status import Status


def program(hessian, **vectors):
    """A program in inputs alone."""
    n = len(hessian)
    rows, none = csc_array(vectors.pop("rows")), csc_array((0, n))
    return SparseProgram(
        csc_array(hessian), equations=none, ends=np.zeros(0), rows=rows, signals=np.zeros(n, int), **vectors
    )


def random_program(seed, soft):
    rng = np.random.default_rng(seed)
    n, m = 12, 10
    J = rng.normal(size=(20, n)) * np.logspace(0, -1.5, n)
    return program(
        J.T @ J + 1e-3 * np.eye(n),
        gradient=rng.normal(size=n),
        lower=np.full(n, -1.0),
        upper=np.full(n, 1.0),
        rows=rng.normal(size=(m, n)),
        row_lower=np.full(m, -np.inf),
        row_upper=rng.normal(size=m) + (-0.5 if soft else 2.0),
        l1=rng.uniform(0.1, 2.0, m) if soft else np.full(m, np.inf),
        l2=np.where(np.arange(m) % 2, rng.uniform(0.1, 2.0, m), 0.0) if soft else np.zeros(m),
    )


def qpoases(program):
    """Minimiser by qpOASES, slack variables written out."""
    n, m = len(program.gradient), len(program.row_upper)
    soft = np.isfinite(program.l1)
    s = m if soft.any() else 0
    H = np.zeros((n + s, n + s))
    H[:n, :n] = program.hessian.toarray()
    H[range(n, n + s), range(n, n + s)] = 2.0 * program.l2[:s]
    A = np.hstack([program.rows.toarray(), -np.eye(m)[:, :s]])
    options = {"printLevel": "none", "error_on_fail": True, "terminationTolerance": 1e-12}
    solver = ca.conic("qp", "qpoases", {"h": ca.DM(H).sparsity(), "a": ca.DM(A).sparsity()}, options)
    result = solver(
        h=H,
        g=np.r_[program.gradient, program.l1[:s]],
        a=A,
        lba=program.row_lower,
        uba=program.row_upper,
        lbx=np.r_[program.lower, np.zeros(s)],
        ubx=np.r_[program.upper, np.full(s, np.inf)],
    )
    return result["x"].full().ravel()[:n]


@pytest.mark.parametrize("soft", [True, False])
@pytest.mark.parametrize("seed", range(10))
def test_same_minimiser_as_qpoases(seed, soft):
    p = random_program(seed, soft)
    solution = solve(p, QpOptions())
    assert solution.status is Status.OPTIMAL
    assert solution.residual < 1e-12
    np.testing.assert_allclose(solution.q, qpoases(p), atol=1e-7)


@pytest.mark.parametrize("soft", [True, False])
@pytest.mark.parametrize("seed", range(10))
def test_newtons_method_gets_there_from_anywhere(seed, soft):
    """Each row three times, so that active ones depend on each other."""
    p, rng = random_program(seed, soft), np.random.default_rng([seed, 1])
    again = {name: np.tile(getattr(p, name), 3) for name in ("row_lower", "row_upper", "l1", "l2")}
    conditions = Conditions(replace(p, rows=csc_array(np.tile(p.rows.toarray(), (3, 1))), **again))
    far = Point(10.0 * rng.normal(size=12), np.zeros(0), rng.exponential(10.0, len(conditions.c)))
    point, _ = conditions.minimise(conditions.approach(far))
    # How copies share the price of their row is a matter of a regularisation of 1e-8, and so of rounding, which differs
    # from processor to processor: at the kink of a soft row, forces balance to 1e-10 or so.
    assert conditions.residual(point) < (KKT_TOLERANCE if soft else 1e-12)
    np.testing.assert_allclose(point.q, qpoases(replace(p, l1=3.0 * p.l1, l2=3.0 * p.l2)), atol=1e-7)


def test_an_infeasible_program_is_never_called_solved():
    p = random_program(0, soft=False)
    row = p.rows.toarray()[0]
    hard = {
        "row_lower": np.full(2, -np.inf),
        "row_upper": np.full(2, -1.0),
        "l1": np.full(2, np.inf),
        "l2": np.zeros(2),
    }
    solution = solve(replace(p, rows=csc_array([row, -row]), **hard), QpOptions())
    assert solution.status is Status.SOLVER_FAILED
    assert np.isnan(solution.q).all()


def test_data_that_are_not_finite_are_a_failure_not_an_exception():
    p = random_program(0, soft=True)
    p.gradient[3] = np.nan
    assert solve(p, QpOptions()).status is Status.SOLVER_FAILED


@pytest.mark.parametrize("times", [1.0, 2.0])
def test_rows_that_depend_on_each_other_and_hold_together(times):
    # A bound and a row that says the same, both active: the multipliers are not unique, the minimiser is.
    H = np.array([[2.0, 0.5], [0.5, 1.0]])
    p = program(
        H,
        gradient=H @ [-3.0, -0.5],
        lower=np.full(2, -1.0),
        upper=np.full(2, 1.0),
        rows=np.array([[times, 0.0]]),
        row_lower=np.full(1, -np.inf),
        row_upper=np.full(1, times),
        l1=np.full(1, np.inf),
        l2=np.zeros(1),
    )
    solution = solve(p, QpOptions(tolerance=1e-6))
    assert solution.status is Status.OPTIMAL
    np.testing.assert_allclose(solution.q, [1.0, 1.0], atol=1e-12)
