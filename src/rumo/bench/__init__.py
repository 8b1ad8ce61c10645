"""How long a step takes: one recorded drive, replayed through every controller in one run."""

from rumo.bench.measuring import measure
from rumo.bench.recording import SCENARIOS, WEAK, record
from rumo.bench.report import summary
from rumo.bench.runners import RUNNERS

__all__ = ["RUNNERS", "SCENARIOS", "WEAK", "measure", "record", "summary"]
