"""What became of a drive through a fault."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rumo.simulation.variables import SKIPPED
from rumo.status import Status
from rumo.studies.kpis import Driven, heading_error, kpis, tracking_error

if TYPE_CHECKING:
    import xarray as xr

FAR = 10.0
"""A car that was ever farther than this from its reference point is lost [m]."""
BACKWARDS = 0.5 * np.pi
"""So is one that has pointed farther than this away from its path [rad]."""
BACK = 0.3
"""A car is back when it stays this close to its reference point [m]."""

SOLVED = tuple(status.name for status in Status if status.solved)


@dataclass(frozen=True)
class Drive:
    """A drive through a fault.

    Attributes
    ----------
    log : Dataset or None
        Until something was raised, if anything was; None if there was not even a controller, or logs are not kept. Its
        attributes `first_bad_sample` and `bad_samples` say when the fault was.
    exception : str or None
        What was raised.
    outcome : dict
        See `outcome`.
    """

    log: xr.Dataset | None
    exception: str | None = None
    outcome: dict[str, Any] = field(default_factory=dict[str, Any])


def outcome(log: xr.Dataset | None, exception: str | None = None) -> dict[str, Any]:
    """What became of a drive, from its log and what was raised; None where the log does not say.

    Returns
    -------
    dict
        `bad_commands`: commands not finite or out of bounds, over the whole drive. `exceptions`: 0 or 1.
        `largest_error_m`: largest distance of the plant (not of its measurement) from the reference point, from the
        first bad sample on. `lost`: it was ever beyond `FAR`, or the car has pointed `BACKWARDS`, or something was
        raised. `samples_to_recover`: good samples until one is solved, and all after it; 1 is the next. `recovery_s`:
        time from the last bad sample until the distance stays below `BACK`; None if it does not, or if all samples are
        bad. `told`, `told_after_s`: whether, and how long after the first bad sample, a bad sample was `told` of.
    """
    raised = {"exceptions": int(exception is not None), "exception": exception}
    if log is None or not log.sizes["time"]:
        names = ("bad_commands", "largest_error_m", "samples_to_recover", "recovery_s", "told", "told_after_s")
        return {**dict.fromkeys(names), "lost": True, **raised, "status_counts": {}}
    first, end = bad_samples(log)
    dt = float(log.attrs["sampling_time_s"])
    error = tracking_error(log)
    largest = float(error[first:].max()) if error[first:].size else None
    turned = np.abs(heading_error(log))[first:]
    statuses = [str(status) for status in log["status"].to_numpy()]
    words = np.flatnonzero(told(log)[first:end])
    return {
        **kpis(Driven(log), ("bad_commands",)),
        "largest_error_m": largest,
        "lost": exception is not None or bool((error[first:] > FAR).any() or (turned > BACKWARDS).any()),
        "samples_to_recover": _samples_until([name in SOLVED for name in statuses[end:]]),
        "recovery_s": _time_until(error[end:] < BACK, dt),
        "told": bool(words.size),
        "told_after_s": dt * int(words[0]) if words.size else None,
        **raised,
        **kpis(Driven(log), ("status_counts",)),
    }


def told(log: xr.Dataset) -> NDArray[np.bool_]:
    """At which samples the controller said that something was wrong (K,).

    Everything by which it can say so belongs here: its status, and symptoms of readings.
    """
    symptoms = (log["health"].to_numpy() > 0.0).any(axis=1)
    return symptoms | ~np.isin(log["status"].to_numpy().astype(str), (*SOLVED, SKIPPED))


def bad_samples(log: xr.Dataset) -> tuple[int, int]:
    """The first bad sample of a drive, and the first good one after it."""
    first = int(log.attrs["first_bad_sample"])
    return first, first + int(log.attrs["bad_samples"])


def _samples_until(good: list[bool]) -> int | None:
    """Samples until one is good, and all after it; 1 is the first."""
    count = next((len(good) - k for k, each in enumerate(reversed(good)) if not each), 0) + 1
    return count if count <= len(good) else None


def _time_until(good: NDArray[np.bool_], dt: float) -> float | None:
    """Time from the sample before these until one is good, and all after it; 0 if all are [s]."""
    count = _samples_until(good.tolist())
    return None if count is None else dt * (count - 1 if count == 1 else count)
