"""Noise settings of a filter from what was measured in a drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rumo.checks import as_list, checked, positive_number
from rumo.discretization import Discretization
from rumo.errors import ArgumentError
from rumo.estimation.ekf import ExtendedKalman, RunningExtendedKalman
from rumo.estimation.innovation import Innovation
from rumo.model import Model
from rumo.problem import Problem
from rumo.signals import Array

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class RecordedDrive:
    """What a filter was told, sample by sample.

    Attributes
    ----------
    names : tuple of str
        Of the measurements.
    measured : ndarray, shape (K, m)
        As they arrived.
    applied : ndarray, shape (K, nu)
        Input held since the sample before.
    parameters : ndarray, shape (K, np_)
        Of the controller's model since then.
    input_age : float
        Share of a sample until an input acts.
    """

    names: tuple[str, ...]
    measured: Array
    applied: Array
    parameters: Array
    input_age: float


def recorded_drive(log: xr.Dataset, model: Model) -> RecordedDrive:
    """What the filter of a log was told, whose model this is: that of the controller, or of what was observed for it.

    Before the first sample the input is taken to be the first applied.
    """
    states = log["state"].to_numpy().tolist()
    received, others = log["received"].to_numpy(), log["received_outputs"].to_numpy()
    known = {name: received[:, i] for i, name in enumerate(states)}
    known |= {name: others[:, i] for i, name in enumerate(log["measured_output"].to_numpy().tolist())}
    names = tuple(log["measurement"].to_numpy().tolist())
    before = np.maximum(np.arange(log.sizes["time"]) - 1, 0)
    of_controller = log["model_parameter"].to_numpy().tolist()
    shared = [name for name in model.parameters if name in of_controller]
    parameters = np.tile(model.default_parameters, (len(before), 1))
    columns = [of_controller.index(name) for name in shared]
    parameters[:, [model.parameters.index(name) for name in shared]] = log["parameters"].to_numpy()[before, 0][
        :, columns
    ]
    return RecordedDrive(
        names,
        np.column_stack([known[name] for name in names]),
        log["applied"].to_numpy()[before],
        parameters,
        float(log.attrs.get("lead_s", 0.0)) / float(log.attrs["sampling_time_s"]),
    )


def replayed(running: RunningExtendedKalman, drive: RecordedDrive) -> list[Innovation | None]:
    """The innovations of a filter that is told again what was recorded, from the start; None where it has none."""
    running.forget()
    running.input_age = drive.input_age
    innovations = list[Innovation | None]()
    for sample in zip(drive.measured, drive.applied, drive.parameters, strict=True):
        running.update(*sample)
        innovations.append(running.innovation)
    return innovations


def fit_process_noise(
    estimator: ExtendedKalman,
    problem: Problem,
    logs: xr.Dataset | Sequence[xr.Dataset],
    discretization: Discretization | None = None,
    *,
    skip: int = 25,
    decades: float = 3.0,
) -> ExtendedKalman:
    """The process noise under which what was measured in drives is most likely.

    Parameters
    ----------
    estimator : ExtendedKalman
        Its process noise is where the search begins; all else stays. What its gate refuses is left out.
    problem : Problem
        With the model of the filter.
    logs : xarray.Dataset or sequence of them
        Drives with the same measurements, of which nothing is read but what was measured, applied and told.
    discretization : Discretization, optional
        That of the controller.
    skip : int
        Samples at the beginning of each drive that do not count.
    decades : float
        How far a standard deviation may be from where the search begins.

    Returns
    -------
    ExtendedKalman
        With other process noise.

    Notes
    -----
    Maximum likelihood of the innovations (Ljung, 1999, ch. 7), over logarithms of the standard deviations by L-BFGS-B.
    What the model misses is hardly ever white: see `consistency` for what is left.
    """
    from scipy.optimize import minimize

    checked(estimator, "estimator", ExtendedKalman, "Write rumo.ExtendedKalman(noise, process).")
    checked(problem, "problem", Problem)
    positive_number(decades, "decades")
    several: list[Any] = [logs] if hasattr(logs, "data_vars") else as_list(logs, "logs", "a log, or a list of some")
    drives = [recorded_drive(log, problem.model) for log in several]
    if any(drive.names != drives[0].names for drive in drives):
        raise ArgumentError("logs", "different measurements", "the same ones in each")
    states = problem.model.states
    judging = estimator.start(problem, drives[0].names, discretization)
    fitted = replace(estimator, gate=None).start(problem, drives[0].names, discretization)
    drives = [_without_outliers(judging, drive) for drive in drives]
    first = np.array([estimator.process[name] for name in states])

    def cost(logarithms: Array) -> float:
        fitted.retune(first * np.exp(logarithms))
        known = [item for drive in drives for item in replayed(fitted, drive)[skip:] if item is not None]
        return -sum(item.log_likelihood for item in known) / max(len(known), 1)

    if not np.isfinite(cost(np.zeros(len(first)))):
        raise ArgumentError("logs", "nothing that the filter could follow", "drives of this model")
    limit = decades * np.log(10.0)
    best = minimize(
        cost,
        np.zeros(len(first)),
        method="L-BFGS-B",
        bounds=[(-limit, limit)] * len(first),
        options={"eps": 1e-3, "maxiter": 100, "ftol": 1e-7},
    )
    found = first * np.exp(best.x)
    return replace(estimator, process={name: float(value) for name, value in zip(states, found, strict=True)})


def _without_outliers(running: RunningExtendedKalman, drive: RecordedDrive) -> RecordedDrive:
    """Without what a filter's gate refuses, as far as its measurements come at once."""
    measured = drive.measured.copy()
    for row, innovation in zip(measured, replayed(running, drive), strict=True):
        if innovation is not None and not running.goes_back:
            row[np.isfinite(innovation.values) & ~innovation.used] = np.nan
    return replace(drive, measured=measured)
