"""All that decides a run, as plain data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, checked, whole_number
from rumo.controllers import Controller, RealTimeIteration
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, UnknownNameError
from rumo.estimation import Estimator
from rumo.model import Model
from rumo.problem import Problem
from rumo.references import ReferenceLike, as_reference
from rumo.registry import CONTROLLERS, DISCRETIZATIONS
from rumo.signals import Signals, Values
from rumo.simulation.faults import Fault
from rumo.simulation.foreign import PlantLike
from rumo.simulation.plant import Plant
from rumo.simulation.sensors import Sensors
from rumo.simulation.wind import Disturbance


@dataclass(frozen=True)
class ScenarioData:
    """All that decides a run, see `rumo.Scenario`."""

    problem: Problem
    plant: Model | Plant | PlantLike | str
    x: Values
    reference: ReferenceLike
    duration: float
    controller: str | type[Controller] = "rti"
    settings: object | None = None
    discretization: Discretization | str | None = None
    backend: str | None = None
    applied: Mapping[str, float] | ArrayLike | None = None
    sensors: Sensors = field(default_factory=Sensors)
    estimator: Estimator | None = None
    disturbances: Mapping[str, Disturbance] = field(default_factory=dict[str, Disturbance])
    faults: tuple[Fault, ...] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        dt = checked(self.problem, "problem", Problem).sampling_time
        if not dt <= self.duration < np.inf:
            raise ArgumentError("duration", f"{self.duration!r}", f"at least one sampling time of {dt:g} s, finite")
        whole_number(self.seed, "seed", 0)
        as_reference(self.reference)
        checked(self.sensors, "sensors", Sensors)
        if isinstance(self.estimator, type):
            raise ArgumentError("estimator", self.estimator.__name__, "settings such as Butterworth(cutoff=3.5)")
        as_mapping(self.disturbances, "disturbances")
        if not isinstance(self.faults, tuple):
            raise ArgumentError("faults", repr(self.faults), "a tuple such as (Missing(when=range(10, 15)),)")
        for fault in self.faults:
            checked(fault, "faults", Fault)
        self._check_faults()
        self._controller_class()

    @property
    def samples(self) -> int:
        """How many there are."""
        return round(self.duration / self.problem.sampling_time)

    def make_controller(self) -> Controller:
        """A new controller, as this scenario wants it."""
        kind: Any = self._controller_class()  # a class of the user's is made as ours are
        options: dict[str, Any] = {} if self.settings is None else {"settings": self.settings}
        if self.backend is not None:
            if not issubclass(kind, RealTimeIteration):
                raise ArgumentError("backend", repr(self.backend), f"nothing: {kind.__name__} has only one")
            options["backend"] = self.backend
        scheme = self.discretization
        if isinstance(scheme, str):
            if scheme not in DISCRETIZATIONS:
                raise UnknownNameError("discretization", scheme, DISCRETIZATIONS)
            scheme = DISCRETIZATIONS[scheme]()
        return kind(self.problem, scheme, **options)

    def _check_faults(self) -> None:
        """Raise for a fault of a signal that there is not."""
        model = self.problem.model
        names = model.states.names if self.sensors.measured is None else self.sensors.measured
        measured = Signals(dict.fromkeys(names, "as the plant says"), "measured")
        for fault in self.faults:
            fault.check(measured, model.inputs)

    def _controller_class(self) -> type[Controller]:
        kind = self.controller
        if isinstance(kind, str):
            if kind not in CONTROLLERS:
                raise UnknownNameError("controller", kind, CONTROLLERS)
            return CONTROLLERS[kind]
        if not (isinstance(kind, type) and issubclass(kind, Controller)):
            raise ArgumentError(
                "controller", repr(kind), f"one of {', '.join(CONTROLLERS)}, or a class", "Settings go to settings=."
            )
        return kind
