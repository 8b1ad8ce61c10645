"""A problem in acados' words."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from rumo.bench.augmented import augment, constant
from rumo.problem import Problem
from rumo.signals import Array
from rumo.transcription import Transcription


class Statement:
    """What acados is told of a problem, at generation and stage by stage.

    Parameters
    ----------
    problem : Problem
        What to solve.
    infinity : float
        acados' number for no limit.

    Attributes
    ----------
    augmented : Augmented
        The model.
    offset : ndarray, shape (ny,)
        What outputs that are affine are without states; 0 otherwise.
    nonlinear : list of int
        Constraints of the problem that are no simple bounds.

    Notes
    -----
    The state is augmented by inputs already decided, and the control of stage i is the input `u_{i+d}`: delay and moves
    are in the dynamics, the inputs' limits stay simple bounds. The last d controls act beyond the horizon; moving is
    their only cost, so they stay.
    """

    def __init__(self, problem: Problem, infinity: float) -> None:
        self.problem, self._infinity = problem, infinity
        self.augmented = augment(problem)

    def write(self, ocp: Any, integrator: str) -> None:
        """Into an `AcadosOcp`: model, cost and constraints."""
        model, augmented = ocp.model, self.augmented
        model.x, model.u = augmented.x, augmented.u
        if integrator == "DISCRETE":
            model.p, ocp.parameter_values = augmented.guess, np.zeros(augmented.guess.numel())
            model.disc_dyn_expr, model.disc_dyn_custom_jac_ux_expr = augmented.step, augmented.jacobian
        else:
            model.xdot, model.f_impl_expr = augmented.xdot, augmented.residual
        self._set_cost(ocp)
        self._set_constraints(ocp)
        self._constraints = ocp.constraints

    def set_stages(self, solver: Any) -> None:
        """Into an `AcadosOcpSolver`: what differs between stages."""
        for i in range(1, self.problem.horizon):
            solver.cost_set(i, "W", np.diag(np.r_[self._tracking[i - 1], self._moving[i]]))
            interval = min(i, len(self._lower) - 1)  # beyond the horizon, the last
            solver.constraints_set(i, "lbu", self._lower[interval])
            solver.constraints_set(i, "ubu", self._upper[interval])
        self._release(solver)

    def _set_cost(self, ocp: Any) -> None:
        """Linear least squares where the outputs are affine; acados halves the weights."""
        problem, x, u, y = self.problem, self.augmented.x, self.augmented.u, self.augmented.outputs
        linear = not ca.depends_on(ca.jacobian(y, x), x)
        self.offset = constant(ca.substitute(y, x, 0)).ravel() if linear else np.zeros(y.numel())
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
        problem, constraints, x, u = self.problem, ocp.constraints, self.augmented.x, self.augmented.u
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
        self.nonlinear: list[int] = []
        for k, (item, row) in enumerate(zip(problem.constraints, self.augmented.rows, strict=True)):
            gradient = ca.jacobian(row, x)
            if item.penalty is None and gradient.nnz() == 1 and gradient.is_constant():
                slope = constant(gradient).ravel()
                j = int(np.flatnonzero(slope)[0])
                side = bounds.setdefault(j, [-self._infinity, self._infinity])
                side[int(slope[j] > 0.0)] = -float(constant(ca.substitute(row, x, 0)).item()) / slope[j]
                self._bounded.setdefault(j, []).append(k)
            else:
                self.nonlinear.append(k)
        penalties = [problem.constraints[k].penalty for k in self.nonlinear]
        soft = [(i, penalty) for i, penalty in enumerate(penalties) if penalty is not None]
        l1 = np.array([penalty.l1 for _, penalty in soft])
        l2 = np.array([2.0 * penalty.l2 for _, penalty in soft])
        nonlinear = ca.vertcat(*(self.augmented.rows[k] for k in self.nonlinear))
        for stage in ("", "_e"):
            if bounds:
                setattr(constraints, f"idxbx{stage}", np.array(list(bounds)))
                setattr(constraints, f"lbx{stage}", np.array([lower for lower, _ in bounds.values()]))
                setattr(constraints, f"ubx{stage}", np.array([upper for _, upper in bounds.values()]))
            if self.nonlinear:
                setattr(ocp.model, f"con_h_expr{stage}", nonlinear)
                setattr(constraints, f"lh{stage}", np.full(len(self.nonlinear), -self._infinity))
                setattr(constraints, f"uh{stage}", np.zeros(len(self.nonlinear)))
            if soft:
                setattr(constraints, f"idxsh{stage}", np.array([i for i, _ in soft]))
                for side in ("l", "u"):
                    setattr(ocp.cost, f"z{side}{stage}", l1)
                    setattr(ocp.cost, f"Z{side}{stage}", l2)

    def _release(self, solver: Any) -> None:
        """Lift constraints at stages where no free input can influence them."""
        imposed, constraints = Transcription(self.problem).imposed, self._constraints
        for i in range(1, self.problem.horizon + 1):
            if self.nonlinear:
                upper = np.where(imposed[i - 1, self.nonlinear], 0.0, self._infinity)
                solver.constraints_set(i, "uh", upper)
            if self._bounded:
                free = np.array([imposed[i - 1, rows].any() for rows in self._bounded.values()])
                solver.constraints_set(i, "lbx", np.where(free, constraints.lbx, -self._infinity))
                solver.constraints_set(i, "ubx", np.where(free, constraints.ubx, self._infinity))

    def _limits(self, values: Array) -> Array:
        return np.clip(values, -self._infinity, self._infinity)
