"""What is observed of a plant, and what it means for a controller whose model has other states."""

from __future__ import annotations

import numpy as np

from rumo.checks import as_mapping, checked
from rumo.errors import ArgumentError
from rumo.estimation import Estimate
from rumo.model import Model
from rumo.problem import Problem
from rumo.references import Reference
from rumo.signals import Array, NamedArray
from rumo.terms import Weight


class Observation:
    """The model whose states are measured and estimated: the controller's own, or another of the same inputs.

    Parameters
    ----------
    problem : Problem
        The controller's.
    observed : Model, optional
        The model, if it is another.

    Attributes
    ----------
    model : Model
        That is observed.
    problem : Problem
        For an estimator: of this model, with the controller's sampling time.

    Raises
    ------
    ArgumentError
        If the inputs are not the controller's.
    """

    def __init__(self, problem: Problem, observed: Model | None = None) -> None:
        self._told = problem.model
        self.own = observed is None
        self.problem = problem if observed is None else _observing(problem, observed)
        self.model = self.problem.model
        mine = self.model.parameters
        theirs = problem.model.parameters
        self._shared = [(mine.index(name), theirs.index(name)) for name in mine if name in theirs]

    def parameters(self, controller: Array) -> Array:
        """Parameters (np_,) of the observed model: the controller's of the same names, defaults for others."""
        if self.own:
            return controller
        values = self.model.default_parameters.copy()
        for own, other in self._shared:
            values[own] = controller[other]
        return values

    def estimated_parameters(self, estimate: Estimate) -> dict[str, float]:
        """Of these, those that the controller's model has as well."""
        return {name: value for name, value in estimate.parameters.items() if name in self._told.parameters}

    def told(self, x: NamedArray[float], reference: Reference) -> Array:
        """State (nx,) of the controller's model: what is observed, and where that is by the reference's own account."""
        if self.own:
            return x.values
        located, states = self._located(x, reference), x.signals
        missing = [name for name in self._told.states if name not in located and name not in states]
        if missing:
            raise ArgumentError(
                "observed",
                f"{self.model.name}, without {', '.join(missing)}",
                "a model that has all states of the controller's, but for those that reference.locate(x) gives",
                "A PathTracking reference gives s, n and heading_error.",
            )
        seen = x.values.tolist()
        told = [located[n] if n in located else seen[states.index(n)] for n in self._told.states]
        return np.array(told, dtype=float)

    @staticmethod
    def _located(x: NamedArray[float], reference: Reference) -> dict[str, float]:
        locate = getattr(reference, "locate", None)
        return as_mapping(locate(x), "reference.locate()") if callable(locate) else {}


def _observing(problem: Problem, observed: Model) -> Problem:
    """A problem of the observed model that an estimator can be started for: what it wants does not matter."""
    checked(observed, "observed", Model)
    inputs = problem.model.inputs
    if dict(zip(observed.inputs, observed.inputs.units, strict=True)) != dict(zip(inputs, inputs.units, strict=True)):
        raise ArgumentError(
            "observed", f"inputs {', '.join(observed.inputs)}", f"the controller's, {', '.join(inputs)}, in their units"
        )
    if observed.inputs.names != inputs.names:
        raise ArgumentError("observed", f"inputs {', '.join(observed.inputs)}", f"this order: {', '.join(inputs)}")
    return Problem(
        observed,
        horizon=1,
        sampling_time=problem.sampling_time,
        track={observed.states.names[0]: Weight(1.0)},
        moves={name: Weight(1.0) for name in observed.inputs},
    )
