"""What a controller step returns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rumo.kernel import SLACK_TOLERANCE
from rumo.problem import Problem
from rumo.signals import Array, NamedArray
from rumo.status import STATUSES, Status


@dataclass(frozen=True)
class Timings:
    """Wall-clock time of one step.

    Attributes
    ----------
    prepare, feedback : float
        Time before and after the measurement was known [s].
    waited : float
        Time of the call that returned the plan [s]: of both where `step` did both, of the feedback alone where
        `prepare` was called before.
    """

    prepare: float
    feedback: float
    waited: float

    @property
    def total(self) -> float:
        """Preparation and feedback together [s]."""
        return self.prepare + self.feedback


@dataclass(frozen=True)
class Violation:
    """A constraint that a plan violates.

    Attributes
    ----------
    constraint : str
        Its name.
    stage : int
        1 to N.
    amount : float
        By how much, in the constraint's unit.
    share : float
        The same over the constraint's scale.
    """

    constraint: str
    stage: int
    amount: float
    share: float

    def __str__(self) -> str:
        return f"{self.constraint} at stage {self.stage}: {100.0 * self.share:.2g} % over"


SYMPTOMS = "held", "leaving", "stuck"
"""As `rumo_symptom` in rumo_core.h counts them."""


@dataclass(frozen=True)
class Symptom:
    """A reading with which something is wrong.

    Attributes
    ----------
    state : str
        Whose.
    size : float
        How far it is from the prediction, in standard deviations of what is usual; infinite if it is no number, or one
        that its sensor cannot show. Of one that is stuck, how many samples repeat it.
    duration : float
        For how long it has been so [s].
    kind : str
        "held": implausible, and not used. Others are used: "leaving" is one that leaves bit by bit what is predicted
        from all before it, as with a drift, or with an actuator that does not do what it is told; "stuck" is one that
        stays as it is, where others change and it always did.
    """

    state: str
    size: float
    duration: float
    kind: str = "held"

    def __str__(self) -> str:
        if self.kind == "stuck":
            return f"measured {self.state} stays as it is, for {self.duration:.3g} s"
        if self.size == np.inf:
            return f"measured {self.state} is no reading, for {self.duration:.3g} s"
        return f"measured {self.state} leaves the prediction by {self.size:.2g} sigma, for {self.duration:.3g} s"


@dataclass(frozen=True)
class Diagnostics:
    """How far a controller that linearises has come; NaN where nothing was solved, or there is nothing to compare with.

    Attributes
    ----------
    integrator_residual : float
        Largest Newton correction of the guess onto the discretised dynamics, of each state over what all inputs' ranges
        can do to it.
    integrated : bool
        Whether that is below the controller's tolerance.
    step : float
        Largest change of a free input from the guess to the plan, over its range.
    contraction : float
        That over the same of the iteration before at this sample: below 1 the iteration converges.
    kkt_residual : float
        What the plan lacks of solving its QP, by the optimality conditions stage by stage and without units: forces
        that nothing balances, over the largest of those on the same input or state; violations of the dynamics, over
        the largest terms of the same state, and of hard limits, over the inputs' ranges.
    command_error : float
        Estimate of how far the command is from the one that iterations to convergence come to, over its range: what
        steps add up to that are still to come, if each is less than half the one before. As much as the plan's step, or
        as a 20th of the one before if that is more: less may be luck. An estimate and no bound; NaN after one
        iteration, or where the contraction is a half or more.
    """

    integrator_residual: float
    integrated: bool
    step: float
    contraction: float
    kkt_residual: float
    command_error: float


DIAGNOSTICS = ("integrator_residual", "step", "contraction", "kkt_residual", "command_error")
"""Those that are numbers, in the order of `rumo_diagnostic` in rumo_core.h."""
INTEGRATOR_TOLERANCE = 0.01


class PlanLayout:
    """Where the parts of a plan lie in its numbers.

    Inputs (N, nu), states (N + 1, nx), path constraints (N, nc), algebraic variables (N, nz), diagnostics (5,).
    """

    def __init__(self, problem: Problem, integrator_tolerance: float = INTEGRATOR_TOLERANCE) -> None:
        self.problem = problem
        self.integrator_tolerance = integrator_tolerance
        N, model = problem.horizon, problem.model
        self.shapes = (
            (N, len(model.inputs)),
            (N + 1, len(model.states)),
            (N, len(problem.constraints)),
            (N, len(model.algebraic)),
            (1, len(DIAGNOSTICS)),
        )
        ends = np.cumsum([rows * columns for rows, columns in self.shapes]).tolist()
        self.parts = [slice(start, end) for start, end in zip([0, *ends], ends, strict=False)]
        self.size = ends[-1]

    def renumbered(self, problem: Problem) -> PlanLayout:
        """The same for a problem that differs in numbers alone."""
        other = object.__new__(type(self))
        vars(other).update(vars(self), problem=problem)
        return other


class Outcome(NamedTuple):
    """What is known of a step besides the numbers of its plan, as the C core says it.

    Attributes
    ----------
    layout : PlanLayout
        Of the problem with the numbers of that step.
    status, cause : int
        Positions in `STATUSES`.
    prepare, feedback, waited : float
        Times [s], see `Timings`.
    iterations : int
        Of the QP solver.
    conflict : list of tuple, or None
        Limits that cannot hold together: (kind, stage, index), see `rumo_conflict` in rumo_core.h.
    health : sequence of float, or None
        For each state how many deviations its reading is off, for how many samples, and which of `SYMPTOMS` it is, from
        1 on; 0 where nothing is wrong.
    rescued : bool
        Whether another controller made the plan.
    """

    layout: PlanLayout
    status: int
    cause: int
    prepare: float
    feedback: float
    waited: float
    iterations: int = 0
    conflict: Sequence[tuple[int, int, int]] | None = None
    health: Sequence[float] | None = None
    rescued: bool = False


class Plan:
    """Inputs and predicted states over the horizon, and what they are worth."""

    __slots__ = ("_layout", "_numbers", "_outcome")

    def __init__(self, numbers: Array, outcome: Outcome) -> None:
        self._layout = outcome[0]  # by position: the core makes plain tuples, which takes a fraction of the time
        self._numbers = numbers
        self._outcome = outcome

    @property
    def status(self) -> Status:
        """Outcome of the step."""
        return STATUSES[self._outcome[1]]

    @property
    def cause(self) -> Status:
        """The same, but when the plan is exhausted: then what kept this step from being solved."""
        return STATUSES[self._outcome[2]]

    @property
    def trusted(self) -> bool:
        """Whether it solves the nonlinear problem as far as a sample's iterations can tell: it is `solved`.

        A linearising controller trusts a first iteration that changes the inputs little, about a guess that satisfies
        the dynamics, or further ones that have settled; see `Settings`. One whose steps are not judged trusts them all.
        """
        return self.status.solved

    @property
    def rescued(self) -> bool:
        """Whether the iteration was not to be trusted, and the nonlinear program's solution is the plan instead."""
        return any(self._outcome[9:])  # the core says nothing of it

    @property
    def iterations(self) -> int:
        """Changes of the QP solver's working set, in the C core; 0 elsewhere."""
        return self._outcome[6]

    @property
    def conflict(self) -> tuple[str, ...]:
        """Where there was no solution: rows that cannot hold together, such as "friction_rear at stage 3".

        Rows that only together cannot hold are named by the C core alone; one that no input moves, by every controller.
        """
        inputs, constraints = self.problem.model.inputs.names, self.problem.constraint_names.names
        kinds = (
            [f"bounds of {name}" for name in inputs],
            [f"move bounds of {name}" for name in inputs],
            constraints,
        )
        return tuple(f"{kinds[kind][index]} at stage {stage}" for kind, stage, index in sorted(self._outcome[7] or ()))

    @property
    def health(self) -> tuple[Symptom, ...]:
        """What is wrong with single readings of the measurement: held back, leaving the prediction, or stuck."""
        problem, found = self.problem, self._outcome[8]
        if not found:
            return ()
        of_each = zip(problem.model.states, found[::3], found[1::3], found[2::3], strict=True)
        return tuple(
            Symptom(name, float(size), float(samples) * problem.sampling_time, SYMPTOMS[int(kind) - 1])
            for name, size, samples, kind in of_each
            if kind
        )

    @property
    def problem(self) -> Problem:
        """What was solved, with the numbers of that step."""
        return self._layout.problem

    @property
    def layout(self) -> PlanLayout:
        """Where its parts lie in `packed()`."""
        return self._layout

    def packed(self) -> Array:
        """A copy of all its numbers (size,), see `PlanLayout`."""
        return self._numbers.copy()

    def _part(self, index: int) -> Array:
        return self._numbers[self._layout.parts[index]].reshape(self._layout.shapes[index])

    @property
    def command(self) -> NamedArray[float]:
        """The input to apply `delay` samples after the measurement (nu,); always finite and within bounds."""
        return NamedArray(self.problem.model.inputs, self._part(0)[self.problem.delay])

    @property
    def u(self) -> NamedArray[Array]:
        """Inputs of the horizon (N, nu); the first `delay` are those already decided, then comes the command."""
        return NamedArray(self.problem.model.inputs, self._part(0))

    @property
    def x(self) -> NamedArray[Array]:
        """Predicted states (N + 1, nx), the measurement first; NaN where nothing was predicted."""
        return NamedArray(self.problem.model.states, self._part(1))

    @property
    def z(self) -> NamedArray[Array]:
        """Predicted algebraic variables at stages 1 to N (N, nz); NaN where nothing was predicted."""
        return NamedArray(self.problem.model.algebraic, self._part(3))

    @property
    def constraints(self) -> NamedArray[Array]:
        """Path constraints at stages 1 to N (N, nc), violated above 0.

        As linearised where the controller linearises; NaN where nothing was solved.
        """
        return NamedArray(self.problem.constraint_names, self._part(2))

    @property
    def slacks(self) -> NamedArray[Array]:
        """Amount by which each path constraint is violated at stages 1 to N (N, nc); NaN where nothing was solved."""
        return NamedArray(self.problem.constraint_names, np.maximum(self._part(2), 0.0))

    @property
    def diagnostics(self) -> Diagnostics:
        """Integrator residual, step, contraction and KKT residual of the last iteration."""
        numbers = dict(zip(DIAGNOSTICS, self._part(4)[0].tolist(), strict=True))
        return Diagnostics(integrated=numbers["integrator_residual"] <= self._layout.integrator_tolerance, **numbers)

    @property
    def timings(self) -> Timings:
        """Wall-clock times."""
        return Timings(*self._outcome[3:6])

    @property
    def violations(self) -> list[Violation]:
        """Violated path constraints, the largest share of its scale first; empty where nothing was solved."""
        problem, slacks = self.problem, self.slacks.values
        shares = slacks / problem.constraint_scales
        found = [
            Violation(problem.constraints[j].name, int(k) + 1, float(slacks[k, j]), float(shares[k, j]))
            for k, j in np.argwhere(shares > SLACK_TOLERANCE)
        ]
        return sorted(found, key=lambda violation: -violation.share)

    def after(self, waited: float, better: Plan | None = None, status: Status | None = None) -> Plan:
        """The same step once all of the time [s] is over that was waited for; with another controller's plan."""
        before = Outcome(*self._outcome)
        outcome = before._replace(feedback=before.feedback + waited - before.waited, waited=waited)
        if better is None or status is None:
            return Plan(self._numbers, outcome)
        rank = STATUSES.index(status)
        return Plan(better._numbers, outcome._replace(status=rank, cause=rank, conflict=None, rescued=True))

    def __repr__(self) -> str:
        return f"Plan({self.status.name}, {', '.join(f'{k}={v:.6g}' for k, v in self.command.as_dict().items())})"
