"""A Kalman filter for a car, by what its model misses of it."""

from __future__ import annotations

from collections.abc import Mapping

from rumo.checks import checked, positive_number
from rumo.discretization import Radau2
from rumo.estimation import ExtendedKalman
from rumo.vehicles.commands import REAR_TORQUE, STEERING_RATE, Steering, check_commands
from rumo.vehicles.parameters import GRAVITY, VehicleParameters
from rumo.vehicles.problems import usual_limits

ALONG, ACROSS, TURNING, STEERED = 0.03, 0.055, 0.044, 0.01
"""Standard deviations of what `rolling_bicycle` misses: shares of the accelerations that full friction gives, along the
car, across it, and in turning when one axle has all of it, and of the fastest steering."""


def car_filter(
    car: VehicleParameters,
    noise: Mapping[str, float],
    *,
    steering: Steering = STEERING_RATE,
    sampling_time: float = 0.04,
) -> ExtendedKalman:
    """An extended Kalman filter for `rolling_bicycle(car)`, on roads and at the limit of grip.

    What the bicycle misses of a car with four wheels, in wind, is about the same share of what tyres can do for cars
    of all sizes, and lasts longer than a sample: deviations grow with the sampling time. `rumo.estimation.consistency`
    says whether that holds for yours, `fit_process_noise` what does, and `dataclasses.replace` changes what is late,
    refused or unknown.

    Parameters
    ----------
    car : VehicleParameters
        The car.
    noise : mapping of str to float
        Standard deviation of each measurement: of states or outputs of the bicycle.
    steering : Steering
        That of the model.
    sampling_time : float
        That of the controller [s].

    Returns
    -------
    ExtendedKalman
        With `Radau2` as its scheme.

    Notes
    -----
    Shares by maximum likelihood (`fit_process_noise`) of laps of the passenger car, as a four-wheel plant with load
    transfer, at 0.9 of its grip.
    """
    checked(car, "car", VehicleParameters, "Write rumo.vehicles.PASSENGER_CAR.")
    check_commands(REAR_TORQUE, steering)
    dt = positive_number(sampling_time, "sampling_time")
    grip = car.mu * GRAVITY
    turning = grip * car.m * car.l_f * car.l_r / (car.wheelbase * car.I)
    v_x, v_y, omega = ALONG * grip * dt, ACROSS * grip * dt, TURNING * turning * dt
    process = {"p_x": v_y * dt, "p_y": v_y * dt, "psi": omega * dt, "v_x": v_x, "v_y": v_y, "omega": omega}
    _, rate, _ = usual_limits(car)
    process |= dict.fromkeys(steering.states, STEERED * rate * dt)
    return ExtendedKalman(noise, process, discretization=Radau2())
