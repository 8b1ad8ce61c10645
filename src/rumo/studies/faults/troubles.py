"""What can go wrong in a drive, and what a drive comes to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rumo.simulation.faults import Budget, Fault, Frozen, Misinformed, Missing, Offset, Reading

if TYPE_CHECKING:
    import xarray as xr

ABSURD_STEERING = 100.0
"""A steering rate [rad/s] that no later input can make up for within the hard bounds of the steering angle."""

NEVER = range(0)


@dataclass(frozen=True)
class Trouble:
    """What goes wrong during the bad samples.

    Attributes
    ----------
    title : str
        In words.
    fault : Fault or None
        At whatever samples.
    """

    title: str
    fault: Fault | None = None


FAULTS: dict[str, Trouble] = {
    "none": Trouble("No fault"),
    "nan": Trouble("NaN in a state", Reading(NEVER, "psi", np.nan)),
    "infinite": Trouble("Infinite speed", Reading(NEVER, "v_x", np.inf)),
    "jump": Trouble("Position off by 100 m", Offset(NEVER, "p_y", 100.0)),
    "spin": Trouble("Yaw rate 50 rad/s", Reading(NEVER, "omega", 50.0)),
    "frozen": Trouble("Frozen measurements", Frozen(NEVER)),
    "missing": Trouble("No measurement", Missing(NEVER)),
    "failure": Trouble("Solver fails", Misinformed(NEVER, {"torque": 0.0, "steering_rate": ABSURD_STEERING})),
    "budget": Trouble("Budget of 0 iterations", Budget(NEVER)),
}
"""What can go wrong, by name; the first is the undisturbed drive."""


@dataclass(frozen=True)
class Drive:
    """A drive through a fault.

    Attributes
    ----------
    log : Dataset or None
        Until something was raised, if anything was; None if there was not even a controller. Its attributes
        `first_bad_sample` and `bad_samples` say when the fault was.
    exception : str or None
        What was raised.
    """

    log: xr.Dataset | None
    exception: str | None = None
