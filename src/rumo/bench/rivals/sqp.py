"""One SQP iteration of CasADi, `sqpmethod(max_iter=1)`, with one of its QP solvers."""

from __future__ import annotations

import tempfile
from contextlib import chdir
from typing import Any

import casadi as ca
import numpy as np

from rumo.bench.rivals.base import QUIET, Rival
from rumo.bench.rivals.staged import Staged
from rumo.problem import Problem

QP_OPTIONS: dict[str, dict[str, Any]] = {"hpipm": {"mode": "balance"}, "osqp": {"verbose": False}}
JIT: dict[str, Any] = {
    "jit": True,
    "jit_cleanup": False,
    "compiler": "shell",
    # -O2 takes three times as long, and gains nothing that can be measured.
    "jit_options": {"flags": "-O1 -march=native", "cleanup": False},
}
"""What CasADi makes is in the working directory: it heeds its own option for another one only in part."""


class CasadiSqp(Rival):
    """The real-time iteration as CasADi's SQP method with a single iteration, Gauss-Newton Hessian and full step.

    Parameters
    ----------
    problem : Problem
        What to solve.
    qp_solver : str
        CasADi's name: "hpipm", which gets the Newton step eliminated by hand, or "osqp", which gets sparse equations.
    compiled : bool
        Whether CasADi compiles its functions, which takes a while; its virtual machine evaluates them otherwise.
    **options
        Of the QP solver, by its own names.
    """

    def __init__(self, problem: Problem, qp_solver: str, *, compiled: bool = True, **options: Any) -> None:
        staged = qp_solver == "hpipm"
        super().__init__(problem, eliminated=staged)
        qp: dict[str, Any] = {qp_solver: QP_OPTIONS[qp_solver] | options, "error_on_fail": False}
        settings: dict[str, Any] = {
            "qpsol": qp_solver,
            "qpsol_options": qp | self._staged.sizes if staged else qp,
            "hess_lag": _gauss_newton(self._staged),
            "max_iter": 1,
            "max_iter_ls": 0,
            **QUIET,
            **dict.fromkeys(("print_header", "print_iteration", "print_status"), False),
        }
        if compiled:
            settings |= JIT
        with tempfile.TemporaryDirectory() as folder, chdir(folder):
            self._solver = ca.nlpsol("rti", "sqpmethod", self._staged.statement, settings)


def _gauss_newton(problem: Staged) -> Any:
    """The Hessian of the Lagrangian without the curvature of rows and outputs, as CasADi asks for it."""
    w, rows = problem.variables.values, len(problem.rows)
    residuals = ca.vertcat(*(stage.residuals for stage in problem.stages))
    weights, price = np.hstack([s.weights for s in problem.stages]), sum((s.price for s in problem.stages), ca.SX(0))
    J = ca.jacobian(residuals, w)
    H = 2.0 * J.T @ ca.diag(ca.DM(weights)) @ J + ca.hessian(price, w)[0]
    lam_f, lam_g = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", rows)
    names = ["x", "p", "lam_f", "lam_g"], ["hess_gamma_x_x"]
    return ca.Function("nlp_hess_l", [w, problem.parameters, lam_f, lam_g], [lam_f * H], *names)
