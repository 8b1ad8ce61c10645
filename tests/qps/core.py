"""The solver of the C core for a `QuadraticProgram`."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from rumo.controllers.qp import QuadraticProgram
from rumo.kernel import Qp, Settings
from rumo.status import Status


@dataclass(frozen=True)
class Solution:
    """Answer of a solver: v (n,), multipliers (n + rows,) of bounds and rows, positive at upper limits."""

    v: np.ndarray
    multipliers: np.ndarray
    status: Status = Status.OPTIMAL
    iterations: int = 0
    conflict: tuple[int, ...] = ()
    seconds: float = np.nan
    factor_seconds: float = np.nan


class CoreQp:
    """Solves programs of one size, one after the other, and keeps its working set."""

    def __init__(self, variables: int, rows: int) -> None:
        self.variables, self.rows = variables, rows
        self._core = Qp(variables, rows)

    def solve(self, program: QuadraticProgram, warm: bool = False, **settings: float) -> Solution:
        """Solve, from the working set of the call before if `warm`; `settings` are those of `Settings`."""
        v, multipliers = np.full(self.variables, np.nan), np.full(self.variables + self.rows, np.nan)
        data = [np.ascontiguousarray(getattr(program, field.name)) for field in dataclasses.fields(program)]
        chosen = dataclasses.asdict(Settings(**settings))
        status, iterations, seconds, factor_seconds, conflict = self._core.solve(
            *data, settings=chosen, warm=warm, v=v, multipliers=multipliers
        )
        return Solution(v, multipliers, list(Status)[status], iterations, tuple(conflict), seconds, factor_seconds)


def solve(program: QuadraticProgram, **settings: float) -> Solution:
    """Solve from an empty working set."""
    return CoreQp(len(program.gradient), len(program.rows)).solve(program, **settings)
