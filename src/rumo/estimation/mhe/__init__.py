"""Moving horizon estimation: settings, the estimator at work, and the program that it solves at each sample."""

from rumo.estimation.mhe.running import RunningMovingHorizon
from rumo.estimation.mhe.settings import MovingHorizon

__all__ = ["MovingHorizon", "RunningMovingHorizon"]
