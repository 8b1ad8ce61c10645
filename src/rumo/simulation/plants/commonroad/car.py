"""A car of the CommonRoad vehicle models as a plant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from rumo.checks import finite_number, positive_number, whole_number
from rumo.errors import ArgumentError, UnknownNameError
from rumo.extras import required
from rumo.model import Parameter
from rumo.signals import Array, Signals
from rumo.simulation.plants.commonroad.forms import FORMS
from rumo.simulation.plants.integration import integrated
from rumo.vehicles import VEHICLES, Acceleration, SteeringRate, VehicleParameters
from rumo.vehicles.chassis import LEAST_FRICTION

INPUTS = {**Acceleration().inputs(("f", "r")), **SteeringRate.inputs}
CARS = MappingProxyType({1: "commonroad-1", 2: "passenger", 3: "commonroad-3"})
"""The cars' names in `rumo.vehicles.VEHICLES`."""
LATERAL = MappingProxyType({"mb": {1: 9.2, 2: 8.8, 3: 8.0}})
"""Lateral acceleration at which an inner wheel lifts [m/s^2], where that is before the tyres slide: the least of
`rumo.studies.drive.steady_bend` to both sides at 12, 20, 30 and 40 m/s."""
TRUCK = 4
"""A parameter set that has but a wheelbase, and a trailer."""


