"""What a controller was told in a drive, to tell it to others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rumo.errors import ArgumentError
from rumo.problem import Problem
from rumo.references import ReferenceLike, as_reference, start_reference
from rumo.signals import Array, NamedArray, Signals

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
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


def recorded(problem: Problem, log: xr.Dataset, reference: ReferenceLike) -> Recording:
    """What the controller of a log was told, at all samples for which the log knows the inputs already decided.

    Parameters
    ----------
    problem : Problem
        That it solved.
    log : xarray.Dataset
        From `simulate`.
    reference : Reference, callable, or mapping of str to float
        That it followed, as `simulate` takes it.

    Raises
    ------
    ArgumentError
        If the log is too short to know any, or does not know which observed state the reference was told.
    """
    lead = float(log.attrs.get("lead_s", 0.0))
    if lead and "observed" in log:
        expected = "one of a loop whose inputs begin to act at samples, or whose observed model is the controller's"
        raise ArgumentError("log", f"one whose inputs begin to act {lead:g} s after samples", expected)
    # With a delay, the inputs already decided are those applied from now on; without, the last that was applied.
    decided, first = max(problem.delay, 1), 0 if problem.delay else 1
    samples = np.arange(first, log.sizes["time"] - decided + 1)
    if not len(samples):
        raise ArgumentError("log", f"{log.sizes['time']} samples", f"at least {first + decided}, with this delay")
    follow = start_reference(as_reference(reference), problem)
    states, times = log["estimated"].to_numpy(), log["time"].to_numpy()
    seen, names = states, problem.model.states
    if "observed" in log:
        units = dict(zip(log["observed_state"].to_numpy(), log["observed_state_unit"].to_numpy(), strict=True))
        seen, names = log["observed"].to_numpy(), Signals({str(n): str(u) for n, u in units.items()}, "observed")
    windows = [
        follow.preview(times[k] + lead + problem.times, NamedArray(names, seen[k])).signals
        for k in range(samples[-1] + 1)
    ][first:]
    shape, inputs = (len(samples), len(problem.times)), log["applied"].to_numpy()
    outputs = [
        np.reshape([np.broadcast_to(window[name], shape[1:]) for window in windows], shape) for name in problem.outputs
    ]
    return Recording(
        problem,
        states[samples].copy(),
        np.stack(outputs, axis=-1),
        np.array([inputs[k - first : k - first + decided] for k in samples]),
    )
