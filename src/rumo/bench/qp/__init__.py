"""The QP solver of the C core and others, on the programs of a recorded drive."""

from rumo.bench.qp.condensed import QuadraticProgram, condense
from rumo.bench.qp.core import CoreQp, Solution
from rumo.bench.qp.measure import measure_solvers
from rumo.bench.qp.others import installed, posed
from rumo.bench.qp.programs import ProgramRecorder, as_hard, record_programs

__all__ = [
    "CoreQp",
    "ProgramRecorder",
    "QuadraticProgram",
    "Solution",
    "as_hard",
    "condense",
    "installed",
    "measure_solvers",
    "posed",
    "record_programs",
]
