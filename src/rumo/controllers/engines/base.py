"""What computes the steps of a controller: the seam between what users call and how it is done."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from rumo.controllers.arguments import ReferenceWindow
from rumo.controllers.engines.trajectory import Trajectory
from rumo.kernel import SLACK_TOLERANCE
from rumo.plan import DIAGNOSTICS, Plan
from rumo.signals import Array, Values
from rumo.status import Status
from rumo.transcription import Transcription

UNKNOWN: Array = np.full(len(DIAGNOSTICS), np.nan)


class Engine(Protocol):
    """Prepares and computes steps; remembers guess, plan, applied inputs and counts.

    Attributes
    ----------
    backend : str
        What users call it.
    """

    backend: str

    @property
    def applied(self) -> Array:
        """Inputs already decided, oldest first (max(delay, 1), nu)."""
        ...

    @applied.setter
    def applied(self, inputs: Array) -> None: ...

    @property
    def counts(self) -> Counter[Status]:
        """Outcomes of all steps since the last reset."""
        ...

    def configure(self, settings: Any) -> None:
        """Use other settings from the next call on."""
        ...

    def update(self, transcription: Transcription) -> None:
        """Use the numbers of another problem, of the same structure, from the next preparation on."""
        ...

    def reset(self, applied: Array) -> None:
        """Forget everything."""
        ...

    def rest(self, x: Array) -> None:
        """Linearise about this state (nx,) at rest next, with the last input decided."""
        ...

    def start(self, x: Array, u: Array) -> None:
        """Linearise about these states (N + 1, nx) and inputs (N, nu) next."""
        ...

    def prepare(self) -> None:
        """Do all that needs no measurement."""
        ...

    def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
        """The plan for a measurement."""
        ...

    def step(self, x: Values, reference: ReferenceWindow) -> Plan:
        """Both."""
        ...


@dataclass(frozen=True, eq=False)
class Candidate:
    """What a method proposes: a trajectory, path constraints (N, nc), how far the solver got, and its `DIAGNOSTICS`.

    The trajectory is NaN where the method has nothing to propose.
    """

    trajectory: Trajectory
    constraints: Array
    status: Status
    diagnostics: Array = field(default_factory=UNKNOWN.copy)

    @property
    def usable(self) -> bool:
        """Whether it is solved, and every number is finite."""
        return self.status.solved and self.trajectory.finite and bool(np.isfinite(self.constraints).all())


class Method(ABC):
    """How a step is solved, by Python: all that a guarded engine asks for. Only `solve` has no default.

    A method may raise nothing for a numerical reason: what it returns says how far it came.
    """

    transcription: Transcription

    end: float = np.inf
    """When the step has to be over, by `time.perf_counter` [s]; set by the engine where settings have a time limit."""

    @property
    def accuracy(self) -> float:
        """Share of their scales to which hard constraints hold in a solution, where that is above `SLACK_TOLERANCE`."""
        return 0.0

    @property
    def restarts(self) -> bool:
        """Whether `solve` finds a beginning of its own from a state at rest, and is asked for it after a failure."""
        return False

    @property
    def signals(self) -> tuple[str, ...]:
        """Signals whose reference it looks at: the tracked outputs."""
        return self.transcription.problem.outputs.names

    @property
    def weighed(self) -> tuple[str, ...]:
        """Those of them that matter only where the cost has a weight for them."""
        return self.transcription.problem.outputs.names

    def exceeded(self, candidate: Candidate, share: float) -> np.ndarray:
        """Imposed constraints (N, nc) that are above 0 by more than a share of their scales."""
        return (
            candidate.constraints > share * self.transcription.problem.constraint_scales
        ) & self.transcription.imposed

    def broken(self, candidate: Candidate) -> np.ndarray:
        """Hard constraints (N, nc) that are exceeded by more than the method's accuracy allows."""
        hard = np.isinf(self.transcription.problem.numbers.l1)
        return self.exceeded(candidate, max(SLACK_TOLERANCE, self.accuracy)) & hard

    def check(self, window: Mapping[str, Array]) -> None:
        """Raise if a reference, by signal (N + 1,), lacks what `solve` needs; nothing of the step has happened yet."""

    def configure(self, settings: Any) -> None:
        """Use other settings."""

    def update(self, transcription: Transcription) -> None:
        """Use the numbers of another problem of the same structure."""
        self.transcription = transcription

    def reset(self) -> None:
        """Forget everything."""

    def begin_sample(self, surprised: bool) -> None:
        """Be told that a measurement is to be solved for, and whether it is a surprise."""

    def missed(self) -> None:
        """Be told that a step had no solution."""

    def prepare(self, guess: Trajectory, applied: Array) -> float | None:
        """Prepare at a guess; None if the model gives no usable numbers there.

        Parameters
        ----------
        guess : Trajectory
            The last plan, one sample later, or a state at rest.
        applied : ndarray, shape (max(delay, 1), nu)
            Inputs already decided.

        Returns
        -------
        float or None
            How far the guess is from satisfying the dynamics, over the reach of the inputs; 0 where that does not
            matter. The guard drops guesses that stray.
        """
        return 0.0

    def advance(self, x: Array, window: Mapping[str, Array], applied: Array) -> bool:
        """Improve on what is prepared, for a state (nx,) that is expected; False if that ends in no usable numbers.

        The reference is the last one, by signal (N + 1,), and begins one sample before.
        """
        return True

    @abstractmethod
    def solve(self, x: Array, window: Mapping[str, Array], guess: Trajectory, applied: Array) -> Candidate | None:
        """Solve for a finite measurement x (nx,) and reference, by signal (N + 1,); None if nothing came of it."""

    def dependence(self, plan: Trajectory) -> Array:
        """How the state at the end of a plan's first interval depends on that at its beginning.

        Parameters
        ----------
        plan : Trajectory
            The last one.

        Returns
        -------
        ndarray, shape (nx, nx)
            A.

        Raises
        ------
        numpy.linalg.LinAlgError
            If the linearised equations are singular.
        """
        return self.transcription.sensitivity(plan.x[0], plan.u[0], plan.x[1], plan.inner[0])

    def reach(self) -> Array | None:
        """How far all inputs together can move each state over the gate's stages (nx,); None where not known."""
        return None
