"""What a car can do along its way while it turns, from the loads of its tyres."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rumo.checks import checked, positive_number
from rumo.signals import Array
from rumo.vehicles.axles import LEAST_LOAD
from rumo.vehicles.parameters import GRAVITY, VehicleParameters
from rumo.vehicles.rolling_bicycle import TYRE
from rumo.vehicles.traction import traction

STEPS = 64
HALVINGS = 50


class Accelerations(NamedTuple):
    """Largest accelerations of a car [m/s^2].

    Attributes
    ----------
    lateral : ndarray, (n,)
        From 0 to the largest, evenly.
    braking, driving : ndarray, (n,)
        That the tyres' forces along the car give at each, whatever resists.
    resistance : ndarray, (n,)
        What turning takes at each.
    """

    lateral: Array
    braking: Array
    driving: Array
    resistance: Array


def accelerations(car: VehicleParameters, grip: float, mu: float) -> Accelerations:
    """Accelerations at which the friction ellipse of an axle is used to a share `grip`, on a road of friction mu.

    The ellipses are those of `rumo.vehicles.friction_ellipses`: loads follow the accelerations, and an axle pushes no
    more than its inner wheel holds. A car whose `limits.lateral` is less than mu g is on a road that gives no more.
    Drag of the air and the limits of motor and actuators are left out.
    """
    checked(car, "car", VehicleParameters, "Write rumo.vehicles.PASSENGER_CAR.")
    limit = positive_number(grip, "grip") * min(positive_number(mu, "mu"), car.limits.lateral / GRAVITY)
    lateral = np.linspace(0.0, limit * GRAVITY, STEPS + 1)
    brake = car.drive_front if car.brake_front is None else car.brake_front
    braking = _largest(car, limit, lateral, -1.0, brake)
    driving = _largest(car, limit, lateral, 1.0, car.drive_front)
    return Accelerations(lateral, braking, driving, _resistance(car, mu, lateral))


def _resistance(car: VehicleParameters, mu: float, lateral: Array) -> Array:
    """Deceleration (n,) by tyres that push across: each force times its slip angle, by Dugoff's tyre at mean loads."""
    used = lateral / (mu * GRAVITY)
    sliding = 0.25 / np.maximum(1.0 - used, 0.25 / TYRE.slip)
    slips = mu * np.where(used < 0.5, used, sliding)
    front, rear = (slips * load / tyre.C_a for load, tyre in ((car.front_load, car.front), (car.rear_load, car.rear)))
    return lateral * (car.l_r * front + car.l_f * rear) / car.wheelbase


def _largest(car: VehicleParameters, limit: float, lateral: Array, sign: float, front: float) -> Array:
    """The largest acceleration (n,), forwards or backwards, of which the front axle gives a share, by bisection."""
    axles = (
        (front, car.l_r, -1.0, traction(car.front, car.front_load)),
        (1.0 - front, car.l_f, 1.0, traction(car.rear, car.rear_load)),
    )
    low, high = np.zeros_like(lateral), np.full_like(lateral, 2.0 * limit * GRAVITY * max(1.0, 0.5 / max(front, 0.5)))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        good = np.ones(len(lateral), dtype=bool)
        for share, arm, away, most in axles:
            # Per mass: of the axle's mean wheel, what it carries; of its inner one, what is left of that.
            mean = 0.5 * (arm * GRAVITY + away * sign * middle * car.h) / car.wheelbase
            mean = np.maximum(mean, LEAST_LOAD * 0.5 * arm * GRAVITY / car.wheelbase)
            inner = np.maximum(mean - arm / car.wheelbase * car.h * lateral / (2.0 * car.t_w), LEAST_LOAD * mean)
            along = (0.5 * share * car.rolling_mass - car.J / car.r**2) / car.m * middle
            across = 0.5 * lateral * arm / car.wheelbase
            good &= (along / (most * limit * inner)) ** 2 + (across / (limit * mean)) ** 2 <= 1.0
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return low
