"""What car and tyres go through: accelerations, jerk, and how much of their friction is used."""

from __future__ import annotations

import numpy as np

from rumo.signals import Array
from rumo.studies.kpis.base import Kpi, largest, percentile, rms, table
from rumo.studies.kpis.driven import Driven


def _lateral(drive: Driven) -> Array | None:
    return None if drive.acceleration is None else drive.acceleration[1]


def _jerk(drive: Driven) -> Array | None:
    if drive.acceleration is None:
        return None
    along, across = (np.diff(values) / drive.sampling_time for values in drive.acceleration)
    return np.hypot(along, across)


def _friction(drive: Driven, share: float) -> dict[str, float | None] | None:
    return {wheel: percentile(used, share) for wheel, used in drive.friction_use.items()} or None


MOTION = table(
    [
        Kpi(
            "lateral_acceleration_max",
            "Lateral acceleration, largest",
            "m/s^2",
            "Largest acceleration of the centre of gravity to the car's left or right, as means between two samples.",
            lambda d: largest(_lateral(d)),
        ),
        Kpi(
            "jerk_rms",
            "Jerk, RMS",
            "m/s^3",
            "Root mean square of the change of the acceleration, in the car's frame, from sample to sample.",
            lambda d: rms(_jerk(d)),
        ),
        Kpi(
            "friction_use_p95",
            "Friction use, 95 %",
            "1",
            "Force of a tyre over mu F_z that 95 % of the samples do not exceed, by wheel.",
            lambda d: _friction(d, 95.0),
        ),
        Kpi(
            "friction_use_max",
            "Friction use, largest",
            "1",
            "Largest force of a tyre over mu F_z, by wheel; some tyres have a little more than 1 at their peak.",
            lambda d: _friction(d, 100.0),
        ),
    ]
)
"""Of car and tyres."""
