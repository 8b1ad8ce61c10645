"""Moving horizon estimation: bounds and outliers, where a Kalman filter knows only noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rumo.actuation.timing import SAME_TIME
from rumo.checks import as_mapping, as_numbers, checked, positive_number, whole_number
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, UnknownNameError
from rumo.estimation.ekf import ExtendedKalman
from rumo.estimation.ekf.running import FilterParts
from rumo.estimation.mhe.running import RunningMovingHorizon
from rumo.problem import Problem
from rumo.signals import Array

Limits = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class MovingHorizon:
    """The states of a window of samples under which what was measured is most likely, found anew at each sample.

    Samples that have left the window count through the arrival cost: the Kalman filter's covariance, carried along the
    states that the window found. Each sample takes one iteration of Gauss and Newton (Kuehl et al., 2011). On a linear
    model, without bounds and outliers, the estimate is the Kalman filter's.

    Parameters
    ----------
    filter : ExtendedKalman
        Noise, first estimates, late measurements (whole samples), unknowns, scheme. It has no gate and no floor: see
        `huber`.
    window : int
        Samples that are looked back on, more than the latest measurement is late.
    bounds : mapping of str to (lower, upper)
        Of states, parameters and biases that are estimated; infinite for none.
    noise_bounds : mapping of str to (lower, upper)
        Of what the model misses of a state in one sample.
    huber : float
        Standard deviations up to which a measurement's residual counts as its square, and from there on linearly, so
        that an outlier pulls no harder than one of that size. Infinite for squares alone.
    """

    filter: ExtendedKalman
    window: int = 10
    bounds: Limits = field(default_factory=dict[str, tuple[float, float]])
    noise_bounds: Limits = field(default_factory=dict[str, tuple[float, float]])
    huber: float = np.inf

    def __post_init__(self) -> None:
        checked(self.filter, "MovingHorizon.filter", ExtendedKalman, "Write rumo.ExtendedKalman(noise, process).")
        whole_number(self.window, "MovingHorizon.window", 1)
        if self.huber != np.inf:
            positive_number(self.huber, "MovingHorizon.huber")
        for name, value in (("gate", self.filter.gate), ("floor", self.filter.floor)):
            if value:
                raise ArgumentError(
                    f"MovingHorizon.filter.{name}", repr(value), "nothing", "Outliers are for huber, a loss."
                )

    @property
    def late(self) -> Mapping[str, float]:
        """Samples from measurements to their arrival."""
        return self.filter.late

    @property
    def age(self) -> Mapping[str, float]:
        """The same in seconds."""
        return self.filter.age

    def start(
        self,
        problem: Problem,
        measured: Sequence[str] | None = None,
        discretization: Discretization | None = None,
    ) -> RunningMovingHorizon:
        """Return an estimator without memory, see `ExtendedKalman.start`."""
        parts = self.filter.parts(problem, measured, discretization)
        late = np.round(parts.late)
        if (np.abs(parts.late - late) > SAME_TIME).any():
            raise ArgumentError(
                "MovingHorizon.filter",
                "fractions of samples among ages",
                "whole ones",
                "ExtendedKalman takes fractions.",
            )
        if late.max(initial=0.0) >= self.window:
            expected = f"more than the {late.max():g} samples that measurements are late"
            raise ArgumentError("MovingHorizon.window", str(self.window), expected)
        names = (*parts.states, *parts.parameters, *parts.biases)
        limits = _limits(names, self.bounds, "MovingHorizon.bounds", parts)
        noise = _limits(names[: len(parts.states)], self.noise_bounds, "MovingHorizon.noise_bounds", parts)
        if (noise[0] > 0.0).any() or (noise[1] < 0.0).any():
            raise ArgumentError("MovingHorizon.noise_bounds", "limits without 0 between them", "noise that may be none")
        return RunningMovingHorizon(parts, late.astype(int), self.window, limits, noise, self.huber)


def _limits(names: Sequence[str], given: Limits, argument: str, parts: FilterParts) -> tuple[Array, Array]:
    """Lower and upper limits of all that is estimated (n,)."""
    lower, upper = np.full(parts.model.size, -np.inf), np.full(parts.model.size, np.inf)
    for name, pair in as_mapping(given, argument).items():
        if name not in names:
            raise UnknownNameError(argument, name, names)
        values = as_numbers(pair, f"{argument}[{name!r}]")
        if values.shape != (2,) or not values[0] < values[1]:
            raise ArgumentError(f"{argument}[{name!r}]", repr(pair), "two limits, the lower one first")
        lower[names.index(name)], upper[names.index(name)] = values
    return lower, upper
