"""What a car can do at most."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from rumo.checks import positive_number


@dataclass(frozen=True)
class VehicleLimits:
    """What actuators and motor of a car can do at most; infinite where nothing is known.

    Parameters
    ----------
    steering_angle : float
        Of the steering angle delta, to either side [rad].
    steering_rate : float
        Of its rate [rad/s].
    acceleration, braking : float
        By motor and brakes on a road that holds [m/s^2].
    speed : float
        Forwards [m/s].
    power : float
        Of the motor, at the wheels [W].
    lateral : float
        In a steady bend, before a wheel lifts or the car slides, where that is less than its tyres would give [m/s^2];
        see `rumo.studies.drive.steady_bend`.

    Raises
    ------
    ArgumentError
        If a number is not positive.
    """

    steering_angle: float = np.inf
    steering_rate: float = np.inf
    acceleration: float = np.inf
    braking: float = np.inf
    speed: float = np.inf
    power: float = np.inf
    lateral: float = np.inf

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if value != np.inf:
                positive_number(value, f"VehicleLimits.{item.name}")
