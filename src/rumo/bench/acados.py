"""The real-time iteration of acados on Rumo's problems, to compare with; acados is installed apart."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import io
import itertools
import tempfile
import warnings
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from rumo.bench.augmented import augment, constant
from rumo.problem import Problem
from rumo.signals import Array
from rumo.transcription import Transcription

COMPILER_FLAGS = "-O3 -march=native"
BLOCK = 6
"""Stages that partial condensing joins to one."""

_numbers = itertools.count()


def available() -> bool:
    """Whether acados' Python package can be imported."""
    return importlib.util.find_spec("acados_template") is not None


class AcadosRti:
    """SQP_RTI of acados with implicit Euler, on the discretised problem that `rumo.RealTimeIteration` solves.

    Parameters
    ----------
    problem : Problem
        What to solve.
    qp_solver : str
        acados' name: "FULL_CONDENSING_DAQP" or "PARTIAL_CONDENSING_HPIPM".
    integrator : str
        "IRK", acados' own implicit integrator, or "DISCRETE", the Newton step eliminated symbolically by hand.

    Attributes
    ----------
    times_us : tuple of float
        Times of the last preparation and the last feedback as acados measures them [us].
    status : int
        acados' status of the last feedback, or else that of its QP: 0 is success.

    Notes
    -----
    The state is augmented by inputs already decided, and the control of stage i is the input `u_{i+d}`: delay and moves
    are in the dynamics, the inputs' limits stay simple bounds. The last d controls act beyond the horizon; moving is
    their only cost, so they stay. Implicit Euler is the one-stage Radau IIA method with one Newton step from the guess.
    IRK takes the derivatives after that step, DISCRETE and Rumo before it.
    """

    def __init__(self, problem: Problem, qp_solver: str, integrator: str = "IRK") -> None:
        self.problem, self.integrator = problem, integrator
        self.times_us = (np.nan, np.nan)
        self.status = 0
        acados: Any = importlib.import_module("acados_template")
        self._infinity: float = acados.ACADOS_INFTY
        self._augmented = augmented = augment(problem)
        N = problem.horizon

        ocp = acados.AcadosOcp()
        ocp.model.name = f"rumo_{next(_numbers)}"
        ocp.model.x, ocp.model.u = augmented.x, augmented.u
        if integrator == "IRK":
            ocp.model.xdot, ocp.model.f_impl_expr = augmented.xdot, augmented.residual
        else:
            ocp.model.p, ocp.parameter_values = augmented.guess, np.zeros(augmented.guess.numel())
            ocp.model.disc_dyn_expr, ocp.model.disc_dyn_custom_jac_ux_expr = augmented.step, augmented.jacobian
        self._set_cost(ocp)
        self._set_constraints(ocp)
        options = ocp.solver_options
        options.N_horizon, options.tf = N, N * problem.sampling_time
        options.cost_scaling = np.ones(N + 1)  # not by the time step
        options.nlp_solver_type, options.hessian_approx = "SQP_RTI", "GAUSS_NEWTON"
        options.integrator_type, options.collocation_type = integrator, "GAUSS_RADAU_IIA"
        options.sim_method_num_stages = options.sim_method_num_steps = options.sim_method_newton_iter = 1
        options.qp_solver = qp_solver
        if qp_solver == "PARTIAL_CONDENSING_HPIPM":
            options.hpipm_mode, options.qp_solver_cond_N = "SPEED_ABS", max(1, N // BLOCK)
            options.qp_solver_warm_start = 2
        else:
            # With 2, DAQP would keep the matrices of the first QP.
            options.qp_solver_warm_start, options.qp_solver_iter_max = 1, 1000
        ocp.code_gen_options.ext_fun_compile_flags = COMPILER_FLAGS
        self._folder = tempfile.TemporaryDirectory(prefix="rumo-acados-")
        ocp.code_gen_options.code_export_directory = str(Path(self._folder.name) / "code")
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            self._solver = acados.AcadosOcpSolver(ocp, verbose=False)
        for i in range(1, N):
            self._solver.cost_set(i, "W", np.diag(np.r_[self._tracking[i - 1], self._moving[i]]))
            interval = min(i, len(self._lower) - 1)  # beyond the horizon, the last
            self._solver.constraints_set(i, "lbu", self._lower[interval])
            self._solver.constraints_set(i, "ubu", self._upper[interval])
        self._release(ocp.constraints)
        self.reset(np.zeros(len(problem.model.states)))

    def reset(self, x: Array) -> None:
        """Forget everything; guess that the state stays at x (nx,) and the inputs at the safe ones."""
        self._solver.reset()
        self._decided = np.tile(self.problem.safe_input / self.problem.input_scales, (self._augmented.memory, 1))
        self._x = np.tile(np.r_[x, self._decided.ravel()], (self.problem.horizon + 1, 1))
        self._u = np.tile(self._decided[-1], (self.problem.horizon, 1))
        self._started = False

    @property
    def applied(self) -> Array:
        """Inputs already decided, shape (max(delay, 1), nu), oldest first, as in `rumo.Controller.applied`."""
        return self._decided[-max(self.problem.delay, 1) :] * self.problem.input_scales

    @applied.setter
    def applied(self, inputs: Array) -> None:
        self._decided[-max(self.problem.delay, 1) :] = inputs / self.problem.input_scales

    def prepare(self) -> None:
        """Shift the guess by a sample. acados' preparation needs the reference: it runs, timed apart, in `feedback`."""
        nx, nu = len(self.problem.model.states), len(self.problem.model.inputs)
        if self._started:
            self._u = np.vstack([self._u[1:], self._u[-1]])
            self._x = np.vstack([self._x[1:], 2.0 * self._x[-1] - self._x[-2]])
            self._x[-1, nx:] = np.r_[self._x[-2, nx + nu :], self._u[-1]]
        self._solver.set_flat("x", self._x.ravel())
        self._solver.set_flat("u", self._u.ravel())
        if self.integrator == "DISCRETE":
            self._solver.set_flat("p", np.vstack([self._x[1:, :nx], self._x[-1, :nx]]).ravel())
        else:
            for i, slope in enumerate(np.diff(self._x, axis=0) / self.problem.sampling_time):
                self._solver.set(i, "xdot_guess", slope)

    def feedback(self, x: Array, reference: Array) -> Array:
        """Command (nu,) for a state x (nx,) and a reference (N + 1, ny) of the problem's outputs, from now on."""
        solver, N, nu = self._solver, self.problem.horizon, self._u.shape[1]
        for i in range(1, N):
            solver.cost_set(i, "yref", np.r_[reference[i] - self._offset, np.zeros(nu)])
        solver.cost_set(N, "yref", reference[N] - self._offset)
        solver.options_set("rti_phase", 1)
        solver.solve()
        preparation = solver.get_stats("time_preparation")

        initial = np.r_[x, self._decided.ravel()]
        solver.constraints_set(0, "lbx", initial)
        solver.constraints_set(0, "ubx", initial)
        solver.options_set("rti_phase", 2)
        # A QP that reached its iteration limit is no failure to acados.
        self.status = int(solver.solve()) or int(solver.get_stats("qp_stat")[-1])
        self.times_us = (1e6 * preparation, 1e6 * solver.get_stats("time_feedback"))
        self._x = solver.get_flat("x").reshape(self._x.shape)
        self._u = solver.get_flat("u").reshape(self._u.shape)
        self._decided = np.vstack([self._decided[1:], self._u[0]])
        self._started = True
        return self._u[0] * self.problem.input_scales

    def _set_cost(self, ocp: Any) -> None:
        """Linear least squares where the outputs are affine; acados halves the weights."""
        problem, x, u, y = self.problem, self._augmented.x, self._augmented.u, self._augmented.outputs
        linear = not ca.depends_on(ca.jacobian(y, x), x)
        self._offset = constant(ca.substitute(y, x, 0)).ravel() if linear else np.zeros(y.numel())
        R = 2.0 * problem.move_weights * problem.input_scales**2
        self._tracking = 2.0 * problem.output_weights
        self._moving = np.vstack([R[problem.delay :], np.tile(R[-1], (problem.delay, 1))])
        move = u - x[-u.numel() :]
        stages = {
            "_0": (move, self._moving[0]),
            "": (ca.vertcat(y, move), np.r_[self._tracking[0], self._moving[0]]),
            "_e": (y, self._tracking[-1]),
        }
        for stage, (residual, weights) in stages.items():
            setattr(ocp.cost, f"cost_type{stage}", "LINEAR_LS" if linear else "NONLINEAR_LS")
            setattr(ocp.cost, f"W{stage}", np.diag(weights))
            setattr(ocp.cost, f"yref{stage}", np.zeros(residual.numel()))
            if not linear:
                setattr(ocp.model, f"cost_y_expr{stage}", residual)
                continue
            setattr(ocp.cost, f"Vx{stage}", constant(ca.jacobian(residual, x)))
            if stage != "_e":
                setattr(ocp.cost, f"Vu{stage}", constant(ca.jacobian(residual, u)))

    def _set_constraints(self, ocp: Any) -> None:
        """Hard limits of a single state as simple bounds, other rows as nonlinear constraints."""
        problem, constraints, x, u = self.problem, ocp.constraints, self._augmented.x, self._augmented.u
        constraints.x0 = np.zeros(x.numel())
        constraints.idxbu = np.arange(u.numel())
        self._lower = self._limits(problem.numbers.input_lower[problem.delay :] / problem.input_scales)
        self._upper = self._limits(problem.numbers.input_upper[problem.delay :] / problem.input_scales)
        constraints.lbu, constraints.ubu = self._lower[0], self._upper[0]
        moved = np.flatnonzero(np.isfinite(problem.move_lower) | np.isfinite(problem.move_upper))
        if moved.size:
            constraints.C = constant(-ca.jacobian(x[-u.numel() :], x))[moved]
            constraints.D = np.eye(u.numel())[moved]
            constraints.lg = self._limits((problem.move_lower / problem.input_scales)[moved])
            constraints.ug = self._limits((problem.move_upper / problem.input_scales)[moved])

        bounds: dict[int, list[float]] = {}
        self._bounded: dict[int, list[int]] = {}
        self._nonlinear: list[int] = []
        for k, (item, row) in enumerate(zip(problem.constraints, self._augmented.rows, strict=True)):
            gradient = ca.jacobian(row, x)
            if item.penalty is None and gradient.nnz() == 1 and gradient.is_constant():
                slope = constant(gradient).ravel()
                j = int(np.flatnonzero(slope)[0])
                side = bounds.setdefault(j, [-self._infinity, self._infinity])
                side[int(slope[j] > 0.0)] = -float(constant(ca.substitute(row, x, 0)).item()) / slope[j]
                self._bounded.setdefault(j, []).append(k)
            else:
                self._nonlinear.append(k)
        penalties = [problem.constraints[k].penalty for k in self._nonlinear]
        soft = [(i, penalty) for i, penalty in enumerate(penalties) if penalty is not None]
        l1 = np.array([penalty.l1 for _, penalty in soft])
        l2 = np.array([2.0 * penalty.l2 for _, penalty in soft])
        nonlinear = ca.vertcat(*(self._augmented.rows[k] for k in self._nonlinear))
        for stage in ("", "_e"):
            if bounds:
                setattr(constraints, f"idxbx{stage}", np.array(list(bounds)))
                setattr(constraints, f"lbx{stage}", np.array([lower for lower, _ in bounds.values()]))
                setattr(constraints, f"ubx{stage}", np.array([upper for _, upper in bounds.values()]))
            if self._nonlinear:
                setattr(ocp.model, f"con_h_expr{stage}", nonlinear)
                setattr(constraints, f"lh{stage}", np.full(len(self._nonlinear), -self._infinity))
                setattr(constraints, f"uh{stage}", np.zeros(len(self._nonlinear)))
            if soft:
                setattr(constraints, f"idxsh{stage}", np.array([i for i, _ in soft]))
                for side in ("l", "u"):
                    setattr(ocp.cost, f"z{side}{stage}", l1)
                    setattr(ocp.cost, f"Z{side}{stage}", l2)

    def _release(self, constraints: Any) -> None:
        """Lift constraints at stages where no free input can influence them."""
        imposed = Transcription(self.problem).imposed
        for i in range(1, self.problem.horizon + 1):
            if self._nonlinear:
                upper = np.where(imposed[i - 1, self._nonlinear], 0.0, self._infinity)
                self._solver.constraints_set(i, "uh", upper)
            if self._bounded:
                free = np.array([imposed[i - 1, rows].any() for rows in self._bounded.values()])
                self._solver.constraints_set(i, "lbx", np.where(free, constraints.lbx, -self._infinity))
                self._solver.constraints_set(i, "ubx", np.where(free, constraints.ubx, self._infinity))

    def _limits(self, values: Array) -> Array:
        return np.clip(values, -self._infinity, self._infinity)
