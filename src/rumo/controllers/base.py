"""What all controllers share: the phases of a step, checks on what comes in, and the failure policy."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_numbers, checked
from rumo.controllers.fallback import Trajectory, admissible
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, CallOrderError, ShapeError, UnknownNameError
from rumo.plan import Plan, Timings
from rumo.problem import Problem
from rumo.signals import Array, NamedArray, Values
from rumo.status import Status
from rumo.transcription import Transcription

ReferenceWindow = Mapping[str, ArrayLike] | ArrayLike


# A constraint counts as violated above this share of its scale.
SLACK_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Candidate:
    """What a solver proposes: a trajectory, slacks (N, nc), and how far the solver got.

    The trajectory is NaN where the solver has nothing to propose.
    """

    trajectory: Trajectory
    slacks: Array
    status: Status


class Controller(ABC):
    """A model predictive controller: `prepare()`, then `feedback(x, reference)`, once each sample.

    Parameters
    ----------
    problem : Problem
        What to solve.
    discretization : Discretization, optional
        Implicit Euler if not given.

    Attributes
    ----------
    status_counts : Counter of Status
        Outcomes of all steps since the last reset.
    """

    name = "controller"

    def __init__(self, problem: Problem, discretization: Discretization | None = None) -> None:
        self.problem = checked(problem, "problem", Problem)
        self.transcription = Transcription(problem, discretization)
        self.status_counts: Counter[Status] = Counter()
        self.reset()

    def reset(self, x: Values | None = None, applied: Mapping[str, float] | ArrayLike | None = None) -> None:
        """Forget everything.

        Parameters
        ----------
        x : mapping or sequence, (nx,), optional
            State to prepare the first step for.
        applied : mapping, or array_like (nu,) or (max(delay, 1), nu), optional
            Inputs already decided; the safe input if not given.
        """
        self._guess: Trajectory | None = None  # where the next step linearises or starts from
        self._previous: Trajectory | None = None  # the last plan, shifted: what is followed without a solution
        self._prepared = False
        self._prepare_time = 0.0
        self._inputs_left = 0
        self.status_counts.clear()
        self.applied = self.problem.safe_input if applied is None else applied
        if x is not None:
            self._start_guess(self.problem.model.states.finite_vector(x, "x"))

    @property
    def applied(self) -> Array:
        """Inputs already decided, shape (max(delay, 1), nu), oldest first.

        Those of the next `delay` intervals or, without delay, the last one applied. Each step appends its
        command; set this where something else was applied.
        """
        return self._applied.copy()

    @applied.setter
    def applied(self, inputs: Mapping[str, float] | ArrayLike) -> None:
        shape = (max(self.problem.delay, 1), len(self.problem.model.inputs))
        named = isinstance(inputs, Mapping)
        array = self.problem.model.inputs.vector(inputs, "applied") if named else as_numbers(inputs, "applied")
        if array.shape not in (shape, shape[1:]):
            raise ShapeError("applied", f"shape {array.shape}", f"shape {shape} or {shape[1:]}")
        if not np.isfinite(array).all():
            raise ArgumentError("applied", f"{array.tolist()}", "finite inputs")
        self._applied = np.broadcast_to(array, shape).copy()

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
        """Return the plan for a measurement.

        Parameters
        ----------
        x : mapping or sequence, (nx,)
            Measured or estimated state.
        reference : mapping of str to float or array_like (N + 1,), or array_like (N + 1, ny)
            Wanted outputs from now to the end of the horizon; a number is held. A mapping may name
            further states and inputs of the model, for controllers that linearise along the reference.

        Raises
        ------
        ShapeError
            If x or the reference has the wrong shape.
        UnknownNameError
            If one of them names a signal that does not exist.
        ArgumentError
            If the reference leaves out a tracked output.
        CallOrderError
            If `prepare()` was not called since the last feedback.
        """
        if not self._prepared:
            raise CallOrderError("feedback() needs a preparation: call prepare() first, or step() for both.")
        start = perf_counter()
        measurement = self.problem.model.states.vector(x, "x")
        window = self._window(reference)
        with np.errstate(all="ignore"):
            candidate, status = self._attempt(measurement, window)
        plan = self._follow(candidate, status, start)
        self._prepared = False
        self.status_counts[plan.status] += 1
        return plan

    @property
    def _reference_signals(self) -> tuple[str, ...]:
        """Signals whose reference this controller looks at."""
        return self.problem.outputs.names

    def _assess(self, trajectory: Trajectory, constraints: Array, status: Status) -> Candidate:
        """A solver's result, its status lowered to SOFT_VIOLATED where imposed constraints (N, nc) exceed 0."""
        slacks = np.maximum(constraints, 0.0)
        violated = slacks > SLACK_TOLERANCE * self.problem.constraint_scales
        if status is Status.OPTIMAL and violated[self.transcription.imposed].any():
            status = Status.SOFT_VIOLATED
        return Candidate(trajectory, slacks, status)

    @abstractmethod
    def _prepare(self, guess: Trajectory) -> bool:
        """Prepare at the guess; False if the model gives no usable numbers there."""

    @abstractmethod
    def _solve(self, x: Array, window: dict[str, Array], guess: Trajectory) -> Candidate | None:
        """Solve for a finite measurement; None if the solver failed."""

    def _attempt(self, x: Array, window: dict[str, Array]) -> tuple[Candidate | None, Status]:
        if not np.isfinite(x).all():
            return None, Status.BAD_MEASUREMENT
        if not all(np.isfinite(values).all() for values in window.values()):
            return None, Status.BAD_REFERENCE
        guess = self._guess
        if guess is None:
            guess = self._start_guess(x)
            if not self._prepare(guess):
                return None, Status.SOLVER_FAILED
        candidate = self._solve(x, window, guess)
        if candidate is None:
            return None, Status.SOLVER_FAILED
        if candidate.trajectory.finite and candidate.status is not Status.SOLVER_FAILED:
            return candidate, candidate.status
        return None, Status.SOLVER_FAILED if candidate.status.solved else candidate.status

    def _follow(self, candidate: Candidate | None, status: Status, start: float) -> Plan:
        """Apply the failure policy: the candidate, else the shifted plan, else the safe input."""
        problem = self.problem
        N, d = problem.horizon, problem.delay
        decided = self._applied[:d]
        cause = status
        slacks = np.full((N, len(problem.constraints)), np.nan)
        states = np.full((N + 1, len(problem.model.states)), np.nan)
        if candidate is not None:
            wanted, states, slacks = candidate.trajectory.u[d:], candidate.trajectory.x, candidate.slacks
            self._inputs_left = N - d - 1
        elif self._previous is not None and self._inputs_left > 0:
            wanted, states = self._previous.u[d:], self._previous.x
            self._inputs_left -= 1
        else:
            wanted = np.tile(problem.safe_input, (N - d, 1))
            status = Status.PLAN_EXHAUSTED
        u = np.vstack([decided, admissible(problem, wanted, self._applied[-1])])
        command = u[d]
        self._applied = np.vstack([self._applied[1:], command])
        # The next guess is this plan one sample later; without a plan, the next measurement gives it.
        self._previous = None if status is Status.PLAN_EXHAUSTED else Trajectory(u, states).shifted()
        # A guess from which the solver came to nothing is not kept: the next measurement gives a new one.
        fruitless = candidate is None and status in (Status.SOLVER_FAILED, Status.BUDGET_EXCEEDED)
        self._guess = None if fruitless else self._previous
        model = problem.model
        return Plan(
            command=NamedArray(model.inputs, command.copy()),
            u=NamedArray(model.inputs, u),
            x=NamedArray(model.states, states),
            slacks=NamedArray(problem.constraint_names, slacks),
            status=status,
            cause=cause,
            timings=Timings(self._prepare_time, perf_counter() - start),
        )

    def _start_guess(self, x: Array) -> Trajectory:
        problem = self.problem
        u = np.clip(self._applied[-1], problem.input_lower, problem.input_upper)
        self._guess = Trajectory.at_rest(x, u, problem.horizon)
        self._prepared = False
        return self._guess

    def _window(self, reference: ReferenceWindow) -> dict[str, Array]:
        """Reference of each named signal over the horizon, (N + 1,)."""
        problem, length = self.problem, self.problem.horizon + 1
        named: Mapping[str, Any]
        if isinstance(reference, Mapping):
            named = reference
            model = problem.model
            allowed = dict.fromkeys((*problem.outputs, *model.states, *model.inputs, *model.outputs))
            for name in named:
                if name not in allowed:
                    raise UnknownNameError("reference", name, allowed)
            for name in problem.outputs:
                if name not in named:
                    raise ArgumentError("reference", f"no values for {name!r}", "values for every tracked output")
        else:
            array = as_numbers(reference, "reference")
            if array.shape != (length, len(problem.outputs)):
                raise ShapeError(
                    "reference", f"shape {array.shape}", f"({length}, {len(problem.outputs)}): N + 1 by tracked outputs"
                )
            named = dict(zip(problem.outputs, array.T, strict=True))
        window, used = {}, self._reference_signals
        for name, values in named.items():
            array = as_numbers(values, f"reference[{name!r}]")
            if array.shape not in ((), (length,)):
                raise ShapeError(
                    f"reference[{name!r}]", f"shape {array.shape}", f"one number or {length}, from now to t + N"
                )
            if name in used:
                window[name] = np.broadcast_to(array, (length,))
        return window

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.problem!r})"
