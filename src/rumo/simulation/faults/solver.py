"""Controllers that have no time, or no solution."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rumo.checks import as_mapping, finite_number, whole_number
from rumo.controllers import Controller
from rumo.errors import ArgumentError
from rumo.signals import Signals
from rumo.simulation.faults.base import Fault


@dataclass(frozen=True)
class Budget(Fault):
    """The solver may do only so many iterations.

    Parameters
    ----------
    iterations : int
        0 leaves it with what it had before.
    """

    iterations: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        whole_number(self.iterations, "iterations", 0)

    def around(self, controller: Controller) -> AbstractContextManager[object]:
        """Limit the step's iterations; afterwards the controller's settings are its own again."""
        return _limited(controller, self.iterations)


@contextmanager
def _limited(controller: Any, iterations: int) -> Generator[None, None, None]:
    settings = controller.settings
    if hasattr(settings, "qp"):
        controller.configure(qp=replace(settings.qp, max_iterations=iterations))
    elif hasattr(settings, "max_iterations"):
        controller.configure(max_iterations=iterations)
    else:
        raise ArgumentError("faults", "a Budget", f"a controller with a budget, which {controller.name} has not")
    try:
        yield
    finally:
        controller.settings = settings


@dataclass(frozen=True)
class Misinformed(Fault):
    """The controller is told that other inputs were decided than those that are.

    An absurd input, from which no later one can bring the system back within hard bounds, leaves it without a solution.

    Parameters
    ----------
    applied : mapping of str to float
        What it is told: a value for each input.
    """

    applied: Mapping[str, float]

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, value in as_mapping(self.applied, "applied").items():
            finite_number(value, f"applied[{name!r}]")

    def check(self, measured: Signals, inputs: Signals) -> None:
        """Raise for unknown inputs, and missing ones."""
        inputs.vector(self.applied, "applied")

    def around(self, controller: Controller) -> AbstractContextManager[object]:
        """Tell the controller before its step; afterwards it knows again what was decided, its command included."""
        return _misinformed(controller, self.applied)


@contextmanager
def _misinformed(controller: Controller, applied: Mapping[str, float]) -> Generator[None, None, None]:
    decided = controller.applied
    controller.applied = applied
    yield
    if len(decided) > 1:
        controller.applied = np.vstack([decided[1:], controller.applied[-1:]])
