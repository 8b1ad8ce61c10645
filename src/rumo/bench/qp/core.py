"""The QP solver of the C core by itself."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from rumo.bench.qp.condensed import QuadraticProgram
from rumo.kernel import Qp, Settings
from rumo.signals import Array
from rumo.status import Status


@dataclass(frozen=True)
class Solution:
    """Answer of a solver: v (n,), multipliers (n + rows,) of bounds and rows, positive at upper limits."""

    v: Array
    multipliers: Array
    status: Status = Status.OPTIMAL
    iterations: int = 0
    conflict: tuple[int, ...] = ()
    seconds: float = np.nan
    factor_seconds: float = np.nan


class CoreQp:
    """The core's solver for programs of one size, one after the other; it keeps its working set."""

    def __init__(self, variables: int, rows: int) -> None:
        self.variables, self.rows = variables, rows
        self._core = Qp(variables, rows)

    def solve(self, program: QuadraticProgram, warm: bool = False, **settings: Any) -> Solution:
        """Solve, from the working set of the call before if `warm`; `settings` are those of `Settings`."""
        v, multipliers = np.full(self.variables, np.nan), np.full(self.variables + self.rows, np.nan)
        chosen = dataclasses.asdict(Settings(**settings))
        status, iterations, seconds, factor_seconds, conflict = self._core.solve(
            *arrays(program), settings=chosen, warm=warm, v=v, multipliers=multipliers
        )
        return Solution(v, multipliers, list(Status)[status], iterations, tuple(conflict), seconds, factor_seconds)


def arrays(program: QuadraticProgram) -> list[Array]:
    """A program as the core takes it."""
    return [np.ascontiguousarray(getattr(program, field.name)) for field in dataclasses.fields(program)]
