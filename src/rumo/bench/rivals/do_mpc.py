"""The nonlinear program as do-mpc states it, solved to convergence by IPOPT; do-mpc is installed apart."""

from __future__ import annotations

import importlib
import warnings
from typing import Any

import casadi as ca
import numpy as np

from rumo.bench.augmented import augment
from rumo.controllers.engines.ipopt import linear_solver
from rumo.problem import Problem
from rumo.signals import Array


class DoMpc:
    """do-mpc's controller on a problem of Rumo.

    Parameters
    ----------
    problem : Problem
        What to solve.

    Attributes
    ----------
    applied : ndarray, shape (max(delay, 1), nu)
        Inputs already decided, oldest first, as in `rumo.Controller.applied`.

    Notes
    -----
    A discrete model, whose algebraic variables solve implicit Euler's equations. Soft constraints cost what is linear
    in their penalties, and none is imposed at the end of the horizon.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.applied: Array = np.zeros((max(problem.delay, 1), len(problem.model.inputs)))
        self._augmented = a = augment(problem)
        self._reference = np.zeros((problem.horizon + 1, len(problem.outputs)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            module: Any = importlib.import_module("do_mpc")
            model = module.model.Model("discrete", "SX")
            x = model.set_variable("_x", "x", shape=(a.x.numel(), 1))
            u = model.set_variable("_u", "u", shape=(a.u.numel(), 1))
            z = model.set_variable("_z", "z", shape=(a.guess.numel(), 1))
            for name in ("wanted", "weights"):
                model.set_variable("_tvp", name, shape=(len(problem.outputs), 1))
            terms = [a.defect, ca.vertcat(a.guess, a.decided)]
            defect, following = ca.Function("terms", [a.x, a.u, a.guess], terms)(x, u, z)
            model.set_rhs("x", following)
            model.set_alg("equations", defect)
            model.setup()
            self._controller = self._controlled(module.controller.MPC(model), model)
        self.reset()

    def _controlled(self, mpc: Any, model: Any) -> Any:
        problem, N, a = self.problem, self.problem.horizon, self._augmented
        x, u, wanted, weights = model.x["x"], model.u["u"], model.tvp["wanted"], model.tvp["weights"]
        outputs, rows = ca.Function("seen", [a.x], [a.outputs, ca.vertcat(ca.SX(0, 1), *a.rows)])(x)
        quiet = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False, "ipopt.linear_solver": linear_solver()}
        mpc.set_param(n_horizon=N, t_step=problem.sampling_time, store_full_solution=False, nlpsol_opts=quiet)
        tracking = ca.dot(weights, (outputs - wanted) ** 2)
        moving = ca.dot(ca.DM(problem.move_weights[-1] * problem.input_scales**2), (u - x[-u.numel() :]) ** 2)
        mpc.set_objective(mterm=tracking, lterm=tracking + moving)
        mpc.bounds["lower", "_u", "u"] = problem.numbers.input_lower[-1] / problem.input_scales
        mpc.bounds["upper", "_u", "u"] = problem.numbers.input_upper[-1] / problem.input_scales
        for k, item in enumerate(problem.constraints):
            soft = {} if item.penalty is None else {"soft_constraint": True, "penalty_term_cons": item.penalty.l1}
            mpc.set_nl_cons(f"row_{k}", rows[k], ub=0.0, **soft)
        template = mpc.get_tvp_template()

        def varying(_: float) -> Any:
            for k in range(N + 1):
                template["_tvp", k, "wanted"] = self._reference[k]
                template["_tvp", k, "weights"] = problem.output_weights[k - 1] if k else 0.0
            return template

        mpc.set_tvp_fun(varying)
        mpc.setup()
        return mpc

    def reset(self) -> None:
        """Forget everything; before the first sample the safe inputs were applied."""
        safe = self.problem.safe_input / self.problem.input_scales
        self._decided = np.tile(safe, (self._augmented.memory, 1))
        self._started = False

    def prepare(self) -> None:
        """Nothing: do-mpc starts from its last solution as it is."""

    def feedback(self, x: Array, reference: Array) -> Array:
        """Command (nu,) for a state x (nx,) and a reference (N + 1, ny) of the problem's outputs, from now on."""
        self._decided[-len(self.applied) :] = self.applied / self.problem.input_scales
        first, self._reference = np.r_[x, self._decided.ravel()], reference
        if not self._started:
            self._controller.x0, self._controller.u0, self._controller.z0 = first, self._decided[-1], x
            self._controller.set_initial_guess()
            self._started = True
        command = self._controller.make_step(first.reshape(-1, 1)).ravel()
        self._decided = np.vstack([self._decided[1:], command])
        return command * self.problem.input_scales
