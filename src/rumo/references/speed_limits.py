"""What a car can do along a path, or what its passengers are to feel."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf, isfinite

import numpy as np

from rumo.checks import as_numbers, non_negative_number, positive_number
from rumo.errors import ArgumentError
from rumo.references.car_limits import accelerations
from rumo.vehicles.parameters import GRAVITY, VehicleParameters

TABLES = {"braking_left": (1.0, "shares from 0 to 1"), "driving_left": (1.0, "shares from 0 to 1")} | {
    "resistance": (inf, "accelerations of at least 0 [m/s^2]")
}
"""Fields of `SpeedLimits` that are tables over the lateral limit: their largest values, and what they are."""


@dataclass(frozen=True)
class SpeedLimits:
    """What a car can do, or what its passengers are to feel.

    Accelerations are half-axes of an ellipse: what is needed across the path is not there along it.

    Parameters
    ----------
    lateral, braking, driving : float
        Largest accelerations on a road with a friction of 1 [m/s^2].
    top : float
        Largest speed [m/s].
    power : float
        Of the engine by mass, which limits driving at speed [W/kg].
    drag : float
        Of the air by mass: it takes `drag v^2` [1/m].
    braking_left, driving_left : sequence of float, optional
        Shares of braking and driving that are left while evenly spaced shares of the lateral limit, from 0 to 1, are
        used: in place of the ellipse.
    resistance : sequence of float, optional
        What turning takes [m/s^2] while evenly spaced shares of the lateral limit are used, on a road with a friction
        of 1: tyres that push across roll at an angle. No more of the limit is used than where that is what driving and
        braking have left together.
    jerk : float
        Largest rate at which the acceleration along the path changes [m/s^3]; infinite for none.
    """

    lateral: float
    braking: float
    driving: float
    top: float = 70.0
    power: float = inf
    drag: float = 0.0
    braking_left: tuple[float, ...] | None = None
    driving_left: tuple[float, ...] | None = None
    resistance: tuple[float, ...] | None = None
    jerk: float = inf

    def __post_init__(self) -> None:
        for name in ("lateral", "braking", "driving", "top"):
            positive_number(getattr(self, name), name)
        if not non_negative_number(self.power, "power"):
            raise ArgumentError("power", repr(self.power), "a positive number [W/kg], infinite without a limit")
        if not non_negative_number(self.jerk, "jerk"):
            raise ArgumentError("jerk", repr(self.jerk), "a positive number [m/s^3], infinite without a limit")
        if not isfinite(non_negative_number(self.drag, "drag")):
            raise ArgumentError("drag", repr(self.drag), "a finite number [1/m]")
        for part in fields(self):
            value = getattr(self, part.name)
            if part.name not in TABLES:
                object.__setattr__(self, part.name, float(value))
            elif value is not None:
                object.__setattr__(self, part.name, _table(value, part.name))
        if self.resistance is not None and self.resistance[0] > self.braking + self.driving:
            most = f"at first at most braking and driving together, {self.braking + self.driving:g} m/s^2"
            raise ArgumentError("resistance", f"{self.resistance[0]:g} m/s^2 at first", most)

    @classmethod
    def race(
        cls, grip: float = 0.9, *, mu: float = 1.0, top: float = 70.0, power: float = inf, drag: float = 0.0
    ) -> SpeedLimits:
        """A friction circle of a share `grip` of `mu g`, as tyres have it."""
        limit = positive_number(grip, "grip") * positive_number(mu, "mu") * GRAVITY
        return cls(limit, limit, limit, top, power, drag)

    @classmethod
    def of_car(cls, car: VehicleParameters, grip: float = 0.9, *, mu: float | None = None) -> SpeedLimits:
        """What the tyres of a car hold at a share `grip` of friction, its motor and its actuators.

        Axle by axle, with loads that follow the accelerations: the inner wheels of a bend carry less, so the car
        accelerates and brakes less there than a point of its mass would. See `friction_ellipses`. A car whose
        `limits.lateral` is less than friction would give is taken for one on a road that gives no more.

        Parameters
        ----------
        car : VehicleParameters
            With its `limits`.
        grip : float
            Share of friction that is used.
        mu : float, optional
            Friction of the road; the car's own if not given.
        """
        found = accelerations(car, grip, car.mu if mu is None else mu)
        most = car.limits
        along = (np.minimum(found.braking, most.braking), np.minimum(found.driving, most.acceleration))
        braking, driving = (float(limit.max()) for limit in along)
        left = [tuple((limit / limit.max()).tolist()) for limit in along]
        top = min(most.speed, 100.0)
        power, drag = most.power / car.rolling_mass, car.b_lon / car.m
        return cls(
            float(found.lateral[-1]),
            braking,
            driving,
            top,
            power,
            drag,
            *left,
            resistance=tuple(found.resistance.tolist()),
        )

    @classmethod
    def comfort(cls, *, top: float = 36.0, jerk: float = 1.0) -> SpeedLimits:
        """What seated passengers do not mind: 2 m/s^2 across and in braking, 1.2 m/s^2 in driving, 1 m/s^3 of jerk.

        That is a third of the jerk beyond which surveys call a ride unacceptable: Hoberock (1977),
        doi 10.1115/1.3427093.
        """
        return cls(lateral=2.0, braking=2.0, driving=1.2, top=top, jerk=jerk)


def _table(values: object, argument: str) -> tuple[float, ...]:
    most, expected = TABLES[argument]
    table = as_numbers(values, argument)
    if table.ndim != 1 or len(table) < 2 or not ((table >= 0.0) & (table <= most) & (table < inf)).all():
        raise ArgumentError(argument, repr(values), f"at least two {expected}")
    return tuple(table.tolist())
