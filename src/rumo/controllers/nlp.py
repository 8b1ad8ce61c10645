"""The direct NLP: the same discretised problem, solved to convergence by IPOPT."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import positive_number, whole_number
from rumo.controllers.condensing import condense, eliminate
from rumo.controllers.fallback import Trajectory
from rumo.controllers.gate import WIDE_GATE, InnovationGate, gate_stages
from rumo.controllers.policy import UNKNOWN, Candidate, PolicyController
from rumo.discretization import Discretization
from rumo.errors import RumoError
from rumo.problem import Problem
from rumo.signals import Array, Values
from rumo.status import Status

# An iterate that IPOPT could not finish is used if its states are within this share of satisfying the dynamics,
# and hard constraints hold to this.
ADMISSIBLE = 1e-2


@dataclass(frozen=True)
class NlpOptions:
    """Limits and accuracy of IPOPT.

    Parameters
    ----------
    tolerance : float
        IPOPT's `tol`.
    max_iterations : int
        Reaching them is `Status.BUDGET_EXCEEDED`.
    max_wall_time : float
        Time limit per step [s]; reaching it is `Status.BUDGET_EXCEEDED`. A finite limit makes results
        depend on the machine.
    """

    tolerance: float = 1e-8
    max_iterations: int = 200
    max_wall_time: float = np.inf

    def __post_init__(self) -> None:
        positive_number(self.tolerance, "NlpOptions.tolerance")
        whole_number(self.max_iterations, "NlpOptions.max_iterations", 0)
        if self.max_wall_time != np.inf:
            positive_number(self.max_wall_time, "NlpOptions.max_wall_time")


class DirectNlp(PolicyController):
    """Nonlinear MPC by direct transcription and IPOPT (Waechter and Biegler, 2006), the paper's baseline.

    Parameters
    ----------
    problem : Problem
        What to solve.
    discretization : Discretization, optional
        Implicit Euler if not given.
    options : NlpOptions, optional
        Limits and accuracy of IPOPT.
    gate : InnovationGate, optional
        Holds back implausible measurements; None lets all finite ones pass.
    """

    name = "nlp"

    def __init__(
        self,
        problem: Problem,
        discretization: Discretization | None = None,
        *,
        options: NlpOptions | None = None,
        gate: InnovationGate | None = WIDE_GATE,
    ) -> None:
        self._options = options or NlpOptions()
        self._multipliers: tuple[Array, Array] | None = None
        self._first_reach: Array | None = None
        super().__init__(problem, discretization, gate=gate)
        self._build()

    def reset(self, x: Values | None = None, applied: Mapping[str, float] | ArrayLike | None = None) -> None:
        """Forget everything, see `Controller.reset`; the multipliers of the last solution too."""
        super().reset(x, applied)
        self._multipliers = None

    @property
    def options(self) -> NlpOptions:
        """Limits and accuracy of IPOPT; may be set between steps, which states the NLP anew."""
        return self._options

    @options.setter
    def options(self, options: NlpOptions) -> None:
        self._options = options
        self._build()

    def _build(self) -> None:
        """State the NLP of equation (original-nlp), slack variables of soft constraints included."""
        problem, functions = self.problem, self.transcription
        N, d = problem.horizon, problem.delay
        nx, nu = len(problem.model.states), len(problem.model.inputs)
        nw, nz = functions.unknowns, len(problem.model.algebraic)
        x0, w = ca.SX.sym("x0", nx), ca.SX.sym("w", nw, N)
        nb, blocks = len(problem.blocks.lengths), ca.DM(problem.blocks.matrix)
        decided, v = ca.SX.sym("decided", nu, len(self._applied)), ca.SX.sym("v", nu, nb)
        reference = ca.SX.sym("r", len(problem.outputs), N)
        p = ca.SX.sym("p", functions.interval.size1_in(3), N)
        states = ca.horzcat(x0, w[:nx, :])
        values = ca.horzcat(decided[:, -1], v)
        inputs = ca.horzcat(decided[:, :d], values @ blocks.T)
        increments = ca.diff(values, 1, 1)

        soft = [(k, j) for k, j in np.argwhere(functions.imposed) if problem.constraints[j].penalty is not None]
        s = ca.SX.sym("s", len(soft))
        slack_of = {index: s[i] for i, index in enumerate(soft)}
        cost = ca.SX(0)
        equalities, hard = [], []
        for k in range(N):
            equalities.append(functions.interval(w[:, k], states[:, k], inputs[:, k], p[:, k]))
            error = functions.outputs(w[: nx + nz, k], inputs[:, k], p[:, k]) - reference[:, k]
            cost += ca.dot(ca.DM(problem.output_weights[k]), error**2)
            rows = functions.constraints(w[: nx + nz, k], inputs[:, k], p[:, k])
            hard += [rows[int(j)] - slack_of.get((k, j), 0.0) for j in np.flatnonzero(functions.imposed[k])]
        cost += ca.sum1(ca.vec(ca.DM(problem.block_move_weights.T) * increments**2))
        for i, (_, j) in enumerate(soft):
            penalty = problem.constraints[j].penalty
            assert penalty is not None
            cost += penalty.l1 * s[i] + penalty.l2 * s[i] ** 2

        limited = np.flatnonzero(np.isfinite(problem.move_lower) | np.isfinite(problem.move_upper))
        moves = ca.vec(increments[limited.tolist(), :])
        constraints = ca.vertcat(*equalities, *hard, moves)
        move_lower, move_upper = (bound[:, limited].ravel() for bound in problem.block_move_bounds)
        self._lower = np.r_[np.full(N * nw, -np.inf), np.tile(problem.input_lower, nb), np.zeros(len(soft))]
        self._upper = np.r_[np.full(N * nw, np.inf), np.tile(problem.input_upper, nb), np.full(len(soft), np.inf)]
        self._g_lower = np.r_[np.zeros(N * nw), np.full(len(hard), -np.inf), move_lower]
        self._g_upper = np.r_[np.zeros(N * nw + len(hard)), move_upper]
        statement = {
            "x": ca.vertcat(ca.vec(w), ca.vec(v), s),
            "p": ca.vertcat(x0, ca.vec(decided), ca.vec(reference), ca.vec(p)),
            "f": cost / problem.cost_scale,
            "g": constraints,
        }
        self._solver = ca.nlpsol("direct_nlp", "ipopt", statement, self._ipopt_options())

    def _ipopt_options(self) -> dict[str, Any]:
        ipopt: dict[str, Any] = {
            "print_level": 0,
            "sb": "yes",
            "tol": self.options.tolerance,
            "max_iter": self.options.max_iterations,
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
        if np.isfinite(self.options.max_wall_time):
            ipopt["max_wall_time"] = self.options.max_wall_time
        return {
            "ipopt": ipopt,
            "print_time": False,
            "expand": True,
            "error_on_fail": False,
            "show_eval_warnings": False,
        }

    def _prepare(self, guess: Trajectory) -> bool:
        if guess.resting:  # once after a reset, for the gate; otherwise the guess is all there is
            try:
                linearised = self.transcription.linearize(guess.x, guess.u, guess.inner, self._parameters)
                condensed = condense(linearised, self.problem, self.transcription.imposed)
                self._first_reach = condensed.reach_until(gate_stages(self.problem))
            except np.linalg.LinAlgError:
                self._first_reach = None
        return guess.finite

    def _reach(self) -> Array | None:
        return self._first_reach

    def _solve(self, x: Array, window: dict[str, Array], guess: Trajectory) -> Candidate | None:
        problem = self.problem
        N, d = problem.horizon, problem.delay
        nx, nw = len(problem.model.states), self.transcription.unknowns
        reference = np.column_stack([window[name][1:] for name in problem.outputs])
        values = problem.blocks.values(guess.u[d:])
        slack = np.zeros(len(self._lower) - N * nw - values.size)
        parameters = self.transcription.given(self._parameters)
        lam_x, lam_g = self._multipliers or (np.zeros(len(self._lower)), np.zeros(len(self._g_lower)))
        try:
            result = self._solver(
                x0=np.r_[np.hstack([guess.x[1:], guess.inner]).ravel(), values.ravel(), slack],
                p=np.r_[x, self._applied.ravel(), reference.ravel(), parameters.ravel()],
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
        u = np.vstack([self._applied[:d], problem.blocks.matrix @ np.vstack([self._applied[-1], values])])
        trajectory = Trajectory(u, np.vstack([x, w[:, :nx]]), w[:, nx:])
        stats = self._solver.stats()
        out_of_budget = stats["return_status"] in ("Maximum_Iterations_Exceeded", "Maximum_WallTime_Exceeded")
        if not stats["success"] and not out_of_budget:
            self._multipliers = None
            return None
        status = Status.BUDGET_EXCEEDED if out_of_budget else Status.OPTIMAL
        excess = np.maximum(self._g_lower - g, g - self._g_upper)[N * nw :]
        if out_of_budget and not self._admissible(trajectory, excess):
            self._multipliers = None
            unknown = replace(trajectory, u=np.full_like(u, np.nan))
            return Candidate(unknown, np.full((N, len(problem.constraints)), np.nan), status, UNKNOWN)
        self._multipliers = result["lam_x"].full().ravel(), result["lam_g"].full().ravel()
        constraints = self.transcription.path_constraints(trajectory.x, u, trajectory.inner, self._parameters)
        return self._assess(trajectory, constraints, status)

    def _admissible(self, trajectory: Trajectory, excess: Array) -> bool:
        """Whether an unfinished iterate, which exceeds constraints and move bounds by `excess`, may be used.

        The residual of a stiff stage is huge long after its state is right: what counts is the Newton step it asks for.
        """
        if not trajectory.finite or np.max(excess, initial=0.0) > ADMISSIBLE:
            return False
        try:
            stages = self.transcription.linearize(trajectory.x, trajectory.u, trajectory.inner, self._parameters)
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
