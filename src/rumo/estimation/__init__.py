"""State estimation: from measurements to what the controller is told."""

from rumo.estimation.base import Estimate, Estimator, RunningEstimator, Unfiltered
from rumo.estimation.butterworth import Butterworth
from rumo.estimation.ekf import ExtendedKalman, ExtraState, OutlierGate
from rumo.estimation.innovation import Innovation

__all__ = [
    "Butterworth",
    "Estimate",
    "Estimator",
    "ExtendedKalman",
    "ExtraState",
    "Innovation",
    "OutlierGate",
    "RunningEstimator",
    "Unfiltered",
]
