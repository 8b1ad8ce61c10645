"""What a controller was told in a drive, to tell it to others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rumo.problem import Problem
from rumo.references import Reference
from rumo.signals import Array

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Recording:
    """What a controller was told, sample by sample.

    Attributes
    ----------
    problem : Problem
        What it solves.
    x : ndarray, shape (n, nx)
        States.
    reference : ndarray, shape (n, N + 1, ny)
        Wanted outputs.
    applied : ndarray, shape (n, max(delay, 1), nu)
        Inputs already decided.
    """

    problem: Problem
    x: Array
    reference: Array
    applied: Array

    def __len__(self) -> int:
        return len(self.x)


def recorded(problem: Problem, log: xr.Dataset, reference: Reference) -> Recording:
    """What the controller of a log was told, at all samples for which the log knows the inputs already decided.

    Parameters
    ----------
    problem : Problem
        That it solved.
    log : xarray.Dataset
        From `simulate`.
    reference : callable
        That it followed.
    """
    # With a delay, the inputs already decided are those applied from now on; without, the last that was applied.
    decided, first = max(problem.delay, 1), 0 if problem.delay else 1
    samples = np.arange(first, log.sizes["time"] - decided + 1)
    windows = [reference(log["time"].to_numpy()[k] + problem.times) for k in samples]
    inputs = log["applied"].to_numpy()
    return Recording(
        problem,
        log["estimated"].to_numpy()[samples].copy(),
        np.array([np.column_stack([window[name] for name in problem.outputs]) for window in windows]),
        np.array([inputs[k - first : k - first + decided] for k in samples]),
    )
