"""All that decides a run, as plain data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isclose
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import as_mapping, checked, whole_number
from rumo.controllers import Controller, RealTimeIteration
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, UnknownNameError
from rumo.estimation import Estimator
from rumo.estimation.base import check_estimator
from rumo.model import Model
from rumo.problem import Problem
from rumo.references import ReferenceLike, as_reference
from rumo.registry import CONTROLLERS, DISCRETIZATIONS
from rumo.signals import Values
from rumo.simulation.faults import Fault
from rumo.simulation.foreign import PlantLike
from rumo.simulation.plant import Plant
from rumo.simulation.sensors import Sensors
from rumo.simulation.wind import Disturbance, check_disturbance

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Scenario:
    """A run before it is run: who controls what, what is wanted, and what gets in the way.

    It is data: it can be copied, changed with `dataclasses.replace`, and sent to another process, as long as what it is
    made of can. A lambda cannot; `rumo.references` has references that can.

    Parameters
    ----------
    problem : Problem
        What the controller solves.
    plant : Model, Plant, PlantLike or str
        What is controlled; a `Plant` where tolerances or scales matter, or a name in `rumo.registry.MODELS`. Its inputs
        include the controller's, further ones stay 0.
    x : mapping or sequence, (plant nx,)
        Initial state of the plant.
    reference : Reference, callable, or mapping of str to float
        What lies ahead; times (n,) [s] -> signal -> values (n,); or values to be held.
    duration : float
        [s].
    controller : str or type
        Name in `rumo.registry.CONTROLLERS`, or a class of yours.
    settings : object, optional
        Of the controller; its defaults if not given.
    discretization : Discretization or str, optional
        Of the controller: a scheme, or a name in `rumo.registry.DISCRETIZATIONS`; implicit Euler if not given.
    backend : str, optional
        Of the real-time iteration.
    applied : mapping, or array_like (nu,) or (max(delay, 1), nu), optional
        Inputs decided before the start; the safe input if not given.
    sensors : Sensors
        What is measured, and how well; the controller's states, exactly, if not given.
    estimator : Estimator, optional
        From measurements to the state that the controller is told; measured states pass unchanged without one.
    disturbances : mapping of str to Disturbance
        Parameters of the plant that vary with time, such as the wind.
    faults : tuple of Fault
        What goes wrong, or a list of them. Those of the same samples act in this order.
    seed : int
        Of noise and disturbances: the same seed gives the same run.

    Raises
    ------
    ArgumentError
        If a value cannot work. What needs plant and controller is checked when there is a loop.
    """

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
    faults: Sequence[Fault] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        dt = checked(self.problem, "problem", Problem).sampling_time
        duration = self.duration
        if not isinstance(duration, int | float | np.number) or not (dt <= duration < np.inf or isclose(duration, dt)):
            raise ArgumentError("duration", repr(duration), f"at least one sampling time of {dt:g} s, finite")
        whole_number(self.seed, "seed", 0)
        as_reference(self.reference)
        checked(self.sensors, "sensors", Sensors)
        if self.estimator is not None:
            check_estimator(self.estimator)
        for name, disturbance in as_mapping(self.disturbances, "disturbances").items():
            check_disturbance(disturbance, f"disturbances[{name!r}]")
        if not isinstance(self.faults, tuple | list):
            raise ArgumentError("faults", repr(self.faults), "a tuple such as (Missing(when=range(10, 15)),)")
        for fault in self.faults:
            checked(fault, "faults", Fault)
        object.__setattr__(self, "faults", tuple(self.faults))
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

    def run(
        self, controller: Controller | None = None, progress: Callable[[int, int], None] | None = None
    ) -> xr.Dataset:
        """Run it, and return the log.

        Parameters
        ----------
        controller : Controller, optional
            One that is there already, to save setting it up again; it is reset first.
        progress : callable, optional
            Called with (samples done, all samples).

        Returns
        -------
        xarray.Dataset
            See the page on logs.

        Raises
        ------
        PlantError, Interrupted
            If the plant cannot be integrated, or Ctrl-C came; their `log` has the run so far.
        """
        from rumo.simulation.loop import ClosedLoop  # both run scenarios
        from rumo.simulation.run import record

        return record(ClosedLoop(self, controller), progress)

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
