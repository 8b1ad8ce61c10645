"""Dynamic bicycle with wheel spin: the paper's prediction model."""

from __future__ import annotations

from typing import Any

import casadi as ca

from rumo.model import Model, Output
from rumo.terms import Constraint, Penalty
from rumo.vehicles.chassis import (
    BODY_STATES,
    WIND,
    WheelForces,
    choices,
    friction,
    friction_use,
    planar_motion,
    tyre_friction,
    wheel_forces,
)
from rumo.vehicles.commands import REAR_TORQUE, STEERING_RATE, Drive, Steering, check_commands
from rumo.vehicles.drivetrain import held
from rumo.vehicles.errata import AsPrinted
from rumo.vehicles.motion import MOTION
from rumo.vehicles.parameters import GRAVITY, VehicleParameters
from rumo.vehicles.tyres import LinearTyre, Tyre

AXLES = ("f", "r")
"""Its wheels, each of which stands for the two of an axle."""


def dynamic_bicycle(
    parameters: VehicleParameters,
    tyre: Tyre | None = None,
    as_printed: AsPrinted | None = None,
    *,
    drive: Drive = REAR_TORQUE,
    steering: Steering = STEERING_RATE,
) -> Model:
    """Dynamic bicycle with 9 states: equations (bicycle-dynamics) and (bicycle-wheels-dynamics).

    States p_x, p_y [m], psi [rad], v_x, v_y [m/s], omega [rad/s], wheel speeds w_f, w_r [rad/s], steering angle
    delta [rad]; inputs torque on each rear wheel [N m] and steering_rate [rad/s]; parameters wind_speed [m/s] and
    wind_direction [rad], where the wind blows to, and mu [1], the friction of the road. Outputs friction_use_f and
    friction_use_r are the force of a tyre of each axle over mu F_z [1].

    Parameters
    ----------
    parameters : VehicleParameters
        The car.
    tyre : Tyre, optional
        Linear if not given.
    as_printed : AsPrinted, optional
        Equations to take as the paper prints them.
    drive, steering : Drive, Steering
        What the car is told; the torque on each rear wheel and a steering rate if not given.
    """
    tyre, as_printed = choices(parameters, tyre, as_printed, LinearTyre())
    check_commands(drive, steering)

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        front, rear = _wheels(x, p, steering.angle(x, u), parameters, tyre, as_printed)
        torques = drive.torques(x, u, AXLES, parameters)
        on_front, on_rear = held(torques["f"], x.w_f, x.v_x, parameters), held(torques["r"], x.w_r, x.v_x, parameters)
        return {
            **planar_motion(
                x,
                p,
                2.0 * (front.X + rear.X),
                2.0 * (front.Y + rear.Y),
                2.0 * (parameters.l_f * front.Y - parameters.l_r * rear.Y),
                parameters,
                as_printed,
            ),
            "w_f": (on_front - parameters.r * front.F_x) / parameters.J,
            "w_r": (on_rear - parameters.r * rear.F_x) / parameters.J,
            **steering.rates(u),
        }

    def used(axle: int) -> Output:
        of_axle = (parameters.front, parameters.rear)[axle]
        load = (parameters.front_load, parameters.rear_load)[axle]

        def expression(x: Any, u: Any, p: Any) -> Any:
            force = _wheels(x, p, steering.angle(x, u), parameters, tyre, as_printed)[axle]
            return friction_use(force, p.mu, load, of_axle, parameters)

        return Output("1", expression)

    return Model(
        states={**BODY_STATES, "w_f": "rad/s", "w_r": "rad/s", **steering.states},
        inputs={**drive.inputs(AXLES), **steering.inputs},
        dynamics=dynamics,
        parameters={**WIND, **friction(parameters)},
        outputs={**MOTION, "friction_use_f": used(0), "friction_use_r": used(1)},
        name="dynamic_bicycle",
    )


def friction_circles(
    parameters: VehicleParameters,
    penalty: Penalty | None = Penalty(1.0),  # noqa: B008 -- immutable
    as_printed: AsPrinted | None = None,
    *,
    steering: Steering = STEERING_RATE,
) -> dict[str, Constraint]:
    """Friction circle of a front and of a rear tyre of the bicycle, `(F_x^2 + F_y^2) / (mu F_z)^2 - 1 <= 0`.

    Equation (friction-circle) with linear tyre forces and the model's parameter `mu`; for `Problem(constraints=...)`.

    Parameters
    ----------
    parameters : VehicleParameters
        The car; each tyre carries its static load.
    penalty : Penalty, optional
        Soft by default; None makes the circles hard.
    as_printed : AsPrinted, optional
        With `full_weight_friction`, the limit of one tyre is that of the whole car.
    steering : Steering
        That of the model.
    """
    _, printed = choices(parameters, None, as_printed, LinearTyre())

    def circle(axle: int) -> Any:
        tyre = (parameters.front, parameters.rear)[axle]
        load = (parameters.front_load, parameters.rear_load)[axle]
        weight = parameters.m * GRAVITY if printed.full_weight_friction else load

        def expression(x: Any, u: Any, p: Any) -> Any:
            limit = tyre_friction(p.mu, tyre, parameters) * weight
            wheel = _wheels(x, p, steering.angle(x, u), parameters, LinearTyre(), printed)[axle]
            return (wheel.F_x**2 + wheel.F_y**2) / limit**2 - 1.0

        return expression

    return {"friction_front": Constraint(circle(0), penalty), "friction_rear": Constraint(circle(1), penalty)}


def _wheels(
    x: Any, p: Any, delta: Any, parameters: VehicleParameters, tyre: Tyre, as_printed: AsPrinted
) -> tuple[WheelForces, WheelForces]:
    front = wheel_forces(
        x,
        p.mu,
        (parameters.l_f, 0.0),
        ca.tan(delta),
        x.w_f,
        parameters.front_load,
        parameters.front,
        tyre,
        parameters,
        as_printed,
    )
    rear = wheel_forces(
        x,
        p.mu,
        (-parameters.l_r, 0.0),
        0.0,
        x.w_r,
        parameters.rear_load,
        parameters.rear,
        tyre,
        parameters,
        as_printed,
    )
    return front, rear
