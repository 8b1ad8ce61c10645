"""How well an estimator knew where a car was, from the log of its drive."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.estimation import Estimator, consistency
from rumo.estimation.tuning import recorded_drive
from rumo.problem import Problem
from rumo.signals import Array
from rumo.simulation.log import names, signal
from rumo.studies.drive.run import LOST
from rumo.studies.kpis import Driven, kpis
from rumo.studies.kpis.base import largest, rms

if TYPE_CHECKING:
    import xarray as xr

SETTLED = 1.0
"""Errors leave out the time until then, where the start is not what is asked [s]."""
NEAR = 0.01
"""An estimate has settled when its heading stays closer than this to the car's [rad]."""
DRIVE = ("lateral_deviation_rms", "lateral_deviation_max", "time_off_track")
"""What is said of the drive that came of it, see `rumo.studies.kpis`."""
BEYOND = 1e-6
"""By so much an estimate may be beyond a bound, for rounding."""


def errors(log: xr.Dataset) -> dict[str, Array]:
    """Estimate less truth at each sample (K,), by signal; `position` is a distance [m]."""
    found = {
        name: signal(log, "observed", name) - signal(log, "true_observed", name)
        for name in names(log, "observed_state")
    }
    found["psi"] = (found["psi"] + np.pi) % (2.0 * np.pi) - np.pi
    return {"position": np.hypot(found.pop("p_x"), found.pop("p_y")), **found}


def outcome(
    drive: Driven, *, after: float, bounds: Mapping[str, tuple[float, float]], truth: Mapping[str, float]
) -> dict[str, Any]:
    """What is kept of a drive; None where it does not say.

    Parameters
    ----------
    drive : Driven
        Its log, and what was to be driven.
    after : float
        From when on errors count [s].
    bounds : mapping of str to (float, float)
        Of unknowns that are estimated.
    truth : mapping of str to float
        What these unknowns are.

    Returns
    -------
    dict
        `rmse`: root mean square error of the estimates by signal, in its unit; `position` in m. `settled_s`: from when
        on the heading is known to within `NEAR`. `beyond`: share of the samples at which an unknown was beyond its
        bounds, and `farthest`: the largest amount. `nis`, `nis_expected`, `nis_interval`. The `DRIVE`'s figures,
        `lost`. `time_s`, `heading_error_rad` and `unknowns` by sample.
    """
    log = drive.log
    counts = drive.time >= after
    found = errors(log)
    unknowns = {name: signal(log, "estimated_parameters", name) for name in truth}
    found |= {name: values - truth[name] for name, values in unknowns.items()}
    over = [
        np.maximum(unknowns[name] - bounds[name][1], bounds[name][0] - unknowns[name])[counts]
        for name in unknowns
        if name in bounds
    ]
    judged = consistency(log, after=after)
    return {
        "rmse": {name: rms(values[counts]) for name, values in found.items()},
        "settled_s": _settled(drive.time, np.abs(found["psi"])),
        "beyond": float(np.mean([(each > BEYOND).mean() for each in over])) if over else None,
        "farthest": largest(np.maximum(np.concatenate(over), 0.0)) if over else None,
        "nis": judged.nis,
        "nis_expected": judged.expected,
        "nis_interval": list(judged.interval),
        **kpis(drive, DRIVE),
        "lost": log.attrs.get("outcome") == LOST,
        "time_s": drive.time.tolist(),
        "heading_error_rad": _known(found["psi"]),
        "unknowns": {name: _known(values) for name, values in unknowns.items()},
    }


def update_time(estimator: Estimator, problem: Problem, log: xr.Dataset) -> float:
    """Median time of an estimator's update, told again what it was told in a drive [us].

    Parameters
    ----------
    estimator : Estimator
        Its settings.
    problem : Problem
        With the model whose states are estimated, and the controller's scheme.
    log : Dataset
        Of the drive.
    """
    recorded = recorded_drive(log, problem.model)
    running = estimator.start(problem, recorded.names, problem.discretization)
    times: list[float] = []
    for sample in zip(recorded.measured, recorded.applied, recorded.parameters, strict=True):
        begun = perf_counter()
        running.update(*sample)
        times.append(perf_counter() - begun)
    return 1e6 * float(np.median(times))


def _settled(time: Array, error: Array) -> float | None:
    """From when on an error stays small; None if it does not [s]."""
    far = np.flatnonzero(~(error < NEAR))
    if not far.size:
        return 0.0
    return float(time[far[-1] + 1]) if far[-1] + 1 < len(time) else None


def _known(values: Array) -> list[float | None]:
    return [round(value, 6) if np.isfinite(value) else None for value in values.tolist()]
