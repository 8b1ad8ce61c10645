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
from rumo.discretization import ImplicitEuler
from rumo.errors import ArgumentError, CallOrderError, PlantError, RumoError, ShapeError, UnknownNameError
from rumo.model import Model, Output, Parameter
from rumo.plan import Plan
from rumo.problem import Problem
from rumo.status import Status
from rumo.terms import Bounds, Constraint, Penalty, Weight
from rumo.version import __version__

if TYPE_CHECKING:
    from rumo.report.show import show
    from rumo.simulation.loop import simulate

__all__ = [
    "ArgumentError",
    "Bounds",
    "CallOrderError",
    "Constraint",
    "Controller",
    "DirectNlp",
    "ImplicitEuler",
    "InnovationGate",
    "LinearTimeVarying",
    "Model",
    "NlpOptions",
    "Output",
    "Parameter",
    "Penalty",
    "Plan",
    "PlantError",
    "Problem",
    "QpOptions",
    "RealTimeIteration",
    "RumoError",
    "ShapeError",
    "Status",
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
