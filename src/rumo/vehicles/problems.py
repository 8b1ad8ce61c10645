"""The problem of driving a car along a path, with weights that suit most cars."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rumo.actuation import Actuation, acting_inputs, behind_actuators, with_actuators
from rumo.discretization import Radau2
from rumo.errors import ArgumentError
from rumo.grid import Grid
from rumo.problem import Problem
from rumo.terms import Weight
from rumo.vehicles.axles import WHEELS
from rumo.vehicles.commands import REAR_TORQUE, STEERING_RATE, Acceleration, RearTorque, Steering, SteeringRate
from rumo.vehicles.parameters import GRAVITY, VehicleParameters
from rumo.vehicles.rolling_bicycle import TYRE, frenet_bicycle, friction_ellipses, slip_limits, track_limits
from rumo.vehicles.tyres import Tyre

USUAL = (0.6, 0.8, GRAVITY)
"""Steering angle [rad], its rate [rad/s] and acceleration [m/s^2] where a car says nothing of its limits."""
LONG = 4.5
"""Length [m] of the car that weights are for; others are as close to their path for their size."""


def usual_limits(car: VehicleParameters) -> tuple[float, float, float]:
    """Steering angle [rad], its rate [rad/s] and acceleration [m/s^2] of a car, usual ones where it says nothing."""
    limits = car.limits
    angle, rate, push = (
        usual if limit == np.inf else limit
        for limit, usual in zip((limits.steering_angle, limits.steering_rate, limits.acceleration), USUAL, strict=True)
    )
    return angle, rate, push


def path_problem(
    car: VehicleParameters,
    tyre: Tyre = TYRE,
    *,
    drive: RearTorque | Acceleration = REAR_TORQUE,
    steering: Steering = STEERING_RATE,
    horizon: int | Grid | None = None,
    sampling_time: float = 0.04,
    delay: int | None = None,
    largest_slip: float = 2.0,
    actuation: Actuation | None = None,
) -> Problem:
    """Follow a path at the speed that is wanted, by a bicycle that knows its place beside it.

    Tracks n, velocity_across and velocity_along of `frenet_bicycle` within the car's limits, soft friction ellipses and
    soft limits of slip and, where a `PathTracking` reference has the `room` of a `Track`, soft limits of that. The
    observed model is `rolling_bicycle`. Predicted by `Radau2`: implicit Euler, half an interval late with every
    integration, takes most of the loop's damping away at speed.

    Parameters
    ----------
    car : VehicleParameters
        With its limits.
    tyre : Tyre
        Modified Dugoff up to its peak if not given.
    drive, steering : RearTorque or Acceleration, Steering
        What the car is told.
    horizon : int or Grid, optional
        See `Problem`; a few samples and 20 intervals of twice their length if not given: far enough to brake for what
        comes, and for the car to swing out.
    sampling_time : float
        See `Problem` [s].
    delay : int, optional
        See `Problem`; if not given, that of the actuation, or one sample.
    largest_slip : float
        See `slip_limits`.
    actuation : Actuation, optional
        Predicted `with_actuators`, which the observed model has to be made with too.
    """
    angle, rate, push = usual_limits(car)
    brake = push if car.limits.braking == np.inf else car.limits.braking
    if isinstance(drive, Acceleration):
        unit = 1.0
    elif isinstance(drive, RearTorque):
        unit = car.m * car.r * (1.0 if drive.axle else 0.5)
    else:
        raise ArgumentError("drive", repr(drive), "RearTorque() or Acceleration()", "Others need weights of your own.")
    (along,), (turn,) = drive.inputs(WHEELS), steering.inputs
    bounds = {along: (-brake * unit, push * unit), "delta": (-angle, angle), turn: (-rate, rate)}
    moves = {along: Weight(1.0, 16.0 * unit), turn: Weight(0.3, 1.6)}
    if not isinstance(steering, SteeringRate):
        del bounds["delta"]
        bounds[turn] = (-angle, angle)
        moves[turn] = Weight(3.0, 1.2)
    scale = car.length / LONG
    model = frenet_bicycle(car, tyre, drive=drive, steering=steering)
    constraints = {
        **friction_ellipses(car, tyre, drive=drive, steering=steering),
        **slip_limits(car, drive=drive, steering=steering, largest=largest_slip),
        **track_limits(car),
    }
    if actuation is not None:
        inputs, acting = model.inputs, acting_inputs(actuation, model.inputs, sampling_time)
        model, delay = with_actuators(model, actuation), acting.delay if delay is None else delay
        constraints = {
            name: replace(item, expression=behind_actuators(item.expression, actuation, inputs))
            for name, item in constraints.items()
        }
    delay = 1 if delay is None else delay
    if horizon is None:
        horizon = Grid([sampling_time] * (delay + 3) + [2.0 * sampling_time] * 20)
    return Problem(
        model,
        horizon=horizon,
        sampling_time=sampling_time,
        track={
            "n": Weight(20.0, 6.0 * scale),
            "velocity_across": Weight(3.0, 12.0),
            "velocity_along": Weight(2.0, 10.0),
        },
        moves=moves,
        bounds=bounds,
        move_bounds=None
        if isinstance(steering, SteeringRate)
        else {turn: (-rate * sampling_time, rate * sampling_time)},
        constraints=constraints,
        delay=delay,
        discretization=Radau2(),
    )
