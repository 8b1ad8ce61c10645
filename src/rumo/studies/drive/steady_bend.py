"""A bend that tightens slowly at constant speed: how fast a plant can turn before it is at its end."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt, tan

from rumo.checks import checked, positive_number
from rumo.errors import ArgumentError, PlantError
from rumo.simulation.foreign import as_plant
from rumo.studies.drive.plants import DrivenCar
from rumo.vehicles import Acceleration
from rumo.vehicles.parameters import GRAVITY

JERK = 0.4
"""Lateral acceleration that steering adds in a second, as long as the car follows it [m/s^3]."""
FOLLOWS = 0.5
"""How fast the velocity across the car may change in a steady bend [m/s^2]."""
ENOUGH, SMALL = 1.2, 0.01
"""Steering that has given no more for so many times the angle, and so much [rad], gives no more."""
LOCK, SPARE = 1.0, 2.0
"""A steering angle of any car [rad], and how many times its grip has to be less than what steering would give."""
SETTLED = 1.0
"""For which it drives straight on at first [s]."""
HOLD = 2.0
"""Acceleration [m/s^2] with which it is driven on for each m/s that it is too slow."""
MOST = 40.0
"""Beyond the grip of any road [m/s^2]: a plant that has not come to its end by then has none."""
LIFTED, SLID, FALLING = "an inner wheel lifts", "the car slides", "more steering gives no more"
ENDLESS = "there is no end to its grip"


@dataclass(frozen=True)
class SteadyBend:
    """The end of a steady bend.

    Attributes
    ----------
    lateral : float
        Largest lateral acceleration until then [m/s^2].
    ended : str
        Why it is no steady bend any more.
    steering_angle : float
        At that acceleration [rad].
    """

    lateral: float
    ended: str
    steering_angle: float


def steady_bend(driven: DrivenCar, speed: float, *, left: bool = True, sampling_time: float = 0.04) -> SteadyBend:
    """Steer slowly more and more at constant speed (ISO 4138), up to where a wheel lifts or the car slides.

    Wheels lift where the plant has outputs `load_fl` to `load_rr` and one is at 0. What was found is
    `VehicleLimits.lateral` of the car, if it is less than friction would give.

    Parameters
    ----------
    driven : DrivenCar
        The plant: of `driven_car("commonroad-mb:2", car, 0.04)`, say.
    speed : float
        That is held [m/s].
    left : bool
        Which way to turn.
    sampling_time : float
        Of plants without their own [s].

    Raises
    ------
    ArgumentError
        If the speed is not positive, or so slow that the steering is at its end before the grip.
    """
    checked(driven, "driven", DrivenCar)
    plant, car = as_plant(driven.plant, sampling_time), driven.car
    speed, sign = positive_number(speed, "speed"), 1.0 if left else -1.0
    reach = speed**2 * tan(min(car.limits.steering_angle, LOCK)) / car.wheelbase
    if reach < SPARE * car.mu * GRAVITY:
        got = f"{speed:g} m/s, at which steering gives {reach:.3g} m/s^2 without any slip"
        slowest = sqrt(SPARE * car.mu * GRAVITY / reach) * speed
        raise ArgumentError("speed", got, f"at least {slowest:.3g} m/s, so that it is grip that ends the test")
    rate = JERK * car.wheelbase / speed**2
    loads = tuple(name for name in plant.outputs if name.startswith("load_"))
    observe = plant.observer(("v_x", "v_y", "omega", "delta", *loads))
    unit = 1.0 if isinstance(driven.drive, Acceleration) else car.m * car.r * (1.0 if driven.drive.axle else 0.5)
    along = next(name for name in plant.inputs if name != "steering_rate")
    still = dict.fromkeys(("p_x", "p_y", "psi", "v_y", "omega", "delta"), 0.0)
    x, p = plant.states.vector(driven.start({**still, "v_x": speed}), "x"), plant.default_parameters
    best, at, v_y, push = 0.0, 0.0, 0.0, 0.0
    for k in range(round((SETTLED + MOST / JERK) / sampling_time)):
        turning = sign * rate if k * sampling_time > SETTLED else 0.0
        u = plant.inputs.vector({along: push * unit, "steering_rate": turning}, "u")
        try:
            x = plant.advance(x, u, p)
        except PlantError:
            return SteadyBend(best, SLID, at)
        v_x, slide, omega, delta, *wheels = observe(x, u, p).tolist()
        sliding, v_y = (slide - v_y) / sampling_time, slide
        push, lateral = HOLD * (speed - hypot(v_x, slide)), sign * (v_x * omega + sliding)
        if wheels and min(wheels) <= 0.0:
            return SteadyBend(best, LIFTED, at)
        if abs(sliding) > FOLLOWS:
            return SteadyBend(best, SLID, at)
        if lateral > best:
            best, at = lateral, delta
        elif abs(delta) > ENOUGH * abs(at) + SMALL:
            return SteadyBend(best, FALLING, at)
    return SteadyBend(best, ENDLESS, at)
