"""Bicycle whose wheels roll: forces of axles by their torque and slip angle, without wheel speeds.

For predictions of cars at the limit of grip: as many states as the motion has, and friction shared between what is
asked along the car and across it. `rolling_bicycle` knows the car by its position, `frenet_bicycle` by its place beside
a path.
"""

from __future__ import annotations

from math import inf
from typing import Any

import casadi as ca

from rumo.checks import positive_number
from rumo.model import Model, Parameter
from rumo.terms import Constraint, Penalty
from rumo.vehicles.axles import WHEELS, Axles
from rumo.vehicles.chassis import BODY_STATES, WIND, choices, friction, planar_motion
from rumo.vehicles.commands import REAR_TORQUE, STEERING_RATE, Drive, Steering, check_commands
from rumo.vehicles.errata import AsPrinted
from rumo.vehicles.motion import MOTION, PATH_MOTION
from rumo.vehicles.parameters import VehicleParameters
from rumo.vehicles.tyres import ModifiedDugoff, Tyre, UpToPeak

TYRE = UpToPeak(ModifiedDugoff())
ROOM = ("front_left", "front_right", "rear_left", "rear_right")
PATH_STATES = {"s": "m", "n": "m", "heading_error": "rad", "v_x": "m/s", "v_y": "m/s", "omega": "rad/s"}


def rolling_bicycle(
    parameters: VehicleParameters,
    tyre: Tyre = TYRE,
    *,
    drive: Drive = REAR_TORQUE,
    steering: Steering = STEERING_RATE,
    load_transfer: bool = True,
) -> Model:
    """Bicycle with rolling wheels, by its position.

    States p_x, p_y [m], psi [rad], v_x, v_y [m/s], omega [rad/s] and what the steering has, delta [rad]; inputs of
    drive and steering; parameters wind_speed [m/s], wind_direction [rad] and mu [1], the friction of the road; outputs
    course [rad], speed, velocity_x and velocity_y [m/s].

    Parameters
    ----------
    parameters : VehicleParameters
        The car.
    tyre : Tyre
        Modified Dugoff up to its peak if not given.
    drive, steering : Drive, Steering
        What the car is told; the torque on each rear wheel and a steering rate if not given.
    load_transfer : bool
        Whether loads follow the quasi-static accelerations.
    """
    axles = _axles(parameters, tyre, drive, steering, load_transfer)

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {**planar_motion(x, p, *axles.sums(x, u, p), parameters, AsPrinted()), **steering.rates(u)}

    return Model(
        states={**BODY_STATES, **steering.states},
        inputs={**drive.inputs(WHEELS), **steering.inputs},
        dynamics=dynamics,
        parameters={**WIND, **friction(parameters)},
        outputs=MOTION,
        name="rolling_bicycle",
    )


def frenet_bicycle(
    parameters: VehicleParameters,
    tyre: Tyre = TYRE,
    *,
    drive: Drive = REAR_TORQUE,
    steering: Steering = STEERING_RATE,
    load_transfer: bool = True,
) -> Model:
    """Bicycle with rolling wheels, by its place beside a path.

    States s, the arc length of the path's nearest point [m], n, how far the car is to the left of it [m],
    heading_error from its tangent [rad], v_x, v_y [m/s], omega [rad/s], and delta [rad]; parameters wind_speed [m/s],
    wind_direction [rad], mu [1], of the path curvature [1/m] and heading [rad], by which the wind blows, and ROOM, see
    `track_limits`; outputs course_error [rad], speed, velocity_along and velocity_across [m/s].

    It needs no position, so a plan bends with the path, and the error across it has a weight of its own (Verschueren
    et al., 2014). Valid where `n curvature < 1`.

    Parameters
    ----------
    parameters, tyre, drive, steering, load_transfer
        See `rolling_bicycle`.
    """
    axles = _axles(parameters, tyre, drive, steering, load_transfer)

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        body = planar_motion(_Headed(x, p.heading), p, *axles.sums(x, u, p), parameters, AsPrinted())
        cos, sin = ca.cos(x.heading_error), ca.sin(x.heading_error)
        s_rate = (x.v_x * cos - x.v_y * sin) / (1.0 - x.n * p.curvature)
        return {
            "s": s_rate,
            "n": x.v_x * sin + x.v_y * cos,
            "heading_error": x.omega - p.curvature * s_rate,
            **{name: body[name] for name in ("v_x", "v_y", "omega")},
            **steering.rates(u),
        }

    return Model(
        states={**PATH_STATES, **steering.states},
        inputs={**drive.inputs(WHEELS), **steering.inputs},
        dynamics=dynamics,
        parameters={
            **WIND,
            **friction(parameters),
            "curvature": Parameter("1/m", 0.0),
            "heading": Parameter("rad", 0.0),
            **dict.fromkeys(ROOM, Parameter("m", 1e3)),
        },
        outputs=PATH_MOTION,
        name="frenet_bicycle",
    )


