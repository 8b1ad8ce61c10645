"""A closed loop, driven once: what a controller was told at each sample."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rumo.problem import Problem
from rumo.references import SinePath
from rumo.signals import Array
from rumo.studies.paper import CLOSE_WEIGHTS, SAMPLING_TIME, PaperStudy
from rumo.vehicles import PAPER_CAR

SCENARIOS = {
    "easy": PaperStudy(("rti",)),
    "limit": PaperStudy(("rti",), path=SinePath(3.0, 50.0, 12.0, PAPER_CAR), weights=CLOSE_WEIGHTS),
}
"""The paper's drive at 8 m/s, and one at 12 m/s whose friction circles are violated at times."""


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


def record(scenario: str, horizon: int, steps: int) -> Recording:
    """Drive a scenario of `SCENARIOS` with the real-time iteration for a number of samples."""
    steps_driven = steps + 1
    study = replace(SCENARIOS[scenario], horizon=horizon, duration=steps_driven * SAMPLING_TIME)
    problem, log = study.problem(), study.run()["rti"]
    ahead = SAMPLING_TIME * np.arange(horizon + 1)
    windows = [study.path(SAMPLING_TIME * k + ahead) for k in range(steps)]
    reference = np.array([np.column_stack([window[name] for name in problem.outputs]) for window in windows])
    # With a delay of one sample, the input already decided at a sample is the one applied from then on.
    return Recording(problem, log.estimated.values[:steps].copy(), reference, log.applied.values[:steps, None].copy())
