"""Programs that controllers meet on the way: recorded from the reference controller in closed loop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from unittest.mock import patch

import numpy as np
from problems import cooled_reactor, stiff_reactor, swinging_cart

import rumo
from rumo.bench import SCENARIOS
from rumo.controllers import condensed
from rumo.controllers.qp import QuadraticProgram
from rumo.registry import CONTROLLERS


def recording(drive: Callable[[], object]) -> list[QuadraticProgram]:
    """All programs that are solved while something drives."""
    programs = []
    solve = condensed.solve

    def record(program, options):
        programs.append(program)
        return solve(program, options)

    with patch.object(condensed, "solve", record):
        drive()
    return programs


def reference(problem: rumo.Problem) -> rumo.RealTimeIteration:
    return rumo.RealTimeIteration(problem, backend="reference")


def study(duration: float, at_the_limit: bool = False, hard: bool = False, **changes) -> list[QuadraticProgram]:
    """The paper's car: easy, or at the limit of friction (12 m/s on a sine of 3 m and 50 m); circles soft or hard."""
    settings = replace(SCENARIOS["limit" if at_the_limit else "easy"], duration=duration, **changes)
    if hard:
        settings = replace(settings, penalty=None)

    def drive():
        with patch.dict(CONTROLLERS, rti=reference):
            settings.run()

    return recording(drive)


def textbook(name: str, steps: int, seed: int = 0) -> list[QuadraticProgram]:
    """A textbook model under its own controller, pushed about by noise; some have move bounds or hard limits."""
    problem, x, wanted = {
        "swinging_cart": swinging_cart, "stiff_reactor": stiff_reactor, "cooled_reactor": cooled_reactor
    }[name]()  # fmt: skip
    rng = np.random.default_rng(seed)

    def drive():
        controller = reference(problem)
        state = np.array(x, dtype=float)
        for _ in range(steps):
            plan = controller.step(state, wanted)
            state = plan.x.values[1] if np.isfinite(plan.x.values[1]).all() else np.array(x, dtype=float)
            state = state * (1.0 + 0.01 * rng.normal(size=state.shape))

    return recording(drive)
