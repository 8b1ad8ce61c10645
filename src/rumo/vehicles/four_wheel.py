"""Four-wheel car with Ackermann steering and nonlinear tyres: the paper's plant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from rumo.errors import ArgumentError
from rumo.model import Model, Output
from rumo.vehicles.chassis import (
    BODY_STATES,
    WIND,
    WheelForces,
    choices,
    friction,
    friction_use,
    planar_motion,
    wheel_forces,
)
from rumo.vehicles.commands import REAR_TORQUE, STEERING_RATE, Drive, Steering, check_commands
from rumo.vehicles.drivetrain import held
from rumo.vehicles.errata import AsPrinted
from rumo.vehicles.motion import MOTION
from rumo.vehicles.parameters import VehicleParameters
from rumo.vehicles.tyres import ModifiedDugoff, Tyre
from rumo.vehicles.varied import varied_car, varied_parameters

WHEELS = ("fl", "fr", "rl", "rr")
# A wheel that the quasi-static transfer would lift keeps this share of its static load.
LEAST_LOAD = 0.02


def four_wheel(
    parameters: VehicleParameters,
    tyre: Tyre | None = None,
    as_printed: AsPrinted | None = None,
    *,
    drive: Drive = REAR_TORQUE,
    steering: Steering = STEERING_RATE,
    load_transfer: bool = False,
    split_friction: bool = False,
    varied: Sequence[str] = (),
) -> Model:
    """Four-wheel car with 11 states: equations (vehicle-dynamics), (wheels-dynamics) and (steering-dynamics).

    States, inputs and parameters as `dynamic_bicycle`, with four wheel speeds w_fl, w_fr, w_rl, w_rr [rad/s];
    outputs w_f and w_r are the mean wheel speeds of the axles, what the bicycle calls so, and friction_use_fl to
    friction_use_rr the force of each tyre over mu F_z [1].

    Parameters
    ----------
    parameters : VehicleParameters
        The car.
    tyre : Tyre, optional
        Modified Dugoff if not given.
    as_printed : AsPrinted, optional
        Equations to take as the paper prints them.
    drive, steering : Drive, Steering
        What the car is told; the torque on each rear wheel and a steering rate if not given.
    load_transfer : bool
        Normal loads follow the quasi-static accelerations, what the wheels' torques would give along the car and
        `v_x omega` across it, by the height of the centre of gravity; static otherwise.
    split_friction : bool
        Parameters mu_left and mu_right, the friction below the wheels of a side, in place of mu.
    varied : sequence of str
        Numbers of the car that become parameters of the model, the car's own by default: names in
        `rumo.vehicles.varied.VARIABLES`, such as "m" or "front_C_a". One model serves cars that differ in them.

    Raises
    ------
    ArgumentError
        If the load is to be transferred and the height h of the centre of gravity is 0, or a number cannot vary.
    """
    tyre, as_printed = choices(parameters, tyre, as_printed, ModifiedDugoff())
    check_commands(drive, steering)
    if load_transfer and parameters.h <= 0.0:
        raise ArgumentError(
            "load_transfer",
            f"True with h = {parameters.h:g} m",
            "a car whose centre of gravity is above the ground",
            "Give the parameters a height h: dataclasses.replace(parameters, h=0.5).",
        )
    numbers = varied_parameters(parameters, varied)
    road = {"l": "mu_left", "r": "mu_right"} if split_friction else dict.fromkeys("lr", "mu")

    def on_the_ground(x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any], dict[str, WheelForces]]:
        """Torque, normal load and tyre force of each wheel."""
        par = varied_car(parameters, p, varied)
        torques = drive.torques(x, u, WHEELS, par)
        tan_delta = _ackermann(steering.angle(x, u), par)
        loads = _loads(x, sum(torques.values()) / par.r, par, load_transfer)
        forces = {
            wheel: wheel_forces(
                x,
                p[road[wheel[1]]],
                position,
                tan_delta.get(wheel, 0.0),
                x[f"w_{wheel}"],
                loads[wheel],
                par.front if wheel[0] == "f" else par.rear,
                tyre,
                par,
                as_printed,
            )
            for wheel, position in _positions(par).items()
        }
        return torques, loads, forces

    def used(wheel: str) -> Output:
        def expression(x: Any, u: Any, p: Any) -> Any:
            _, loads, forces = on_the_ground(x, u, p)
            par = varied_car(parameters, p, varied)
            of_axle = par.front if wheel[0] == "f" else par.rear
            return friction_use(forces[wheel], p[road[wheel[1]]], loads[wheel], of_axle, par)

        return Output("1", expression)

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        torques, _, forces = on_the_ground(x, u, p)
        par = varied_car(parameters, p, varied)
        positions = _positions(par)
        X = sum(force.X for force in forces.values())
        Y = sum(force.Y for force in forces.values())
        moment = sum(forward * forces[wheel].Y - left * forces[wheel].X for wheel, (forward, left) in positions.items())
        on_wheels = {wheel: held(torque, x[f"w_{wheel}"], x.v_x, par) for wheel, torque in torques.items()}
        return {
            **planar_motion(x, p, X, Y, moment, par, as_printed),
            **{f"w_{wheel}": (on_wheels[wheel] - par.r * forces[wheel].F_x) / par.J for wheel in WHEELS},
            **steering.rates(u),
        }

    return Model(
        states={**BODY_STATES, **{f"w_{wheel}": "rad/s" for wheel in WHEELS}, **steering.states},
        inputs={**drive.inputs(WHEELS), **steering.inputs},
        dynamics=dynamics,
        parameters={**WIND, **friction(parameters, *dict.fromkeys(road.values())), **numbers},
        outputs={
            "w_f": Output("rad/s", lambda x, u, p: 0.5 * (x.w_fl + x.w_fr)),
            "w_r": Output("rad/s", lambda x, u, p: 0.5 * (x.w_rl + x.w_rr)),
            **MOTION,
            **{f"friction_use_{wheel}": used(wheel) for wheel in WHEELS},
        },
        name="four_wheel",
    )


def _positions(par: VehicleParameters) -> dict[str, tuple[float, float]]:
    """Where the wheels are, ahead of the centre of gravity and to its left [m]."""
    return {
        "fl": (par.l_f, par.t_w),
        "fr": (par.l_f, -par.t_w),
        "rl": (-par.l_r, par.t_w),
        "rr": (-par.l_r, -par.t_w),
    }


def _ackermann(delta: Any, par: VehicleParameters) -> dict[str, Any]:
    """`tan(delta_l,r) = L tan(delta) / (L -+ t_w tan(delta))`, equation (steering-dynamics) without the infinite R."""
    L, t = par.wheelbase, ca.tan(delta)
    return {"fl": L * t / (L - par.t_w * t), "fr": L * t / (L + par.t_w * t)}


def _loads(x: Any, push: Any, par: VehicleParameters, transfer: bool) -> dict[str, Any]:
    """Normal load of each tyre [N], while a force pushes the car forward [N]."""
    front, rear = par.front_load, par.rear_load
    if not transfer:
        return {"fl": front, "fr": front, "rl": rear, "rr": rear}
    to_rear = 0.5 * par.h / par.wheelbase * push
    to_right = par.m * par.h / (2.0 * par.t_w) * x.v_x * x.omega
    front_share, rear_share = par.l_r / par.wheelbase, par.l_f / par.wheelbase
    loads = {
        "fl": front - to_rear - front_share * to_right,
        "fr": front - to_rear + front_share * to_right,
        "rl": rear + to_rear - rear_share * to_right,
        "rr": rear + to_rear + rear_share * to_right,
    }
    return {wheel: ca.fmax(load, LEAST_LOAD * (front if wheel[0] == "f" else rear)) for wheel, load in loads.items()}
