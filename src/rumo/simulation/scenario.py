"""A run as plain data: all that decides it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from math import isclose
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.actuation import Actuation
from rumo.checks import LARGEST, as_mapping, checked, checked_items, whole_number
from rumo.controllers import Controller, RealTimeIteration
from rumo.discretization import Discretization
from rumo.errors import ArgumentError, UnknownNameError
from rumo.estimation import Estimator
from rumo.estimation.base import check_estimator
from rumo.model import Model
from rumo.problem import Problem
from rumo.references import ReferenceLike, as_reference
from rumo.registry import CONTROLLERS, DISCRETIZATIONS
from rumo.signals import Signals, Values
from rumo.simulation.disturbances import check_disturbance
from rumo.simulation.faults import Fault
from rumo.simulation.foreign import PlantLike, check_plant, parameters_of
from rumo.simulation.loop import ClosedLoop
from rumo.simulation.monitors import DelayWatch
from rumo.simulation.place import DisturbanceByState
from rumo.simulation.plant import Plant
from rumo.simulation.run import record
from rumo.simulation.sensors import Sensors
from rumo.simulation.wind import Disturbance

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Scenario:
    """A run before it is run: who controls what, what is wanted, and what gets in the way.

    It is data: it can be copied, changed with `dataclasses.replace`, and sent to another process, as long as what it is
    made of can. A lambda cannot; `rumo.references` has references that can. Arrays and mappings are copied.

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
    settings : object or mapping of str to object, optional
        Of the controller; its defaults if not given, and what a mapping such as `{"gate": None}` does not name.
    discretization : Discretization or str, optional
        Of the controller: a scheme, or a name in `rumo.registry.DISCRETIZATIONS`; the problem's if not given.
    backend : str, optional
        Of the real-time iteration.
    applied : mapping, or array_like (nu,) or (max(delay, 1), nu), optional
        Inputs decided before the start; the safe input if not given.
    sensors : Sensors
        What is measured, and how well; the controller's states, exactly, if not given.
    estimator : Estimator, optional
        From measurements to the state that the controller is told; measured states pass unchanged without one.
    actuation : Actuation, optional
        What lies between measurements and what their commands do; the problem's delay if not given.
    believed : Actuation, optional
        The same, as controller and estimator believe: the delay that is compensated. As it is, if not given.
    monitors : mapping of str to DelayWatch
        They find how late responses really are.
    observed : Model, optional
        Whose states are measured and estimated, if not the controller's model: one of the same inputs. The reference
        says what they mean for the controller, by `locate`: where a car at p_x, p_y is beside a path.
    disturbances : mapping of str to Disturbance or DisturbanceByState
        Parameters of the plant that vary with time, such as the wind, or with its state, such as friction `ByPlace`.
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
    settings: object | Mapping[str, Any] | None = None
    discretization: Discretization | str | None = None
    backend: str | None = None
    applied: Mapping[str, float] | ArrayLike | None = None
    sensors: Sensors = field(default_factory=Sensors)
    estimator: Estimator | None = None
    actuation: Actuation | None = None
    believed: Actuation | None = None
    monitors: Mapping[str, DelayWatch] = field(default_factory=dict[str, DelayWatch])
    observed: Model | None = None
    disturbances: Mapping[str, Disturbance | DisturbanceByState] = field(
        default_factory=dict[str, Disturbance | DisturbanceByState]
    )
    faults: Sequence[Fault] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        dt = checked(self.problem, "problem", Problem).sampling_time
        duration = self.duration
        if not isinstance(duration, int | float | np.number) or not (dt <= duration < np.inf or isclose(duration, dt)):
            raise ArgumentError("duration", repr(duration), f"at least one sampling time of {dt:g} s, finite")
        if duration > LARGEST * dt:
            raise ArgumentError("duration", repr(duration), f"at most {LARGEST * dt:.4g} s, which is {LARGEST} samples")
        whole_number(self.seed, "seed", 0, most=np.inf)
        check_plant(self.plant)
        as_reference(self.reference)
        checked(self.sensors, "sensors", Sensors)
        if self.estimator is not None:
            check_estimator(self.estimator)
        for name, actuation in (("actuation", self.actuation), ("believed", self.believed)):
            if actuation is not None:
                checked(actuation, name, Actuation).check(self.problem.model.inputs, name)
        checked_items(self.monitors, "monitors", DelayWatch, 'DelayWatch("steering_rate", "delta")')
        if self.observed is not None:
            checked(self.observed, "observed", Model)
        disturbances = as_mapping(self.disturbances, "disturbances")
        known = parameters_of(self.plant)
        for name, disturbance in disturbances.items():
            check_disturbance(disturbance, f"disturbances[{name!r}]", known.get(name))
        if not isinstance(self.faults, tuple | list):
            raise ArgumentError("faults", repr(self.faults), "a tuple such as (Missing(when=range(10, 15)),)")
        for fault in self.faults:
            checked(fault, "faults", Fault)
        own = {"x": _own(self.x), "applied": _own(self.applied), "disturbances": disturbances}
        for name, value in {**own, "faults": tuple(self.faults)}.items():
            object.__setattr__(self, name, value)
        self._check_faults()
        self._controller_class()
        self._scheme()

    @property
    def samples(self) -> int:
        """How many there are."""
        return round(self.duration / self.problem.sampling_time)

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
        Exception
            Whatever a part of it raises: `PlantError` if the plant cannot be integrated, `Interrupted` on Ctrl-C. Its
            `log` has the run so far, with `complete="no"` among the attributes.
        """
        return record(ClosedLoop(self, controller), progress)

    def make_controller(self) -> Controller:
        """A new controller, as this scenario wants it."""
        kind: Any = self._controller_class()  # a class of the user's is made as ours are
        options: dict[str, Any] = {} if self.settings is None else {"settings": self.settings}
        if isinstance(self.settings, Mapping):
            options = as_mapping(self.settings, "settings")
        if self.backend is not None:
            if not issubclass(kind, RealTimeIteration):
                raise ArgumentError("backend", repr(self.backend), f"nothing: {kind.__name__} has only one")
            options["backend"] = self.backend
        return kind(self.problem, self._scheme(), **options)

    def _check_faults(self) -> None:
        """Raise for a fault of a signal that there is not."""
        model = self.problem.model
        seen = self.observed or model
        measured = Signals(dict.fromkeys(self.sensors.names(seen), "as the plant says"), "measured")
        for fault in self.faults:
            fault.check(measured, model.inputs)

    def _scheme(self) -> Discretization | None:
        scheme = self.discretization
        if not isinstance(scheme, str):
            return scheme
        if scheme not in DISCRETIZATIONS:
            raise UnknownNameError("discretization", scheme, DISCRETIZATIONS)
        return DISCRETIZATIONS[scheme]()

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


def _own(values: Any) -> Any:
    return dict(values) if isinstance(values, Mapping) else deepcopy(values)


def simulate(
    controller: Controller,
    plant: Model | Plant | PlantLike | str,
    x: Values,
    reference: ReferenceLike,
    duration: float,
    *,
    applied: Mapping[str, float] | ArrayLike | None = None,
    seed: int = 0,
    sensors: Sensors | None = None,
    estimator: Estimator | None = None,
    disturbances: Mapping[str, Disturbance | DisturbanceByState] | None = None,
    faults: Sequence[Fault] = (),
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Run a controller in closed loop with a plant: a `Scenario` with a controller that is there already.

    At each sample the plant is measured, the controller computes a command, and the command computed `delay` samples
    ago is held until the next sample.

    Parameters
    ----------
    controller : Controller
        It is reset first.
    plant : Model, Plant, PlantLike or str
        What is controlled; a `Plant` where tolerances or scales matter. Its inputs include the controller's, further
        ones stay 0; each state of the controller's model is one of its states or outputs, in the same unit.
    x : mapping or sequence, (plant nx,)
        Initial state of the plant.
    reference : Reference, callable, or mapping of str to float
        What lies ahead; times (n,) [s] -> signal -> values (n,); or values to be held.
    duration : float
        [s].
    applied : mapping, or array_like (nu,) or (max(delay, 1), nu), optional
        Inputs decided before the start; the safe input if not given.
    seed : int
        Of noise and disturbances: the same seed gives the same log, but for timings.
    sensors : Sensors, optional
        Exact states if not given.
    estimator : Estimator, optional
        From measurements to the state that the controller is told; measured states pass unchanged without one.
    disturbances : mapping of str to Disturbance or DisturbanceByState, optional
        Plant parameters that vary with time, such as the wind, or with its state.
    faults : sequence of Fault
        What goes wrong.
    progress : callable, optional
        Called with (samples done, all samples).

    Returns
    -------
    xarray.Dataset
        See the page on logs; save it with `rumo.simulation.save(log, "run.nc")`.

    Raises
    ------
    ArgumentError
        If names or shapes don't fit.
    Exception
        Whatever a part of the run raises, see `Scenario.run`.
    """
    scenario = Scenario(
        checked(controller, "controller", Controller).problem,
        plant,
        x,
        reference,
        duration,
        controller=type(controller),
        applied=applied,
        sensors=Sensors() if sensors is None else sensors,
        estimator=estimator,
        disturbances=disturbances or {},
        faults=faults,
        seed=seed,
    )
    return scenario.run(controller, progress)
