"""By how much, how often and for how long path constraints were violated by the car itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rumo.signals import Array
from rumo.simulation.log import names, signal
from rumo.studies.kpis.base import Kpi, table
from rumo.studies.kpis.driven import Driven


def _by_constraint(drive: Driven, of: Callable[[Array], float | int]) -> dict[str, float | int]:
    """A figure of each violation (K,), 0 where a constraint holds; of those that the log can tell."""
    every = {name: signal(drive.log, "true_constraints", name) for name in names(drive.log, "constraint")}
    known = {name: values[np.isfinite(values)] for name, values in every.items()}
    return {name: of(np.maximum(values, 0.0)) for name, values in known.items() if values.size}


CONSTRAINTS = table(
    [
        Kpi(
            "constraint_violations",
            "Samples violated",
            "1",
            "Samples at which the true state violates the constraint, by constraint.",
            lambda d: _by_constraint(d, lambda values: int((values > 0.0).sum())),
        ),
        Kpi(
            "constraint_violation_max",
            "Largest violation",
            "1",
            "Largest violation of a constraint, in its unit.",
            lambda d: _by_constraint(d, lambda values: float(values.max())),
        ),
        Kpi(
            "constraint_violation_integral",
            "Integral of the violation",
            "s",
            "Violation times time, in the constraint's unit times s.",
            lambda d: _by_constraint(d, lambda values: float(values.sum()) * d.sampling_time),
        ),
    ]
)
"""Of the controller's path constraints."""
