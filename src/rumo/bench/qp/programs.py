"""Programs that a controller meets on its way."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from rumo.bench.qp.core import CoreQp
from rumo.controllers.qp import QuadraticProgram
from rumo.controllers.reference import ReferenceRti
from rumo.problem import Problem
from rumo.signals import Array
from rumo.simulation.replay import Recording
from rumo.status import Status

PROGRAMS = 200
"""Of the first samples of a drive."""


class ProgramRecorder(ReferenceRti):
    """The reference controller, which keeps the programs that it solves in `recorded`."""

    recorded: list[QuadraticProgram]

    def _optimize(self, program: QuadraticProgram) -> tuple[Array, Status]:
        self.recorded.append(program)
        return super()._optimize(program)


def program_recorder(problem: Problem) -> ProgramRecorder:
    """A controller that has recorded nothing yet."""
    recorder = cast("ProgramRecorder", ProgramRecorder(problem))
    recorder.recorded = []
    return recorder


def record_programs(recording: Recording, most: int = PROGRAMS) -> list[QuadraticProgram]:
    """Programs of the first samples, as hard ones: not every solver knows soft rows."""
    recorder = program_recorder(recording.problem)
    for i in range(min(most, len(recording))):
        recorder.applied = recording.applied[i]
        recorder.step(recording.x[i], recording.reference[i])
    return as_hard(recorder.recorded)


def as_hard(programs: list[QuadraticProgram]) -> list[QuadraticProgram]:
    """The same programs with hard rows, but for those whose rows cannot all hold."""
    hard = [replace(p, l1=np.full(len(p.rows), np.inf)) for p in programs]
    return [p for p in hard if CoreQp(*p.rows.shape[::-1]).solve(p).status is Status.OPTIMAL]
