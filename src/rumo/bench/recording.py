"""Drives to be recorded once and replayed through every controller."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rumo.references import SinePath
from rumo.simulation.replay import Recording, recorded
from rumo.studies.paper import CLOSE_WEIGHTS, SAMPLING_TIME, PaperStudy
from rumo.vehicles import PAPER_CAR

SCENARIOS = {
    "easy": PaperStudy(("rti",)),
    "limit": PaperStudy(("rti",), path=SinePath(3.0, 50.0, 12.0, PAPER_CAR), weights=CLOSE_WEIGHTS),
}
"""The paper's drive at 8 m/s, and one at 12 m/s whose friction circles are violated at times."""
WEAK = "weak"
"""What the controller is told at the limit, but with weak inputs: nine tenths are at bounds."""
WEAKNESS = 0.04
"""What is left of the inputs' ranges then."""


def record(scenario: str, horizon: int, steps: int) -> Recording:
    """Drive a scenario of `SCENARIOS` with the real-time iteration for a number of samples; `WEAK` is the limit's.

    The plain one, one iteration a sample: it is what others are compared with.
    """
    study = SCENARIOS["limit" if scenario == WEAK else scenario]
    study = replace(study, horizon=horizon, duration=steps * SAMPLING_TIME)
    drive = study.scenario("rti", study.problem(), study.plant())
    log = replace(drive, settings={"trusted_step": np.inf}).run()
    recording = recorded(study.problem(), log, study.path)
    if scenario != WEAK:
        return recording
    problem = recording.problem
    bounds = {
        name: (WEAKNESS * lower, WEAKNESS * upper)
        for name, lower, upper in zip(problem.model.inputs, problem.input_lower, problem.input_upper, strict=True)
    }
    return replace(recording, problem=problem.changed(bounds=bounds))


def shortened(recording: Recording, steps: int) -> Recording:
    """Its first samples."""
    told = {name: getattr(recording, name)[:steps] for name in ("x", "reference", "applied")}
    return replace(recording, **told)