class CommonRoadCar:
    """A car as Althoff and Wuersching model it, "CommonRoad: Vehicle Models" (2020), integrated by LSODA.

    | model | what it is | reference point | what is Rumo's to say |
    |---|---|---|---|
    | `ks` | kinematic single track | rear axle | position of the centre of gravity, v_y and omega are outputs |
    | `kst` | the same with a trailer | rear axle | likewise |
    | `st` | single track, linear tyres whose grip has no end | centre of gravity | v_x, v_y are outputs |
    | `std` | single track, magic formula, wheel speeds | centre of gravity | v_x, v_y are outputs; parameter mu |
    | `mb` | 29 states: body, axles, springs, four wheels | centre of gravity of the sprung mass | parameter mu |

    All have inputs acceleration [m/s^2] and steering_rate [rad/s], and the states of `rolling_bicycle` among their
    states and outputs. The limits of their rates, angles and accelerations are CommonRoad's own. In `mb`, v_z and z
    point down, and roll is positive where the left side is lower; outputs load_fl to load_rr are loads of tyres [N].

    `st` and `mb` have no equations for reverse, so braking ends at standstill. `mb` switches to a car without slip
    below 0.1 m/s, and pulls away with wheels that spin; in a spin it divides by the speed of wheels that roll
    backwards, 0, and the sample ends in a `PlantError`.

    Parameters
    ----------
    model : str
        Of the table.
    vehicle : int
        1, a Ford Escort, 2, a BMW 320i, or 3, a VW Vanagon; for `ks` and `kst` also 4, a truck.
    sampling_time : float
        For which the inputs are held [s].
    tolerance : float
        Of the integration, absolute and relative.
    trailer : float, optional
        Wheelbase of the trailer of `kst` [m], from the hitch on the car's rear axle to its own. The truck has one of
        8.1 m.

    Attributes
    ----------
    car : VehicleParameters or None
        The same car for predictions, such as `frenet_bicycle(plant.car, drive=Acceleration())`, without drag as these
        models are, and with the lateral acceleration that `mb` stands in its limits; None for the truck.
    own : object
        CommonRoad's parameters.

    Raises
    ------
    ArgumentError
        If a value cannot work, or commonroad-vehicle-models is not installed: `pip install "rumo[commonroad]"`.
    """

    def __init__(
        self,
        model: str,
        vehicle: int = 2,
        *,
        sampling_time: float,
        tolerance: float = 1e-8,
        trailer: float | None = None,
    ) -> None:
        if model not in FORMS:
            raise UnknownNameError("model", model, FORMS)
        kinematic = model in ("ks", "kst")
        self._vehicle = whole_number(vehicle, "vehicle", 1, TRUCK if kinematic else TRUCK - 1)
        self._tolerance = positive_number(tolerance, "tolerance")
        self.sampling_time = positive_number(sampling_time, "sampling_time")
        parameters = required("vehiclemodels.vehicle_parameters", "commonroad", "CommonRoadCar")
        self.own: Any = parameters.setup_vehicle_parameters(self._vehicle)
        self.model, form = model, FORMS[model]
        if not form.reverse:
            self.own.longitudinal.v_min = 0.0
        if trailer is not None:
            if model != "kst":
                raise ArgumentError("trailer", repr(trailer), f"none: {model} has no trailer")
            self.own.trailer.l_wb = positive_number(trailer, "trailer")
        elif model == "kst" and self.own.trailer.l_wb is None:
            raise ArgumentError("trailer", "None", "the wheelbase of the trailer [m]", "Vehicle 4 has one of its own.")
        self.name = f"CommonRoad {model}, vehicle {vehicle}"
        self.car: VehicleParameters | None = _as_modelled(model, vehicle) if vehicle in CARS else None
        self.states = Signals(form.states, "states")
        self.inputs = Signals(INPUTS, "inputs")
        self.outputs = Signals(form.outputs, "outputs")
        self.parameters: dict[str, Parameter] = {}
        if form.friction:
            tyre = self.own.tire
            self.parameters["mu"] = Parameter("1", tyre.p_dy1)
            self._frictions = {"p_dx1": tyre.p_dx1 / tyre.p_dy1, "p_dy1": 1.0}

    def start(
        self,
        p_x: float = 0.0,
        p_y: float = 0.0,
        psi: float = 0.0,
        v_x: float = 0.0,
        v_y: float = 0.0,
        omega: float = 0.0,
        delta: float = 0.0,
    ) -> dict[str, float]:
        """State of a car in this motion, with wheels that roll: `Scenario(x=car.start(v_x=20.0))`.

        `mb` begins upright, 2 cm above where its springs settle.

        Parameters
        ----------
        p_x, p_y : float
            Of the centre of gravity [m].
        psi : float
            Heading [rad].
        v_x, v_y : float
            Velocity of the centre of gravity, forward and to the left [m/s].
        omega : float
            Yaw rate [rad/s]. It and v_y follow from the steering angle in `ks` and `kst`, which leave them out.
        delta : float
            Steering angle [rad].
        """
        motion = {"p_x": p_x, "p_y": p_y, "psi": psi, "v_x": v_x, "v_y": v_y, "omega": omega, "delta": delta}
        values = FORMS[self.model].start({name: finite_number(value, name) for name, value in motion.items()}, self.own)
        return dict(zip(self.states, values, strict=True))

    def rates(self, x: Array, u: Array, p: Array) -> Array:
        """Derivatives (nx,) at a state (nx,) with inputs (2,) and parameters (np_,): CommonRoad's."""
        return self.states.vector(self._rates(u, p)(x.tolist()), "rates")

    def advance(self, x: Array, u: Array, p: Array, duration: float | None = None) -> Array:
        """State one sampling time later, or a duration [s], see `rumo.simulation.PlantLike`.

        Raises
        ------
        PlantError
            If CommonRoad's equations have no value.
        """
        time = self.sampling_time if duration is None else duration
        return integrated(self._rates(u, p), x, time, self._tolerance)

    def observe(self, x: Array, u: Array, p: Array) -> dict[str, float]:
        """Outputs at a state."""
        return FORMS[self.model].observe(x.tolist(), self.own)

    def _rates(self, u: Array, p: Array) -> Callable[[list[float]], list[float]]:
        dynamics = getattr(
            required(f"vehiclemodels.vehicle_dynamics_{self.model}", "commonroad", "CommonRoadCar"),
            f"vehicle_dynamics_{self.model}",
        )
        own, form = self.own, FORMS[self.model]
        acceleration, steering_rate = u.tolist()
        commands = [steering_rate, acceleration]
        if form.friction:
            mu = max(float(p[0]), LEAST_FRICTION)
            for name, ratio in self._frictions.items():
                setattr(own.tire, name, ratio * mu)

        def rates(x: list[float]) -> list[float]:
            # A wheel that stands can only begin to turn forwards. CommonRoad sets the state itself to 0, in which
            # integrators would lose their way.
            standing = [i for i in form.wheels if x[i] <= 0.0]
            for i in standing:
                x[i] = 0.0
            slopes = dynamics(x, commands, own)
            for i in standing:
                slopes[i] = max(slopes[i], 0.0)
            return slopes

        return rates


def _as_modelled(model: str, vehicle: int) -> VehicleParameters:
    """The car as CommonRoad has it. Drag that is not there would be reckoned with to brake."""
    car = VEHICLES[CARS[vehicle]]
    lateral = LATERAL.get(model, {}).get(vehicle, car.limits.lateral)
    return replace(car, b_lon=0.0, b_lat=0.0, limits=replace(car.limits, lateral=lateral))
