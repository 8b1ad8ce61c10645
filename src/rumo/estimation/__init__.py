"""State estimation: from measurements to what the controller is told."""

from rumo.estimation.base import Estimate, Estimator, RunningEstimator, Unfiltered
from rumo.estimation.butterworth import Butterworth
from rumo.estimation.consistency import Consistency, consistency
from rumo.estimation.delay import DelayMonitor
from rumo.estimation.ekf import ExtendedKalman, ExtraState, OutlierGate
from rumo.estimation.innovation import Innovation
from rumo.estimation.mhe import MovingHorizon
from rumo.estimation.prediction import Prediction
from rumo.estimation.tuning import fit_process_noise

__all__ = [
    "Butterworth",
    "Consistency",
    "DelayMonitor",
    "Estimate",
    "Estimator",
    "ExtendedKalman",
    "ExtraState",
    "Innovation",
    "MovingHorizon",
    "OutlierGate",
    "Prediction",
    "RunningEstimator",
    "Unfiltered",
    "consistency",
    "fit_process_noise",
]
