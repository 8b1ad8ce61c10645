"""Nonlinear model predictive control of stiff systems, road vehicles first."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rumo.controllers import (
    Controller,
    DirectNlp,
    InnovationGate,
    LinearTimeVarying,
    NlpOptions,
    QpOptions,
    RealTimeIteration,
)
from rumo.discretization import (
    Bdf2,
    Discretization,
    ExplicitEuler,
    Gauss2,
    ImplicitEuler,
    ImplicitMidpoint,
    Radau2,
    Radau3,
    Rk4,
    Sdirk2,
    Trapezoidal,
)
from rumo.errors import (
    ArgumentError,
    CallOrderError,
    FrozenError,
    PlantError,
    RumoError,
    ShapeError,
    UnknownAttributeError,
    UnknownNameError,
)
from rumo.grid import Grid, IncrementBlocks, InputBlocks, MoveBlocks
from rumo.model import Algebraic, Model, Output, Parameter
from rumo.plan import Plan
from rumo.problem import Problem
from rumo.status import Status
from rumo.terms import Bounds, Constraint, Penalty, Weight
from rumo.version import __version__

if TYPE_CHECKING:
    from rumo.report.show import show
    from rumo.simulation.loop import simulate

__all__ = [
    "Algebraic",
    "ArgumentError",
    "Bdf2",
    "Bounds",
    "CallOrderError",
    "Constraint",
    "Controller",
    "DirectNlp",
    "Discretization",
    "ExplicitEuler",
    "FrozenError",
    "Gauss2",
    "Grid",
    "ImplicitEuler",
    "ImplicitMidpoint",
    "IncrementBlocks",
    "InnovationGate",
    "InputBlocks",
    "LinearTimeVarying",
    "Model",
    "MoveBlocks",
    "NlpOptions",
    "Output",
    "Parameter",
    "Penalty",
    "Plan",
    "PlantError",
    "Problem",
    "QpOptions",
    "Radau2",
    "Radau3",
    "RealTimeIteration",
    "Rk4",
    "RumoError",
    "Sdirk2",
    "ShapeError",
    "Status",
    "Trapezoidal",
    "UnknownAttributeError",
    "UnknownNameError",
    "Weight",
    "__version__",
    "show",
    "simulate",
]

# A controller alone needs neither SciPy nor a plotting library.
_LAZY = {"simulate": "rumo.simulation.loop", "show": "rumo.report.show"}


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(import_module(_LAZY[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
