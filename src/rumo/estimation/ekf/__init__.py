"""The extended Kalman filter: settings, the model it predicts with, and who computes its steps."""

from rumo.estimation.ekf.running import RunningExtendedKalman
from rumo.estimation.ekf.settings import ExtendedKalman, ExtraState, OutlierGate

__all__ = ["ExtendedKalman", "ExtraState", "OutlierGate", "RunningExtendedKalman"]
