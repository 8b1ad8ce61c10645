"""The same discretised problem as one nonlinear program, solved to convergence by IPOPT."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from time import perf_counter
from typing import Any

import casadi as ca
import numpy as np

from rumo.controllers.arguments import tracked
from rumo.controllers.engines.base import Candidate, Method
from rumo.controllers.engines.deadline import Deadline
from rumo.controllers.engines.polish import Polish
from rumo.controllers.engines.reach import near_reach
from rumo.controllers.engines.stagewise import eliminate
from rumo.controllers.engines.trajectory import Trajectory
from rumo.controllers.settings import NlpSettings
from rumo.errors import ArgumentError, RumoError
from rumo.signals import Array
from rumo.status import Status
from rumo.transcription import Transcription

ADMISSIBLE = 1e-2
"""An iterate that IPOPT could not finish is used if its states are within this share of satisfying the dynamics, and
hard constraints hold to this."""


OUT_OF_BUDGET = ("Maximum_Iterations_Exceeded", "Maximum_WallTime_Exceeded", "User_Requested_Stop")
"""What IPOPT says then; the last where the `Deadline` is over."""


class Ipopt(Method):
    """Direct transcription and IPOPT (Waechter and Biegler, 2006), warm-started from the plan before.

    One that is `timed` looks at `end` after each iteration.
    """

    def __init__(self, transcription: Transcription, settings: NlpSettings, *, timed: bool = False) -> None:
        self._timed, self._deadline = timed, None
        self.transcription = transcription
        self.settings = settings
        self._polish = Polish(transcription)
        self.reset()
        self._state()
        self._take_numbers()

    @property
    def accuracy(self) -> float:
        """See `Method.accuracy`."""
        return self.settings.tolerance

    def configure(self, settings: NlpSettings) -> None:
        """See `Method.configure`; other limits of IPOPT state the NLP anew."""
        before, self.settings = self.settings, settings
        if replace(settings, gate=before.gate) == before:
            return
        try:
            self._state()
        except RuntimeError as error:  # CasADi: IPOPT does not take one of them
            self.settings = before
            raise ArgumentError("settings", repr(settings), "limits that IPOPT takes", str(error)[-200:]) from None

    def update(self, transcription: Transcription) -> None:
        """See `Method.update`; numbers are parameters and limits of the NLP, which rows are soft is part of it."""
        self.transcription = transcription
        self._polish.update(transcription)
        if self._structure() != self._stated:
            self._multipliers = None
            self._state()
        self._take_numbers()

    def reset(self) -> None:
        """See `Method.reset`; the multipliers of the last solution too."""
        self._multipliers: tuple[Array, Array] | None = None
        self._reach: Array | None = None

    def reach(self) -> Array | None:
        """See `Method.reach`; at the guess prepared."""
        return self._reach

    def _state(self) -> None:
        """State the NLP of equation (original-nlp), slack variables of soft constraints included."""
        problem, functions = self.transcription.problem, self.transcription
        N, d = problem.horizon, problem.delay
        nx, nu = len(problem.model.states), len(problem.model.inputs)
        nw, nz = functions.unknowns, len(problem.model.algebraic)
        x0, w = ca.SX.sym("x0", nx), ca.SX.sym("w", nw, N)
        nb, blocks = len(problem.blocks.lengths), ca.DM(problem.blocks.matrix)
        decided, v = ca.SX.sym("decided", nu, max(d, 1)), ca.SX.sym("v", nu, nb)
        reference = ca.SX.sym("r", len(problem.outputs), N)
        p = ca.SX.sym("p", functions.interval.size1_in(3), N)
        states = ca.horzcat(x0, w[:nx, :])
        values = ca.horzcat(decided[:, -1], v)
        inputs = ca.horzcat(decided[:, :d], values @ blocks.T)
        increments = ca.diff(values, 1, 1)
        Q, R = ca.SX.sym("Q", len(problem.outputs), N), ca.SX.sym("R", nu, nb)
        limits = ca.SX.sym("limits", len(problem.constraints), N)
        self._stated = soft, limited = self._structure()
        per_unit = ca.SX.sym("per_unit")
        s, l1, l2 = (ca.SX.sym(name, len(soft)) for name in ("s", "l1", "l2"))
        slack_of: dict[tuple[int, int], Any] = {index: s[i] for i, index in enumerate(soft)}
        cost = ca.SX(0)
        equalities, hard = [], []
        for k in range(N):
            equalities.append(functions.interval(w[:, k], states[:, k], inputs[:, k], p[:, k]))
            error = functions.outputs(w[: nx + nz, k], inputs[:, k], p[:, k]) - reference[:, k]
            cost += ca.dot(Q[:, k], error**2)
            rows = functions.constraints(w[: nx + nz, k], inputs[:, k], p[:, k]) - limits[:, k]
            hard += [rows[j] - slack_of.get((k, j), 0.0) for j in np.flatnonzero(functions.imposed[k]).tolist()]
        cost += ca.sum1(ca.vec(R * increments**2))
        for i in range(len(soft)):
            cost += l1[i] * s[i] + l2[i] * s[i] ** 2
        moves = ca.vec(increments[list(limited), :])
        statement = {
            "x": ca.vertcat(ca.vec(w), ca.vec(v), s),
            "p": ca.vertcat(x0, *map(ca.vec, (decided, reference, p, Q, R, limits)), l1, l2, per_unit),
            "f": cost * per_unit,
            "g": ca.vertcat(*equalities, *hard, moves),
        }
        options = self._ipopt_options()
        if self._timed:
            sizes = {name: statement[name].numel() for name in ("x", "g", "p")}
            self._deadline = Deadline(sizes | {"f": 1} | {f"lam_{name}": size for name, size in sizes.items()})
            options["iteration_callback"] = self._deadline
        self._solver = ca.nlpsol("direct_nlp", "ipopt", statement, options)

    def _structure(self) -> tuple[list[tuple[int, int]], list[int]]:
        """Constraints that are soft, as (stage, constraint), and inputs whose moves are limited."""
        problem, imposed = self.transcription.problem, self.transcription.imposed
        soft = [(int(k), int(j)) for k, j in np.argwhere(imposed) if problem.constraints[j].penalty is not None]
        limited = np.flatnonzero(np.isfinite(problem.move_lower) | np.isfinite(problem.move_upper))
        return soft, limited.tolist()

    def _take_numbers(self) -> None:
        """Weights and penalties as parameters of the NLP; limits of its variables and rows."""
        problem, functions = self.transcription.problem, self.transcription
        soft, limited = self._stated
        penalties = [penalty for _, j in soft if (penalty := problem.constraints[j].penalty) is not None]
        prices = [penalty.l1 for penalty in penalties] + [penalty.l2 for penalty in penalties]
        weights = problem.output_weights, problem.block_move_weights, problem.numbers.limits
        # IPOPT's tolerance is absolute: the cost has the largest weight for its unit.
        self._numbers = np.r_[*(weight.ravel() for weight in weights), prices, 1.0 / problem.cost_scale]
        self._steep = any(penalty.l1 > problem.cost_scale for penalty in penalties)  # see Polish
        states, (lower, upper) = problem.horizon * functions.unknowns, problem.block_bounds
        move_lower, move_upper = (bound[:, limited].ravel() for bound in problem.block_move_bounds)
        rows = int(functions.imposed.sum())
        self._lower = np.r_[np.full(states, -np.inf), lower.ravel(), np.zeros(len(soft))]
        self._upper = np.r_[np.full(states, np.inf), upper.ravel(), np.full(len(soft), np.inf)]
        self._g_lower = np.r_[np.zeros(states), np.full(rows, -np.inf), move_lower]
        self._g_upper = np.r_[np.zeros(states + rows), move_upper]

    def _ipopt_options(self) -> dict[str, Any]:
        ipopt: dict[str, Any] = {
            "print_level": 0,
            "sb": "yes",
            "tol": self.settings.tolerance,
            "max_iter": self.settings.max_iterations,
            "linear_solver": linear_solver(),
            "warm_start_init_point": "yes",
            "warm_start_bound_push": 1e-6,
            "warm_start_mult_bound_push": 1e-6,
            "warm_start_slack_bound_push": 1e-6,
            # A third of the iterations of a monotone barrier from a warm start, a ninth from a cold one.
            "mu_strategy": "adaptive",
            "adaptive_mu_globalization": "kkt-error",
            # The rows of stiff states are thousands of times larger than others; IPOPT's own limit of 100 leaves one
            # cold start in five unsolved, 1 none.
            "nlp_scaling_max_gradient": 1.0,
            # Bounds are limits of actuators: do not relax them.
            "bound_relax_factor": 0.0,
        }
        if np.isfinite(self.settings.max_wall_time):
            ipopt["max_wall_time"] = self.settings.max_wall_time
        return {
            "ipopt": ipopt,
            "print_time": False,
            "expand": True,
            "error_on_fail": False,
            "show_eval_warnings": False,
        }

    def prepare(self, guess: Trajectory, applied: Array) -> float | None:
        """See `Method.prepare`; the guess is all that IPOPT needs, and the reach there all that the gate does."""
        problem, nx = self.transcription.problem, guess.x.shape[1]
        try:
            A, B, _ = eliminate(self.transcription.linearize(guess.x, guess.u, guess.inner, problem.parameters))
            reached = near_reach(A[:, :nx], B[:, :nx], problem)
            self._reach = reached if np.isfinite(reached).all() else None
        except np.linalg.LinAlgError:
            self._reach = None
        return 0.0 if guess.finite else None

    def solve(self, x: Array, window: Mapping[str, Array], guess: Trajectory, applied: Array) -> Candidate | None:
        """See `Method.solve`."""
        problem, end = self.transcription.problem, min(perf_counter() + self.settings.max_wall_time, self.end)
        if self._deadline is not None:
            self._deadline.end = end
        N, d = problem.horizon, problem.delay
        nx, nw = len(problem.model.states), self.transcription.unknowns
        reference = tracked(problem, window)[1:]
        values = problem.blocks.values(guess.u[d:])
        slack = np.zeros(len(self._lower) - N * nw - values.size)
        parameters = self.transcription.given(problem.parameters)
        lam_x, lam_g = self._multipliers or (np.zeros(len(self._lower)), np.zeros(len(self._g_lower)))
        try:
            result = self._solver(
                x0=np.r_[np.hstack([guess.x[1:], guess.inner]).ravel(), values.ravel(), slack],
                p=np.r_[x, applied.ravel(), reference.ravel(), parameters.ravel(), self._numbers],
                lbx=self._lower,
                ubx=self._upper,
                lbg=self._g_lower,
                ubg=self._g_upper,
                lam_x0=lam_x,
                lam_g0=lam_g,
            )
        except RuntimeError:  # CasADi: an evaluation failed inside IPOPT
            self._multipliers = None
            return None
        solution, g = result["x"].full().ravel(), result["g"].full().ravel()
        w = solution[: N * nw].reshape(N, nw)
        values = solution[N * nw :][: values.size].reshape(values.shape)
        u = np.vstack([applied[:d], problem.blocks.matrix @ np.vstack([applied[-1], values])])
        trajectory = Trajectory(u, np.vstack([x, w[:, :nx]]), w[:, nx:])
        stats = self._solver.stats()
        out_of_budget = stats["return_status"] in OUT_OF_BUDGET
        if not stats["success"] and not out_of_budget:
            self._multipliers = None
            return None
        status = Status.BUDGET_EXCEEDED if out_of_budget else Status.OPTIMAL
        excess = np.maximum(self._g_lower - g, g - self._g_upper)[N * nw :]
        if out_of_budget and not self._admissible(trajectory, excess):
            self._multipliers = None
            unknown = replace(trajectory, u=np.full_like(u, np.nan))
            return Candidate(unknown, np.full((N, len(problem.constraints)), np.nan), status)
        self._multipliers = result["lam_x"].full().ravel(), result["lam_g"].full().ravel()
        if not out_of_budget and self._steep:
            trajectory, status = self._polish(trajectory, x, window, applied, end)
        constraints = self.transcription.path_constraints(
            trajectory.x, trajectory.u, trajectory.inner, problem.parameters
        )
        return Candidate(trajectory, constraints, status)

    def _admissible(self, trajectory: Trajectory, excess: Array) -> bool:
        """Whether an unfinished iterate, which exceeds constraints and move bounds by `excess`, may be used.

        The residual of a stiff stage is huge long after its state is right: what counts is the Newton step it asks for.
        """
        if not trajectory.finite or np.max(excess, initial=0.0) > ADMISSIBLE:
            return False
        problem = self.transcription.problem
        try:
            stages = self.transcription.linearize(trajectory.x, trajectory.u, trajectory.inner, problem.parameters)
            _, _, correction = eliminate(stages)
        except np.linalg.LinAlgError:
            return False
        unknowns = np.hstack([trajectory.x[1:], trajectory.inner])
        return bool((np.abs(correction) <= ADMISSIBLE * (1.0 + np.abs(unknowns))).all())


@cache
def linear_solver() -> str:
    """MA27 where IPOPT has it, MUMPS otherwise; solving once loads it, so that no step has to."""
    x = ca.SX.sym("x")
    for name in ("ma27", "mumps"):
        options = {"ipopt": {"print_level": 0, "sb": "yes", "linear_solver": name}, "print_time": False}
        solver = ca.nlpsol("probe", "ipopt", {"x": x, "f": (x - 1.0) ** 2}, {**options, "error_on_fail": False})
        solver(x0=0.0)
        if solver.stats()["success"]:
            return name
    raise RumoError("IPOPT as CasADi brings it has neither MA27 nor MUMPS: reinstall casadi.")
