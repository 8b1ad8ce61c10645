"""Dynamic bicycle with wheel spin: the paper's prediction model."""

from __future__ import annotations

from typing import Any

import casadi as ca

from rumo.model import Model
from rumo.terms import Constraint, Penalty
from rumo.vehicles.chassis import (
    BODY_STATES,
    INPUTS,
    WIND,
    WheelForces,
    choices,
    friction,
    planar_motion,
    tyre_friction,
    wheel_forces,
)
from rumo.vehicles.errata import AsPrinted
from rumo.vehicles.parameters import GRAVITY, VehicleParameters
from rumo.vehicles.tyres import LinearTyre, Tyre


def dynamic_bicycle(
    parameters: VehicleParameters,
    tyre: Tyre | None = None,
    as_printed: AsPrinted | None = None,
    *,
    axle_torque: bool = False,
) -> Model:
    """Dynamic bicycle with 9 states: equations (bicycle-dynamics) and (bicycle-wheels-dynamics).

    States p_x, p_y [m], psi [rad], v_x, v_y [m/s], omega [rad/s], wheel speeds w_f, w_r [rad/s], steering angle
    delta [rad]; inputs torque on each rear wheel [N m] and steering_rate [rad/s]; parameters wind_speed [m/s] and
    wind_direction [rad], where the wind blows to, and mu [1], the friction of the road.

    Parameters
    ----------
    parameters : VehicleParameters
        The car.
    tyre : Tyre, optional
        Linear if not given.
    as_printed : AsPrinted, optional
        Equations to take as the paper prints them.
    axle_torque : bool
        The torque is that of the rear axle, shared by its wheels.
    """
    tyre, as_printed = choices(parameters, tyre, as_printed, LinearTyre())
    share = 0.5 if axle_torque else 1.0

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        front, rear = _wheels(x, p, parameters, tyre, as_printed)
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
            "w_f": -parameters.r * front.F_x / parameters.J,
            "w_r": (share * u.torque - parameters.r * rear.F_x) / parameters.J,
            "delta": u.steering_rate,
        }

    return Model(
        states={**BODY_STATES, "w_f": "rad/s", "w_r": "rad/s", "delta": "rad"},
        inputs=INPUTS,
        dynamics=dynamics,
        parameters={**WIND, **friction(parameters)},
        name="dynamic_bicycle",
    )


def friction_circles(
    parameters: VehicleParameters,
    penalty: Penalty | None = Penalty(1.0),  # noqa: B008 -- immutable
    as_printed: AsPrinted | None = None,
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
    """
    _, printed = choices(parameters, None, as_printed, LinearTyre())

    def circle(axle: int) -> Any:
        tyre = (parameters.front, parameters.rear)[axle]
        load = (parameters.front_load, parameters.rear_load)[axle]
        weight = parameters.m * GRAVITY if printed.full_weight_friction else load

        def expression(x: Any, u: Any, p: Any) -> Any:
            limit = tyre_friction(p.mu, tyre, parameters) * weight
            wheel = _wheels(x, p, parameters, LinearTyre(), printed)[axle]
            return (wheel.F_x**2 + wheel.F_y**2) / limit**2 - 1.0

        return expression

    return {"friction_front": Constraint(circle(0), penalty), "friction_rear": Constraint(circle(1), penalty)}


def _wheels(
    x: Any, p: Any, parameters: VehicleParameters, tyre: Tyre, as_printed: AsPrinted
) -> tuple[WheelForces, WheelForces]:
    front = wheel_forces(
        x,
        p.mu,
        (parameters.l_f, 0.0),
        ca.tan(x.delta),
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
