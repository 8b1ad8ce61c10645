"""The phases of a step and the failure policy, for controllers in Python; the C core has its own."""

from __future__ import annotations

from abc import abstractmethod
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike

from rumo.controllers.base import Controller, ReferenceWindow
from rumo.controllers.fallback import Shift, Trajectory, admissible
from rumo.controllers.gate import WIDE_GATE, Gatekeeper, InnovationGate, gate_stages
from rumo.discretization import Discretization
from rumo.errors import CallOrderError
from rumo.plan import DIAGNOSTICS, SLACK_TOLERANCE, Plan
from rumo.problem import Problem
from rumo.signals import Array, Values
from rumo.status import Status

UNKNOWN: Array = np.full(len(DIAGNOSTICS), np.nan)


@dataclass(frozen=True)
class Candidate:
    """What a solver proposes: a trajectory, path constraints (N, nc), how far the solver got, and its `DIAGNOSTICS`.

    The trajectory is NaN where the solver has nothing to propose.
    """

    trajectory: Trajectory
    constraints: Array
    status: Status
    diagnostics: Array


class PolicyController(Controller):
    """A controller that proposes a trajectory; what is applied, whatever happens, is decided here."""

    def __init__(
        self,
        problem: Problem,
        discretization: Discretization | None = None,
        *,
        gate: InnovationGate | None = WIDE_GATE,
    ) -> None:
        super().__init__(problem, discretization, gate=gate)
        self._counts: Counter[Status] = Counter()
        self._shift = Shift(self.transcription)
        self.reset()

    def reset(self, x: Values | None = None, applied: Mapping[str, float] | ArrayLike | None = None) -> None:
        """Forget everything, see `Controller.reset`."""
        self._guess: Trajectory | None = None  # where the next step linearises or starts from
        self._previous: Trajectory | None = None  # the last plan, shifted: what is followed without a solution
        self._prepared = False
        self._prepare_time = 0.0
        self._inputs_left = 0
        self._blameless = False
        self._counts.clear()
        self._gatekeeper = Gatekeeper(self.gate)
        self._applied = self._decided(applied)
        self._parameters = self.problem.parameters
        if x is not None:
            self._start_guess(self.problem.model.states.finite_vector(x, "x"))

    @property
    def applied(self) -> Array:
        """Inputs already decided, see `Controller.applied`."""
        return self._applied.copy()

    @applied.setter
    def applied(self, inputs: Mapping[str, float] | ArrayLike) -> None:
        self._applied = self._decided(inputs)

    def _take_parameters(self) -> None:
        self._prepared = False

    @property
    def status_counts(self) -> Counter[Status]:
        """Outcomes of all steps since the last reset."""
        return self._counts

    def step(self, x: Values, reference: ReferenceWindow) -> Plan:
        """`prepare()` and `feedback(x, reference)` in one call."""
        measurement = self.problem.model.states.vector(x, "x")
        if self._guess is None and np.isfinite(measurement).all():
            self._start_guess(measurement)
        if not self._prepared:
            self.prepare()
        return self.feedback(measurement, reference)

    def prepare(self) -> None:
        """Do all that needs no measurement. Before the first step there is nothing to do."""
        start = perf_counter()
        if self._guess is not None:
            with np.errstate(all="ignore"):
                if not self._prepare(self._guess):
                    self._guess = None
        self._prepared = True
        self._prepare_time = perf_counter() - start

    def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
        """Return the plan for a measurement, see `Controller.feedback`."""
        if not self._prepared:
            raise CallOrderError("feedback() needs a preparation: call prepare() first, or step() for both.")
        start = perf_counter()
        measurement = self.problem.model.states.vector(x, "x")
        window = self._window(reference)
        with np.errstate(all="ignore"):
            candidate, status = self._attempt(measurement, window)
        plan = self._follow(candidate, status, start)
        self._prepared = False
        self._counts[plan.status] += 1
        return plan

    def _assess(
        self, trajectory: Trajectory, constraints: Array, status: Status, diagnostics: Array = UNKNOWN
    ) -> Candidate:
        """A solver's result, its status lowered to SOFT_VIOLATED where imposed constraints (N, nc) exceed 0."""
        violated = constraints > SLACK_TOLERANCE * self.problem.constraint_scales
        if status is Status.OPTIMAL and violated[self.transcription.imposed].any():
            status = Status.SOFT_VIOLATED
        return Candidate(trajectory, constraints, status, diagnostics)

    @abstractmethod
    def _prepare(self, guess: Trajectory) -> bool:
        """Prepare at the guess; False if the model gives no usable numbers there."""

    @abstractmethod
    def _solve(self, x: Array, window: dict[str, Array], guess: Trajectory) -> Candidate | None:
        """Solve for a finite measurement; None if the solver failed."""

    def _reach(self) -> Array | None:
        """How far all inputs together can move each state over the gate's stages (nx,); None where not known."""
        return None

    def _attempt(self, x: Array, window: dict[str, Array]) -> tuple[Candidate | None, Status]:
        if not np.isfinite(x).all():
            return None, Status.BAD_MEASUREMENT
        if not all(np.isfinite(values).all() for values in window.values()):
            return None, Status.BAD_REFERENCE
        predicted = None if self._previous is None else self._previous.x[: gate_stages(self.problem) + 1]
        if not self._gatekeeper.admits(x, predicted, self._reach()):
            return None, Status.BAD_MEASUREMENT
        if self._gatekeeper.surprised:  # what was predicted is wrong
            self._guess = None
        guess = self._guess
        if guess is None:
            guess = self._start_guess(x)
            if not self._prepare(guess):
                return None, Status.SOLVER_FAILED
        candidate = self._solve(x, window, guess)
        if candidate is None:
            return None, Status.SOLVER_FAILED
        finite = candidate.trajectory.finite and bool(np.isfinite(candidate.constraints).all())
        if finite and candidate.status is not Status.SOLVER_FAILED:
            return candidate, candidate.status
        return None, Status.SOLVER_FAILED if candidate.status.solved else candidate.status

    def _follow(self, candidate: Candidate | None, status: Status, start: float) -> Plan:
        """Apply the failure policy: the candidate, else the shifted plan, else the safe input."""
        problem = self.problem
        N, d = problem.horizon, problem.delay
        decided = self._applied[:d]
        cause = status
        constraints, diagnostics = np.full((N, len(problem.constraints)), np.nan), UNKNOWN
        states = np.full((N + 1, len(problem.model.states)), np.nan)
        inner = np.full((N, len(self.transcription.inner_signals)), np.nan)
        if candidate is not None:
            wanted, states, inner = candidate.trajectory.u[d:], candidate.trajectory.x, candidate.trajectory.inner
            constraints, diagnostics = candidate.constraints, candidate.diagnostics
            self._inputs_left = N - d - 1
        elif self._previous is not None and self._inputs_left > 0:
            wanted, states, inner = self._previous.u[d:], self._previous.x, self._previous.inner
            self._inputs_left -= 1
        else:
            wanted = np.tile(problem.safe_input, (N - d, 1))
            status = Status.PLAN_EXHAUSTED
        u = np.vstack([decided, admissible(problem, wanted, self._applied[-1])])
        command = u[d]
        self._applied = np.vstack([self._applied[1:], command])
        # The next guess is this plan one sample later; without a plan, the next measurement gives it.
        exhausted = status is Status.PLAN_EXHAUSTED
        self._previous = None if exhausted else Trajectory(u, states, inner).shifted(self._shift)
        # A guess from which the solver came to nothing is not kept: the next measurement gives a new one, at rest. If
        # that fails too, the shifted plan is the better guess, until there is a solution.
        fruitless = candidate is None and cause in (Status.SOLVER_FAILED, Status.BUDGET_EXCEEDED)
        at_rest = self._guess is not None and self._guess.resting
        self._blameless = candidate is None and (self._blameless or (fruitless and at_rest))
        self._guess = None if fruitless and not self._blameless else self._previous
        algebraic = inner[:, : len(problem.model.algebraic)]
        numbers = np.concatenate([part.ravel() for part in (u, states, constraints, algebraic, diagnostics)])
        return Plan(self._layout, numbers, status, cause, self._prepare_time, perf_counter() - start)

    def _start_guess(self, x: Array) -> Trajectory:
        problem = self.problem
        u = np.clip(self._applied[-1], problem.input_lower, problem.input_upper)
        self._guess = Trajectory.at_rest(x, u, self.transcription.inner_between(x, x), problem.horizon)
        self._prepared = False
        return self._guess
