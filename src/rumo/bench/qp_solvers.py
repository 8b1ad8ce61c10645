"""The QP solver of the C core and others, on the programs of a recorded drive."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from time import perf_counter_ns
from typing import Any

import numpy as np

from rumo.controllers.qp import QuadraticProgram
from rumo.controllers.reference import ReferenceRti
from rumo.kernel import Qp, Settings
from rumo.signals import Array
from rumo.simulation.replay import Recording
from rumo.status import Status

OTHERS = ("daqp", "piqp", "quadprog", "clarabel", "proxqp")
"""Solvers for dense programs that the package qpsolvers calls, where they are installed."""
PROGRAMS, ROUNDS = 200, 5


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
            *_arrays(program), settings=chosen, warm=warm, v=v, multipliers=multipliers
        )
        return Solution(v, multipliers, list(Status)[status], iterations, tuple(conflict), seconds, factor_seconds)


def _arrays(program: QuadraticProgram) -> list[Array]:
    return [np.ascontiguousarray(getattr(program, field.name)) for field in dataclasses.fields(program)]


class _Recorder(ReferenceRti):
    """Keeps the programs that it solves."""

    recorded: list[QuadraticProgram]

    def _optimize(self, program: QuadraticProgram) -> tuple[Array, Status]:
        self.recorded.append(program)
        return super()._optimize(program)


def record_programs(recording: Recording, most: int = PROGRAMS) -> list[QuadraticProgram]:
    """Programs of the first samples, as hard ones: not every solver knows soft rows."""
    recorder = _Recorder(recording.problem)
    assert isinstance(recorder, _Recorder)
    recorder.recorded = []
    for i in range(min(most, len(recording))):
        recorder.applied = recording.applied[i]
        recorder.step(recording.x[i], recording.reference[i])
    return as_hard(recorder.recorded)


def as_hard(programs: list[QuadraticProgram]) -> list[QuadraticProgram]:
    """The same programs with hard rows, but for those whose rows cannot all hold."""
    hard = [dataclasses.replace(p, l1=np.full(len(p.rows), np.inf)) for p in programs]
    return [p for p in hard if _call("core", p)() is not None]


def installed() -> list[str]:
    """Names of the solvers that work here: the core's, and those that qpsolvers finds."""
    if find_spec("qpsolvers") is None:
        return ["core"]
    import qpsolvers

    return ["core", *(name for name in OTHERS if name in qpsolvers.available_solvers)]


def measure_solvers(programs: list[QuadraticProgram], names: list[str]) -> dict[str, dict[str, Any]]:
    """How long each solver takes from Python, from nothing to the solution.

    Returns
    -------
    dict
        By name: `us` (n,), the median of a few rounds for each program [us]; `solved`, how many it solved;
        `difference`, the largest of any v from the core's, in units of the inputs' ranges.
    """
    answers = [_call("core", p)() for p in programs]
    calls = {name: [_call(name, p) for p in programs] for name in names}
    times = {name: np.zeros((ROUNDS, len(programs))) for name in names}
    far: dict[str, list[float]] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of dense matrices turned into sparse ones
        for turn in range(ROUNDS):
            for name in names:
                far[name] = []
                for i, (call, answer) in enumerate(zip(calls[name], answers, strict=True)):
                    start = perf_counter_ns()
                    v = call()
                    times[name][turn, i] = 1e-3 * (perf_counter_ns() - start)
                    if v is not None and answer is not None:
                        far[name].append(float(np.abs(v - answer).max()))
    return {
        name: {
            "us": np.median(times[name], axis=0),
            "solved": len(far[name]),
            "difference": max(far[name], default=np.nan),
        }
        for name in names
    }


def _call(name: str, program: QuadraticProgram) -> Callable[[], Array | None]:
    """A function that solves a program and returns v, or None without a solution."""
    if name == "core":
        core, data, settings = Qp(*program.rows.shape[::-1]), _arrays(program), dataclasses.asdict(Settings())

        def solve_by_core() -> Array | None:
            v, multipliers = np.empty(len(program.gradient)), np.empty(sum(program.rows.shape))
            status, *_ = core.solve(*data, settings=settings, warm=False, v=v, multipliers=multipliers)
            return v if status == 0 else None

        return solve_by_core
    import qpsolvers

    rows = np.vstack([program.rows, -program.rows])
    limits = np.r_[program.row_upper, -program.row_lower]
    kept = np.isfinite(limits)
    problem = qpsolvers.Problem(
        program.hessian, program.gradient, rows[kept], limits[kept], None, None, program.lower, program.upper
    )

    def solve_by_other() -> Array | None:
        answer = qpsolvers.solve_problem(problem, solver=name)
        return answer.x if answer.found else None

    return solve_by_other