def friction_ellipses(
    parameters: VehicleParameters,
    tyre: Tyre = TYRE,
    *,
    drive: Drive = REAR_TORQUE,
    steering: Steering = STEERING_RATE,
    load_transfer: bool = True,
    grip: float = 1.0,
    penalty: Penalty | None = Penalty(1.0),  # noqa: B008 -- immutable
) -> dict[str, Constraint]:
    """Friction ellipse of the front and of the rear axle, for problems with `rolling_bicycle` or `frenet_bicycle`.

    `(F_x / (k mu F_z,inner))^2 + (F_y / (mu F_z))^2 <= grip^2` for a mean wheel: the wheels of an axle get the same
    torque, so what they can push along the car is what the inner one, which carries less, can. The share k is 1, and
    less for soft tyres, whose wheels spin or lock before: see `rumo.vehicles.traction`.

    Parameters
    ----------
    parameters, tyre, drive, steering, load_transfer
        Those of the model.
    grip : float
        Share of friction that may be used.
    penalty : Penalty, optional
        Soft by default; None makes the ellipses hard.
    """
    return _axles(parameters, tyre, drive, steering, load_transfer).ellipses(penalty, positive_number(grip, "grip"))


def slip_limits(
    parameters: VehicleParameters,
    *,
    drive: Drive = REAR_TORQUE,
    steering: Steering = STEERING_RATE,
    load_transfer: bool = True,
    largest: float = 2.5,
    penalty: Penalty | None = Penalty(1.0),  # noqa: B008 -- immutable
) -> dict[str, Constraint]:
    """Limits of the slip angles of front and rear axle, so that no plan goes where more slip gives no more force.

    Beyond the peak of the tyres a linearisation sees nothing to be gained by either more or less steering, and a plan
    that has got there stays there. `(C_a tan(alpha) / (mu F_z largest))^2 <= 1`.

    Parameters
    ----------
    parameters, drive, steering, load_transfer
        Those of the model.
    largest : float
        Slip, as a multiple of the one at which linear forces reach mu F_z.
    penalty : Penalty, optional
        Soft by default; None makes the limits hard.
    """
    axles = _axles(parameters, TYRE, drive, steering, load_transfer)
    return axles.slips(penalty, positive_number(largest, "largest"))


def power_limit(parameters: VehicleParameters, *, drive: Drive = REAR_TORQUE) -> dict[str, Constraint]:
    """Power of the motor, for problems with `rolling_bicycle` or `frenet_bicycle`; none for a car without a limit.

    A plan that asks for more believes in speed that does not come, and so does a filter that is told what was asked.
    `2 (T_f + T_r) v_x / (r P) - 1 <= 0`, soft only so that an actuator which is late cannot make a problem infeasible.

    Parameters
    ----------
    parameters : VehicleParameters
        The car, with its `limits.power`.
    drive : Drive
        That of the model.
    """
    power = parameters.limits.power
    if power == inf:
        return {}

    def beyond(x: Any, u: Any, p: Any) -> Any:
        return 2.0 * sum(drive.torques(x, u, WHEELS, parameters).values()) * x.v_x / (parameters.r * power) - 1.0

    return {"power": Constraint(beyond, Penalty(20.0))}


def track_limits(
    parameters: VehicleParameters,
    *,
    penalty: Penalty | None = Penalty(20.0),  # noqa: B008 -- immutable
) -> dict[str, Constraint]:
    """Corners of the car within the track, for problems with `frenet_bicycle`.

    The model's parameters front_left, front_right, rear_left and rear_right say how far it is from the path to the
    edges [m] beside the car's front and beside its rear: `Track.room` gives them by place.

    Parameters
    ----------
    parameters : VehicleParameters
        The car: where its ends are, and its width.
    penalty : Penalty, optional
        Soft by default, by metres beyond; None makes them hard.
    """
    front, rear = parameters.ends
    ends = {"front": front, "rear": rear}

    def beyond(end: str, side: str) -> Any:
        sign = 1.0 if side == "left" else -1.0

        def expression(x: Any, u: Any, p: Any) -> Any:
            cos, sin = ca.cos(x.heading_error), ca.sin(x.heading_error)
            aside = x.n + ends[end] * sin
            return sign * aside + 0.5 * parameters.width * cos - getattr(p, f"{end}_{side}")

        return Constraint(expression, penalty)

    return {f"track_{room}": beyond(*room.split("_")) for room in ROOM}


class _Headed:
    """The state of a car beside a path, with its heading."""

    def __init__(self, x: Any, heading: Any) -> None:
        self._x, self.psi = x, heading + x.heading_error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._x, name)


def _axles(parameters: VehicleParameters, tyre: Tyre, drive: Drive, steering: Steering, load_transfer: bool) -> Axles:
    choices(parameters, tyre, None, TYRE)
    check_commands(drive, steering)
    return Axles(parameters, tyre, drive, steering, load_transfer)
