"""The C core from Python: arrays in, arrays out. Knows neither CasADi nor problems."""

from rumo.kernel._core import Controller as Core
from rumo.kernel._core import Qp
from rumo.kernel.description import Description, StageProgram, describe
from rumo.kernel.export import problem_source
from rumo.kernel.settings import Settings
from rumo.kernel.tailored import Build, portable, tailored

__all__ = [
    "Build",
    "Core",
    "Description",
    "Qp",
    "Settings",
    "StageProgram",
    "describe",
    "portable",
    "problem_source",
    "tailored",
]
