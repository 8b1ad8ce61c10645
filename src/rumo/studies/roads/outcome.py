"""What is kept of a drive: figures, and the motion of the car, of which figures can be drawn later."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.controllers import Controller
from rumo.studies.drive.run import DriveRun, to_its_end
from rumo.studies.kpis import Driven

if TYPE_CHECKING:
    import xarray as xr

MOTION = ("p_x", "p_y", "psi", "v_x", "v_y", "omega")
"""Of the car, at each sample."""
DIGITS = 5
"""After the point, of a motion that is kept."""


@dataclass(frozen=True)
class RoadDrive:
    """A drive of a case.

    Attributes
    ----------
    outcome : dict
        Plain data: `outcome`, "finished", "lost" or "late", and `ended`, why in a sentence; figures of the case; and
        `motion`, of the car.
    log : Dataset or None
        None unless logs are kept.
    """

    outcome: dict[str, Any]
    log: xr.Dataset | None = None

    @property
    def motion(self) -> xr.Dataset | None:
        """A log of nothing but the car's motion; None if there was none."""
        return log_of(self.outcome["motion"])


def driven_until(
    run: DriveRun, controller: Controller, progress: Callable[[int, int], None] | None = None
) -> xr.Dataset:
    """The log of a drive; a plant that cannot go on is a car that is lost."""
    return to_its_end(lambda: run.run(controller, progress=progress))


def recorded(log: xr.Dataset, figures: Mapping[str, Any], seen: Driven) -> RoadDrive:
    """A drive with some figures of it."""
    ended = {"outcome": log.attrs["outcome"], "ended": log.attrs["ended"]}
    return RoadDrive({**ended, **figures, "motion": motion_of(seen)}, log)


def motion_of(seen: Driven) -> dict[str, Any]:
    """The motion of a car as plain data, from the log of a drive."""
    found = {name: seen.true(name) for name in MOTION}
    return {
        "sampling_time_s": seen.sampling_time,
        **{
            name: np.round(values, DIGITS).tolist()
            for name, values in found.items()
            if values is not None and np.isfinite(values).all()
        },
    }


def log_of(motion: Mapping[str, Any]) -> xr.Dataset | None:
    """A log of a motion: as much of one as `Driven` needs."""
    import xarray as xr  # heavy; a study alone does without it

    found = {name: motion[name] for name in MOTION if name in motion}
    if "p_x" not in found:
        return None
    dt = motion["sampling_time_s"]
    return xr.Dataset(
        {"plant": (("time", "plant_state"), np.column_stack(list(found.values())))},
        {"time": dt * np.arange(len(found["p_x"])), "plant_state": list(found)},
        {"sampling_time_s": dt},
    )
