"""The QP seam against qpOASES, an active-set solver, on random problems with soft and hard rows."""

import casadi as ca
import numpy as np
import pytest

from rumo.controllers import QpOptions
from rumo.controllers.engines.qp import QuadraticProgram, solve
from rumo.status import Status


def random_program(seed, soft):
    rng = np.random.default_rng(seed)
    n, m = 12, 10
    J = rng.normal(size=(20, n)) * np.logspace(0, -1.5, n)
    return QuadraticProgram(
        hessian=J.T @ J + 1e-3 * np.eye(n),
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
    n, m = len(program.gradient), len(program.rows)
    soft = np.isfinite(program.l1)
    s = m if soft.any() else 0
    H = np.zeros((n + s, n + s))
    H[:n, :n] = program.hessian
    H[range(n, n + s), range(n, n + s)] = 2.0 * program.l2[:s]
    A = np.hstack([program.rows, -np.eye(m)[:, :s]])
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
    program = random_program(seed, soft)
    v, status = solve(program, QpOptions())
    assert status is Status.OPTIMAL
    np.testing.assert_allclose(v, qpoases(program), atol=1e-7)


def test_an_infeasible_program_is_never_called_solved():
    program = random_program(0, soft=False)
    rows = np.vstack([program.rows[0], -program.rows[0]])
    contradiction = QuadraticProgram(
        program.hessian,
        program.gradient,
        program.lower,
        program.upper,
        rows,
        np.full(2, -np.inf),
        np.full(2, -1.0),
        np.full(2, np.inf),
        np.zeros(2),
    )
    v, status = solve(contradiction, QpOptions())
    assert not status.solved
    assert np.isnan(v).all()


def test_data_that_are_not_finite_are_a_failure_not_an_exception():
    program = random_program(0, soft=True)
    program.gradient[3] = np.nan
    assert solve(program, QpOptions())[1] is Status.SOLVER_FAILED


@pytest.mark.parametrize("times", [1.0, 2.0])
def test_rows_that_depend_on_each_other_and_hold_together(times):
    # A bound and a row that says the same, both active: the multipliers are not unique, the minimiser is.
    H = np.array([[2.0, 0.5], [0.5, 1.0]])
    program = QuadraticProgram(
        H,
        H @ [-3.0, -0.5],
        np.full(2, -1.0),
        np.full(2, 1.0),
        np.array([[times, 0.0]]),
        np.full(1, -np.inf),
        np.full(1, times),
        np.full(1, np.inf),
        np.zeros(1),
    )
    v, status = solve(program, QpOptions(tolerance=1e-6))
    assert status is Status.OPTIMAL
    np.testing.assert_allclose(v, [1.0, 1.0], atol=1e-12)
