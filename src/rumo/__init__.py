"""Nonlinear model predictive control of stiff systems, road vehicles first."""

from importlib import import_module
from importlib.util import find_spec
from math import inf
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from rumo.interrupts import interruptible
from rumo.version import __version__

if TYPE_CHECKING:
    from rumo.actuation import Actuation, Actuator, with_actuators
    from rumo.campaigns.conduct import campaign
    from rumo.campaigns.falsification import Falsification, falsify
    from rumo.campaigns.specification import Campaign
    from rumo.campaigns.tuning.conduct import tune
    from rumo.campaigns.tuning.specification import Tuning
    from rumo.controllers import (
        Controller,
        ControllerSettings,
        DirectNlp,
        InnovationGate,
        LinearTimeVarying,
        LtvSettings,
        NlpSettings,
        QpOptions,
        RealTimeIteration,
        Settings,
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
        FileError,
        ForkedError,
        FrozenError,
        PlantError,
        PoorDampingWarning,
        RumoError,
        ShapeError,
        UnknownAttributeError,
        UnknownNameError,
        UnstableModeWarning,
    )
    from rumo.estimation import Butterworth, ExtendedKalman
    from rumo.grid import Grid, IncrementBlocks, InputBlocks, MoveBlocks
    from rumo.measurements import Measurement
    from rumo.model import Algebraic, Model, Output, Parameter
    from rumo.plan import Plan
    from rumo.problem import Problem
    from rumo.report.show import show
    from rumo.scenarios import Recipe
    from rumo.simulation import faults
    from rumo.simulation.loop import ClosedLoop
    from rumo.simulation.plant import Plant
    from rumo.simulation.recorder import Recorder
    from rumo.simulation.sample import Sample
    from rumo.simulation.scenario import Scenario, simulate
    from rumo.simulation.sensors import Sensors
    from rumo.status import Status
    from rumo.terms import Bounds, Constraint, Penalty, Weight

__all__ = [
    "Actuation",
    "Actuator",
    "Algebraic",
    "ArgumentError",
    "Bdf2",
    "Bounds",
    "Butterworth",
    "CallOrderError",
    "Campaign",
    "ClosedLoop",
    "Constraint",
    "Controller",
    "ControllerSettings",
    "DirectNlp",
    "Discretization",
    "ExplicitEuler",
    "ExtendedKalman",
    "Falsification",
    "FileError",
    "ForkedError",
    "FrozenError",
    "Gauss2",
    "Grid",
    "ImplicitEuler",
    "ImplicitMidpoint",
    "IncrementBlocks",
    "InnovationGate",
    "InputBlocks",
    "LinearTimeVarying",
    "LtvSettings",
    "Measurement",
    "Model",
    "MoveBlocks",
    "NlpSettings",
    "Output",
    "Parameter",
    "Penalty",
    "Plan",
    "Plant",
    "PlantError",
    "PoorDampingWarning",
    "Problem",
    "QpOptions",
    "Radau2",
    "Radau3",
    "RealTimeIteration",
    "Recipe",
    "Recorder",
    "Rk4",
    "RumoError",
    "Sample",
    "Scenario",
    "Sdirk2",
    "Sensors",
    "Settings",
    "ShapeError",
    "Status",
    "Trapezoidal",
    "Tuning",
    "UnknownAttributeError",
    "UnknownNameError",
    "UnstableModeWarning",
    "Weight",
    "__version__",
    "campaign",
    "falsify",
    "faults",
    "show",
    "simulate",
    "tune",
    "with_actuators",
]

_ROOMS = (
    "errors",
    "status",
    "model",
    "actuation",
    "grid",
    "terms",
    "measurements",
    "problem",
    "plan",
    "discretization",
    "controllers",
    "estimation",
    "simulation",
    "report.show",
    "scenarios",
    "campaigns.conduct",
    "campaigns.specification",
    "campaigns.tuning",
    "campaigns.falsification",
)
"""Where public names are, which are loaded when they are asked for, as modules are: help on a command needs no CasADi,
a controller alone neither SciPy nor a plotting library."""


def __getattr__(name: str) -> Any:
    with interruptible(inf):  # a package that is half imported cannot be imported again
        if name in __all__:
            modules = (import_module(f"rumo.{room}") for room in _ROOMS)
            return globals().setdefault(
                name, next(getattr(module, name) for module in modules if hasattr(module, name))
            )
        if name[0] != "_" and find_spec(f"rumo.{name}"):
            return import_module(f"rumo.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *(module.name for module in iter_modules(__path__))})
