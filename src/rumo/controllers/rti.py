"""The real-time iteration: one linearisation and one QP per sample."""

from __future__ import annotations

import inspect
import logging
import os
from typing import TYPE_CHECKING, Any

from rumo.checks import non_negative_number, whole_number
from rumo.controllers.base import Controller, ReferenceWindow
from rumo.controllers.gate import WIDE_GATE, InnovationGate
from rumo.controllers.qp import QpOptions
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, UnknownNameError
from rumo.plan import INTEGRATOR_TOLERANCE
from rumo.problem import Problem
from rumo.recording import missing_operation

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Mapping

    from numpy.typing import ArrayLike

    from rumo.plan import Plan
    from rumo.signals import Array, Values
    from rumo.status import Status

BACKENDS = ("auto", "tailored", "portable", "reference")

logger = logging.getLogger("rumo")


class RealTimeIteration(Controller):
    """Real-time iteration on an implicit discretisation (Diehl, 2001; Wagner and Normey-Rico).

    Parameters
    ----------
    problem : Problem
        What to solve.
    discretization : Discretization, optional
        Implicit Euler if not given.
    sqp_iterations : int
        Linearisations and QPs per step; 1 is the real-time iteration, more is sequential quadratic
        programming with full steps.
    preparation_iterations : int
        Iterations in each preparation, on the state predicted for the next sample and with the reference of the last:
        the advanced-step real-time iteration (Nurkanovic et al., 2019). Feedback takes no longer for them.
    tolerance : float
        With more than one iteration, stop when no input changes by more than this share of its range, and no state by
        more than this share of how far the inputs can move it.
    integrator_tolerance : float
        Up to which integrator residual `plan.diagnostics` says that the dynamics are integrated.
    qp : QpOptions, optional
        Limits and accuracy of the QP solver.
    gate : InnovationGate, optional
        Holds back implausible measurements; None lets all finite ones pass.
    backend : str
        What computes the steps: "tailored", the C core compiled for this problem on first use and kept in the user's
        cache; "portable", the C core as installed; "reference", NumPy, some hundred times slower. "auto" takes the
        first that works, or what the environment variable RUMO_BACKEND says. Without a working compiler, "tailored" is
        "portable", and the logger "rumo" says why.

    Attributes
    ----------
    backend : str
        The one in use.
    """

    name = "rti"
    _backend: str

    def __new__(cls, *arguments: Any, **options: Any) -> RealTimeIteration:
        """Choose the class that implements a backend."""
        if cls is not RealTimeIteration:
            return super().__new__(cls)
        from rumo.controllers.compiled import CompiledRti
        from rumo.controllers.reference import ReferenceRti

        chosen = requested(options.get("backend", "auto"))
        problem = arguments[0] if arguments else options.get("problem")
        missing = missing_operation(problem) if isinstance(problem, Problem) and chosen != "reference" else None
        if isinstance(problem, Problem) and missing is not None:
            message = f"The C core lacks the operation {missing}, which {problem.model.name} uses."
            if chosen != "auto":
                raise ArgumentError("backend", repr(chosen), '"auto" or "reference" for this model', message)
            logger.warning("%s The slow reference backend is used.", message)
        implementation = ReferenceRti if chosen == "reference" or missing is not None else CompiledRti
        return object.__new__(implementation)

    def __init__(
        self,
        problem: Problem,
        discretization: Discretization | None = None,
        *,
        sqp_iterations: int = 1,
        preparation_iterations: int = 0,
        tolerance: float = 1e-9,
        integrator_tolerance: float = INTEGRATOR_TOLERANCE,
        qp: QpOptions | None = None,
        gate: InnovationGate | None = WIDE_GATE,
        backend: str = "auto",
    ) -> None:
        self._requested = requested(backend)
        self.sqp_iterations = whole_number(sqp_iterations, "sqp_iterations", 1)
        self.preparation_iterations = whole_number(preparation_iterations, "preparation_iterations", 0)
        self.tolerance = non_negative_number(tolerance, "tolerance")
        self.qp = qp or QpOptions()
        super().__init__(problem, discretization, gate=gate)
        self._layout.integrator_tolerance = non_negative_number(integrator_tolerance, "integrator_tolerance")

    # What users see is how to make one, not how a class is chosen.
    __signature__ = inspect.Signature(list(inspect.signature(__init__).parameters.values())[1:])

    @property
    def backend(self) -> str:
        """What computes the steps."""
        return self._backend

    if TYPE_CHECKING:
        # A type checker does not see that making one makes one of a class that has all these.
        def reset(self, x: Values | None = None, applied: Mapping[str, float] | ArrayLike | None = None) -> None:
            """See `Controller.reset`."""
            ...

        @property
        def applied(self) -> Array:
            """See `Controller.applied`."""
            ...

        @applied.setter
        def applied(self, inputs: Mapping[str, float] | ArrayLike) -> None:
            """See `Controller.applied`."""
            ...

        def _take_parameters(self) -> None: ...

        @property
        def status_counts(self) -> Counter[Status]:
            """See `Controller.status_counts`."""
            ...

        def step(self, x: Values, reference: ReferenceWindow) -> Plan:
            """See `Controller.step`."""
            ...

        def prepare(self) -> None:
            """See `Controller.prepare`."""
            ...

        def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
            """See `Controller.feedback`."""
            ...


def requested(backend: str) -> str:
    """The backend asked for, here or by the environment."""
    if backend not in BACKENDS:
        raise UnknownNameError("backend", backend, BACKENDS)
    if backend == "auto":
        backend = os.environ.get("RUMO_BACKEND", "auto")
        if backend not in BACKENDS:
            raise UnknownNameError("RUMO_BACKEND", backend, BACKENDS, "Correct the environment variable, or unset it.")
    return backend
