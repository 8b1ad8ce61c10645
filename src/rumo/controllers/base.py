"""What all controllers share: their interface, and checks on what comes in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, as_numbers, checked
from rumo.controllers.explanation import Explanation, explain, local_error
from rumo.controllers.gate import WIDE_GATE, InnovationGate
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, ShapeError, UnknownNameError
from rumo.plan import Plan, PlanLayout
from rumo.problem import Problem
from rumo.signals import Array, NamedArray, Values
from rumo.status import Status
from rumo.transcription import Transcription

ReferenceWindow = Mapping[str, ArrayLike] | ArrayLike


class Controller(ABC):
    """A model predictive controller: `prepare()`, then `feedback(x, reference)`, once each sample.

    Parameters
    ----------
    problem : Problem
        What to solve.
    discretization : Discretization, optional
        Implicit Euler if not given.
    gate : InnovationGate, optional
        Holds back implausible measurements; None lets all finite ones pass.
    """

    name = "controller"

    def __init__(
        self,
        problem: Problem,
        discretization: Discretization | None = None,
        *,
        gate: InnovationGate | None = WIDE_GATE,
    ) -> None:
        self.problem = checked(problem, "problem", Problem)
        self.gate = None if gate is None else checked(gate, "gate", InnovationGate, "Write InnovationGate(width=...).")
        self.transcription = Transcription(problem, discretization)
        self._layout = PlanLayout(problem)
        self._parameters = problem.parameters

    @abstractmethod
    def reset(self, x: Values | None = None, applied: Mapping[str, float] | ArrayLike | None = None) -> None:
        """Forget everything; parameters are the problem's again.

        Parameters
        ----------
        x : mapping or sequence, (nx,), optional
            State to prepare the first step for.
        applied : mapping, or array_like (nu,) or (max(delay, 1), nu), optional
            Inputs already decided; the safe input if not given.
        """

    @property
    @abstractmethod
    def applied(self) -> Array:
        """Inputs already decided, shape (max(delay, 1), nu), oldest first.

        Those of the next `delay` intervals or, without delay, the last one applied. Each step appends its
        command; set this where something else was applied.
        """

    @applied.setter
    @abstractmethod
    def applied(self, inputs: Mapping[str, float] | ArrayLike) -> None: ...

    @property
    def parameters(self) -> Array:
        """Values of the model's parameters on each interval (N, np_).

        Set them by a mapping from names to numbers, or N numbers each, before a preparation; those left out are the
        problem's. Until then, and after a reset, all are.
        """
        return self._parameters.copy()

    @parameters.setter
    def parameters(self, values: Mapping[str, ArrayLike]) -> None:
        self._parameters = self.problem.parameter_table(as_mapping(values, "parameters"))
        self._take_parameters()

    @abstractmethod
    def _take_parameters(self) -> None:
        """Prepare with other parameters from now on."""

    @property
    @abstractmethod
    def status_counts(self) -> Counter[Status]:
        """Outcomes of all steps since the last reset."""

    @abstractmethod
    def step(self, x: Values, reference: ReferenceWindow) -> Plan:
        """`prepare()` and `feedback(x, reference)` in one call."""

    @abstractmethod
    def prepare(self) -> None:
        """Do all that needs no measurement. Before the first step there is nothing to do."""

    @abstractmethod
    def feedback(self, x: Values, reference: ReferenceWindow) -> Plan:
        """Return the plan for a measurement.

        Parameters
        ----------
        x : mapping or sequence, (nx,)
            Measured or estimated state; NaN where there is none.
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

    def explain(self, plan: Plan) -> Explanation:
        """What limits a plan of this controller: stiffness, active and violated constraints, convergence.

        Takes milliseconds: it estimates the local error too.
        """
        return explain(self.transcription, plan, self.parameters)

    def local_error(self, plan: Plan) -> NamedArray[Array]:
        """Error of each interval of a plan (N, nx), estimated by one with twice as many substeps."""
        return local_error(self.transcription, plan, self.parameters)

    @property
    def _reference_signals(self) -> tuple[str, ...]:
        """Signals whose reference this controller looks at."""
        return self.problem.outputs.names

    def _decided(self, inputs: Mapping[str, float] | ArrayLike | None) -> Array:
        """Inputs already decided as (max(delay, 1), nu); the safe input for None."""
        model = self.problem.model
        shape = (max(self.problem.delay, 1), len(model.inputs))
        if inputs is None:
            array = self.problem.safe_input
        else:
            named = isinstance(inputs, Mapping)
            array = model.inputs.vector(inputs, "applied") if named else as_numbers(inputs, "applied")
        if array.shape not in (shape, shape[1:]):
            raise ShapeError("applied", f"shape {array.shape}", f"shape {shape} or {shape[1:]}")
        if not np.isfinite(array).all():
            raise ArgumentError("applied", f"{array.tolist()}", "finite inputs")
        return np.broadcast_to(array, shape).copy()

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
