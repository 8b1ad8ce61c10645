"""The estimators that are compared, each made from the same filter for a car."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rumo.estimation import Estimator, ExtendedKalman, MovingHorizon, OutlierGate
from rumo.report.charts import Look

HUBER = 2.0
"""Standard deviations from which on the robust moving horizon counts a residual linearly."""


@dataclass(frozen=True)
class Contender:
    """How an estimator is made of a filter.

    Attributes
    ----------
    title : str
        For readers.
    look : Look
        Of its lines.
    gate : OutlierGate, optional
        Of a filter.
    moving : bool
        Whether it is a moving horizon around the filter.
    huber : float
        Of the moving horizon, see `MovingHorizon`.
    """

    title: str
    look: Look
    gate: OutlierGate | None = None
    moving: bool = False
    huber: float = np.inf

    def estimator(self, kalman: ExtendedKalman, window: int, bounds: Mapping[str, tuple[float, float]]) -> Estimator:
        """The estimator; of the bounds only a moving horizon knows."""
        if self.moving:
            return MovingHorizon(kalman, window, bounds, huber=self.huber)
        return replace(kalman, gate=self.gate)


CONTENDERS = {
    # Lines often coincide: later ones are thinner, so that earlier ones show behind them.
    "ekf": Contender("EKF", Look("#0072B2", "solid", 2.6, "circle")),
    "gated": Contender("EKF with gate", Look("#E69F00", "dash", 2.0, "square"), gate=OutlierGate()),
    "mhe": Contender("MHE", Look("#009E73", "dashdot", 1.5, "triangle-up"), moving=True),
    "robust": Contender("MHE, robust", Look("#CC79A7", "dot", 1.5, "diamond"), moving=True, huber=HUBER),
}
"""By name; the first is what the others are compared with."""
