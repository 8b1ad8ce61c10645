"""The C core from Python: arrays in, arrays out. Knows neither CasADi nor problems."""

from rumo.kernel._core import GATE_STAGES, SLACK_TOLERANCE, Filter, Integrator, Qp
from rumo.kernel._core import Controller as Core
from rumo.kernel.curve import Curve
from rumo.kernel.description import BOUNDS, NUMBERS, Description, StageProgram, as_numbers, describe
from rumo.kernel.export import problem_source
from rumo.kernel.guard import Guard, Trajectory
from rumo.kernel.settings import Settings
from rumo.kernel.system import Ending, SystemProgram, can_integrate, describe_system
from rumo.kernel.tailored import Build, portable, tailored, tailored_right_side

__all__ = [
    "BOUNDS",
    "GATE_STAGES",
    "NUMBERS",
    "SLACK_TOLERANCE",
    "Build",
    "Core",
    "Curve",
    "Description",
    "Ending",
    "Filter",
    "Guard",
    "Integrator",
    "Qp",
    "Settings",
    "StageProgram",
    "SystemProgram",
    "Trajectory",
    "as_numbers",
    "can_integrate",
    "describe",
    "describe_system",
    "portable",
    "problem_source",
    "tailored",
    "tailored_right_side",
]
