"""Figures of merit of a run, from its log."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.signals import Array
from rumo.simulation.log import signal

if TYPE_CHECKING:
    import xarray as xr

SETTLED = 2.0
"""Errors "after 2 s" leave out the approach from the initial error [s]."""


def tracking_error(log: xr.Dataset) -> Array:
    """Distance of the plant from the reference point at each sample (K,) [m]."""
    return np.hypot(
        signal(log, "plant", "p_x") - signal(log, "reference", "p_x"),
        signal(log, "plant", "p_y") - signal(log, "reference", "p_y"),
    )


def driving_kpis(log: xr.Dataset) -> dict[str, Any]:
    """What `summary.json` says of a controller; None where the run is too short to say."""
    error = tracking_error(log)
    settled = error[log["time"].to_numpy() >= SETTLED]
    step_us = 1e6 * log["step_time"].to_numpy()
    return {
        "tracking_error_rms_m": _rms(error),
        "tracking_error_rms_after_2s_m": _rms(settled),
        "tracking_error_max_after_2s_m": float(settled.max()) if settled.size else None,
        "step_time_us": {
            "mean": float(step_us.mean()),
            "p50": float(np.percentile(step_us, 50)),
            "p99": float(np.percentile(step_us, 99)),
            "max": float(step_us.max()),
        },
        "deadline_misses": int((log["waited_time"].to_numpy() > log.attrs["sampling_time_s"]).sum()),
        "status_counts": dict(Counter(str(status) for status in log["status"].to_numpy())),
    }


def _rms(error: Array) -> float | None:
    return float(np.sqrt(np.mean(error**2))) if error.size else None
