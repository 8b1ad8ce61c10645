"""The problems of driving a car, along a path or by the clock, with weights that suit most cars."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rumo.actuation import Actuation, acting_inputs, behind_actuators, with_actuators
from rumo.discretization import Radau2
from rumo.errors import ArgumentError
from rumo.grid import Grid
from rumo.model import Model
from rumo.problem import Problem
from rumo.terms import Constraint, Weight
from rumo.vehicles.axles import WHEELS
from rumo.vehicles.commands import REAR_TORQUE, STEERING_RATE, Acceleration, RearTorque, Steering, SteeringRate
from rumo.vehicles.parameters import GRAVITY, VehicleParameters
from rumo.vehicles.rolling_bicycle import (
    TYRE,
    frenet_bicycle,
    friction_ellipses,
    power_limit,
    rolling_bicycle,
    slip_limits,
    track_limits,
)
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
    soft limits of slip and of the motor's power and, where a `PathTracking` reference has the `room` of a `Track`, soft
    limits of that. The observed model is `rolling_bicycle`. Predicted by `Radau2`: implicit Euler, half an interval
    late with every integration, takes most of the loop's damping away at speed.

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
    scale = car.length / LONG
    return _Driving(car, tyre, drive, steering, sampling_time, largest_slip).problem(
        frenet_bicycle(car, tyre, drive=drive, steering=steering),
        track={
            "n": Weight(20.0, 6.0 * scale),
            "velocity_across": Weight(3.0, 12.0),
            "velocity_along": Weight(2.0, 10.0),
        },
        calm=(1.0, 1.0),
        further=track_limits(car),
        horizon=horizon,
        delay=delay,
        actuation=actuation,
    )


def trajectory_problem(
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
    """Be at places at their times: with stops, in reverse, into a parking space, at walking speed.

    Tracks position, heading and velocity over ground of `rolling_bicycle`, all of which a `TimedPath` with a vehicle
    has, within the limits of `path_problem`. Inputs move less than there: where a car stands, noise of sensors is all
    that there is to follow. A heading is followed since in reverse a car whose position alone is held turns around it;
    the steering angle, a little, since within a horizon a crawling car feels nothing of where it is steered.

    Parameters
    ----------
    car, tyre, drive, steering, horizon, sampling_time, delay, largest_slip, actuation
        See `path_problem`.
    """
    scale = car.length / LONG
    track = {
        "p_x": Weight(20.0, 6.0 * scale),
        "p_y": Weight(20.0, 6.0 * scale),
        "psi": Weight(2.0, 1.0),
        "velocity_x": Weight(2.0, 12.0),
        "velocity_y": Weight(2.0, 12.0),
    }
    if "delta" in steering.states:
        track["delta"] = Weight(0.1, 1.2)
    return _Driving(car, tyre, drive, steering, sampling_time, largest_slip).problem(
        rolling_bicycle(car, tyre, drive=drive, steering=steering),
        track=track,
        calm=(40.0, 30.0 if isinstance(steering, SteeringRate) else 10.0),
        horizon=horizon,
        delay=delay,
        actuation=actuation,
    )


@dataclass(frozen=True)
class _Driving:
    """What every problem of driving a car has: its limits, those of its tyres, and the time."""

    car: VehicleParameters
    tyre: Tyre
    drive: RearTorque | Acceleration
    steering: Steering
    sampling_time: float
    largest_slip: float

    def problem(
        self,
        model: Model,
        *,
        track: Mapping[str, Weight],
        calm: tuple[float, float],
        horizon: int | Grid | None,
        delay: int | None,
        actuation: Actuation | None,
        further: Mapping[str, Constraint] | None = None,
    ) -> Problem:
        """The problem; `calm` are factors of the weights that keep drive and steering from moving."""
        dt = self.sampling_time
        bounds, moves, move_bounds = self._commands(*calm)
        car, tyre, drive, steering = self.car, self.tyre, self.drive, self.steering
        constraints = {
            **friction_ellipses(car, tyre, drive=drive, steering=steering),
            **slip_limits(car, drive=drive, steering=steering, largest=self.largest_slip),
            **power_limit(car, drive=drive),
            **(further or {}),
        }
        if actuation is not None:
            inputs, acting = model.inputs, acting_inputs(actuation, model.inputs, dt)
            model, delay = with_actuators(model, actuation), acting.delay if delay is None else delay
            constraints = {
                name: replace(item, expression=behind_actuators(item.expression, actuation, inputs))
                for name, item in constraints.items()
            }
        delay = 1 if delay is None else delay
        return Problem(
            model,
            horizon=Grid([dt] * (delay + 3) + [2.0 * dt] * 20) if horizon is None else horizon,
            sampling_time=dt,
            track=track,
            moves=moves,
            bounds=bounds,
            move_bounds=move_bounds,
            constraints=constraints,
            delay=delay,
            discretization=Radau2(),
        )

    def _commands(
        self, calm_drive: float, calm_steering: float
    ) -> tuple[dict[str, tuple[float, float]], dict[str, Weight], dict[str, tuple[float, float]] | None]:
        """Bounds, weights of moves, and bounds of moves."""
        car, drive, steering = self.car, self.drive, self.steering
        angle, rate, push = usual_limits(car)
        brake = push if car.limits.braking == np.inf else car.limits.braking
        if isinstance(drive, Acceleration):
            unit = 1.0
        elif isinstance(drive, RearTorque):
            unit = car.m * car.r * (1.0 if drive.axle else 0.5)
        else:
            cure = "Others need weights of your own."
            raise ArgumentError("drive", repr(drive), "RearTorque() or Acceleration()", cure)
        (along,), (turn,) = drive.inputs(WHEELS), steering.inputs
        bounds = {along: (-brake * unit, push * unit)}
        moves = {along: Weight(calm_drive, 16.0 * unit)}
        if isinstance(steering, SteeringRate):
            bounds |= {"delta": (-angle, angle), turn: (-rate, rate)}
            return bounds, moves | {turn: Weight(0.3 * calm_steering, 1.6)}, None
        reach = rate * self.sampling_time
        return (
            bounds | {turn: (-angle, angle)},
            moves | {turn: Weight(3.0 * calm_steering, 1.2)},
            {turn: (-reach, reach)},
        )
