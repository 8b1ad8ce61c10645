"""What the controller gets to know of the plant: noisy states, estimated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from rumo.errors import ArgumentError, UnknownNameError
from rumo.estimation import Estimator, RunningEstimator
from rumo.model import Model
from rumo.problem import Problem
from rumo.signals import Array


@dataclass(frozen=True)
class Sensors:
    """Gaussian noise on the plant's states, and an estimator behind it.

    Parameters
    ----------
    noise : mapping of str to float
        Standard deviation of the noise on each plant state, in its unit; none where not given.
    estimator : Estimator, optional
        Turns measurements of the controller's states into estimates; they pass unchanged without one.
    """

    noise: Mapping[str, float] = field(default_factory=dict)
    estimator: Estimator | None = None

    def start(self, problem: Problem) -> RunningEstimator | None:
        """Return a fresh estimator for a run, None where measurements pass unchanged."""
        if isinstance(self.estimator, type):
            raise ArgumentError("estimator", self.estimator.__name__, "settings such as Butterworth(cutoff=3.5)")
        return self.estimator.start(problem) if self.estimator else None

    def deviations(self, plant: Model) -> Array:
        """Standard deviation of each plant state's noise (nx,)."""
        sigma = plant.states.finite_vector(dict(self.noise), "noise", np.zeros(len(plant.states)))
        for name, value in self.noise.items():
            if value < 0.0:
                raise ArgumentError(f"noise[{name!r}]", f"{value:g}", "a standard deviation of 0 or more")
        return sigma


def require_same_units(plant: Model, model: Model, names: Iterable[str]) -> None:
    """Raise if a signal that plant and model share has another unit in each."""
    for name in names:
        if plant.unit(name) != model.unit(name):
            raise ArgumentError(
                "plant",
                f"{name!r} in {plant.unit(name)}",
                f"the controller's unit, {model.unit(name)}",
                "Rumo does not convert units.",
            )


def observation(plant: Model, model: Model) -> ca.Function:
    """Function `(x, u, p) -> (nx,)` from the plant to the controller's states: plant states or outputs of that name."""
    known = (*plant.states, *plant.outputs)
    for name in model.states:
        if name not in known:
            raise UnknownNameError(
                "plant", name, known, f"Give {plant.name} an output of this name: the controller needs it as a state."
            )
    require_same_units(plant, model, model.states)
    rows = [plant.expression(name, "plant") for name in model.states]
    return ca.Function("observation", [plant.x, plant.u, plant.p], [ca.vertcat(*rows)])
