"""Four-wheel car with Ackermann steering and nonlinear tyres: the paper's plant."""

from __future__ import annotations

from typing import Any

import casadi as ca

from rumo.errors import ArgumentError
from rumo.model import Model, Output
from rumo.vehicles.chassis import BODY_STATES, INPUTS, WIND, choices, friction, planar_motion, wheel_forces
from rumo.vehicles.errata import AsPrinted
from rumo.vehicles.parameters import VehicleParameters
from rumo.vehicles.tyres import ModifiedDugoff, Tyre

WHEELS = ("fl", "fr", "rl", "rr")
# A wheel that the quasi-static transfer would lift keeps this share of its static load.
LEAST_LOAD = 0.02


def four_wheel(
    parameters: VehicleParameters,
    tyre: Tyre | None = None,
    as_printed: AsPrinted | None = None,
    *,
    axle_torque: bool = False,
    load_transfer: bool = False,
) -> Model:
    """Four-wheel car with 11 states: equations (vehicle-dynamics), (wheels-dynamics) and (steering-dynamics).

    States, inputs and parameters as `dynamic_bicycle`, with four wheel speeds w_fl, w_fr, w_rl, w_rr [rad/s];
    outputs w_f and w_r are the mean wheel speeds of the axles, what the bicycle calls so.

    Parameters
    ----------
    parameters : VehicleParameters
        The car.
    tyre : Tyre, optional
        Modified Dugoff if not given.
    as_printed : AsPrinted, optional
        Equations to take as the paper prints them.
    axle_torque : bool
        The torque is that of the rear axle, shared by its wheels.
    load_transfer : bool
        Normal loads follow the quasi-static accelerations `2 torque / (r m)` and `v_x omega` by the height of the
        centre of gravity; static otherwise.

    Raises
    ------
    ArgumentError
        If the load is to be transferred and the height h of the centre of gravity is 0.
    """
    tyre, as_printed = choices(parameters, tyre, as_printed, ModifiedDugoff())
    if load_transfer and parameters.h <= 0.0:
        raise ArgumentError(
            "load_transfer",
            f"True with h = {parameters.h:g} m",
            "a car whose centre of gravity is above the ground",
            "Give the parameters a height h: dataclasses.replace(parameters, h=0.5).",
        )
    par = parameters
    share = 0.5 if axle_torque else 1.0
    positions = {
        "fl": (par.l_f, par.t_w),
        "fr": (par.l_f, -par.t_w),
        "rl": (-par.l_r, par.t_w),
        "rr": (-par.l_r, -par.t_w),
    }

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        torque = share * u.torque
        tan_delta = _ackermann(x.delta, par)
        loads = _loads(x, torque, par, load_transfer)
        forces = {
            wheel: wheel_forces(
                x,
                p.mu,
                position,
                tan_delta.get(wheel, 0.0),
                x[f"w_{wheel}"],
                loads[wheel],
                par.front if wheel[0] == "f" else par.rear,
                tyre,
                par,
                as_printed,
            )
            for wheel, position in positions.items()
        }
        X = sum(force.X for force in forces.values())
        Y = sum(force.Y for force in forces.values())
        moment = sum(forward * forces[wheel].Y - left * forces[wheel].X for wheel, (forward, left) in positions.items())
        drive = {"fl": 0.0, "fr": 0.0, "rl": torque, "rr": torque}
        return {
            **planar_motion(x, p, X, Y, moment, par, as_printed),
            **{f"w_{wheel}": (drive[wheel] - par.r * forces[wheel].F_x) / par.J for wheel in WHEELS},
            "delta": u.steering_rate,
        }

    return Model(
        states={**BODY_STATES, **{f"w_{wheel}": "rad/s" for wheel in WHEELS}, "delta": "rad"},
        inputs=INPUTS,
        dynamics=dynamics,
        parameters={**WIND, **friction(parameters)},
        outputs={
            "w_f": Output("rad/s", lambda x, u, p: 0.5 * (x.w_fl + x.w_fr)),
            "w_r": Output("rad/s", lambda x, u, p: 0.5 * (x.w_rl + x.w_rr)),
        },
        name="four_wheel",
    )


def _ackermann(delta: Any, par: VehicleParameters) -> dict[str, Any]:
    """`tan(delta_l,r) = L tan(delta) / (L -+ t_w tan(delta))`, equation (steering-dynamics) without the infinite R."""
    L, t = par.wheelbase, ca.tan(delta)
    return {"fl": L * t / (L - par.t_w * t), "fr": L * t / (L + par.t_w * t)}


def _loads(x: Any, torque: Any, par: VehicleParameters, transfer: bool) -> dict[str, Any]:
    """Normal load of each tyre [N]."""
    front, rear = par.front_load, par.rear_load
    if not transfer:
        return {"fl": front, "fr": front, "rl": rear, "rr": rear}
    to_rear = 0.5 * par.h / par.wheelbase * (2.0 * torque / par.r)
    to_right = par.m * par.h / (2.0 * par.t_w) * x.v_x * x.omega
    front_share, rear_share = par.l_r / par.wheelbase, par.l_f / par.wheelbase
    loads = {
        "fl": front - to_rear - front_share * to_right,
        "fr": front - to_rear + front_share * to_right,
        "rl": rear + to_rear - rear_share * to_right,
        "rr": rear + to_rear + rear_share * to_right,
    }
    return {wheel: ca.fmax(load, LEAST_LOAD * (front if wheel[0] == "f" else rear)) for wheel, load in loads.items()}
