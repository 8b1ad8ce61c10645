"""Programs that a controller meets on its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rumo.bench.qp.condensed import QuadraticProgram, condense
from rumo.bench.qp.core import CoreQp
from rumo.controllers import Controller, QpOptions, Settings
from rumo.controllers.engines.conditions import SparseProgram
from rumo.controllers.engines.guarded import Guarded
from rumo.controllers.engines.numpy import NumpyRti
from rumo.controllers.engines.qp import Solution, solve
from rumo.problem import Problem
from rumo.simulation.replay import Recording
from rumo.status import Status
from rumo.transcription import Transcription

PROGRAMS = 200
"""Of the first samples of a drive."""


class ProgramRecorder(Controller[Settings]):
    """The reference's real-time iteration, which keeps the programs that it solves, condensed, in `recorded`."""

    name = "rti"

    def __init__(self, problem: Problem) -> None:
        self.recorded: list[QuadraticProgram] = []
        transcription, settings = Transcription(problem), Settings(trusted_step=np.inf)
        engine = Guarded(NumpyRti(transcription, settings, self._optimize), settings, "reference")
        super().__init__(transcription, engine, settings)

    def _optimize(self, program: SparseProgram, options: QpOptions) -> Solution:
        self.recorded.append(condense(program))
        return solve(program, options)


def record_programs(recording: Recording, most: int = PROGRAMS) -> list[QuadraticProgram]:
    """Programs of the first samples, as hard ones: not every solver knows soft rows."""
    recorder = ProgramRecorder(recording.problem)
    for i in range(min(most, len(recording))):
        recorder.applied = recording.applied[i]
        recorder.step(recording.x[i], recording.reference[i])
    return as_hard(recorder.recorded)


def as_hard(programs: list[QuadraticProgram]) -> list[QuadraticProgram]:
    """The same programs with hard rows, but for those whose rows cannot all hold."""
    hard = [replace(p, l1=np.full(len(p.rows), np.inf)) for p in programs]
    return [p for p in hard if CoreQp(*p.rows.shape[::-1]).solve(p).status is Status.OPTIMAL]
