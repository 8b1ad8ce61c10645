"""How long each QP solver takes."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from time import perf_counter_ns
from typing import Any

import numpy as np

from rumo.bench.qp.condensed import QuadraticProgram
from rumo.bench.qp.core import arrays
from rumo.bench.qp.others import posed
from rumo.kernel import Qp, Settings
from rumo.signals import Array

ROUNDS = 5
"""The solvers take turns."""


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
        core, data, settings = Qp(*program.rows.shape[::-1]), arrays(program), dataclasses.asdict(Settings())

        def solve_by_core() -> Array | None:
            v, multipliers = np.empty(len(program.gradient)), np.empty(sum(program.rows.shape))
            status, *_ = core.solve(*data, settings=settings, warm=False, v=v, multipliers=multipliers)
            return v if status == 0 else None

        return solve_by_core
    import qpsolvers

    problem = posed(program)

    def solve_by_other() -> Array | None:
        answer = qpsolvers.solve_problem(problem, solver=name)
        return answer.x[: len(program.gradient)] if answer.found and answer.x is not None else None

    return solve_by_other
