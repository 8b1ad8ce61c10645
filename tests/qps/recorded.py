"""Programs that controllers meet on the way: recorded from the reference controller in closed loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from problems import cooled_reactor, stiff_reactor, swinging_cart

from rumo.bench import SCENARIOS
from rumo.bench.qp import ProgramRecorder, QuadraticProgram


def study(duration: float, at_the_limit: bool = False, hard: bool = False, **changes) -> list[QuadraticProgram]:
    """The paper's car: easy, or at the limit of friction (12 m/s on a sine of 3 m and 50 m); circles soft or hard."""
    settings = replace(SCENARIOS["limit" if at_the_limit else "easy"], duration=duration, **changes)
    if hard:
        settings = replace(settings, penalty=None)
    problem = settings.problem()
    controller = ProgramRecorder(problem)
    settings.scenario("rti", problem, settings.plant()).run(controller)
    return controller.recorded


def textbook(name: str, steps: int, seed: int = 0) -> list[QuadraticProgram]:
    """A textbook model under its own controller, pushed about by noise; some have move bounds or hard limits."""
    problem, x, wanted = {
        "swinging_cart": swinging_cart, "stiff_reactor": stiff_reactor, "cooled_reactor": cooled_reactor
    }[name]()  # fmt: skip
    rng = np.random.default_rng(seed)

    controller, state = ProgramRecorder(problem), np.array(x, dtype=float)
    for _ in range(steps):
        plan = controller.step(state, wanted)
        state = plan.x.values[1] if np.isfinite(plan.x.values[1]).all() else np.array(x, dtype=float)
        state = state * (1.0 + 0.01 * rng.normal(size=state.shape))
    return controller.recorded
