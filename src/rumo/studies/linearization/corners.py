"""Corners of race tracks: a car with Dugoff's tyres, in the prediction too, near the limit of its grip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np

from rumo.controllers import Controller
from rumo.problem import Problem
from rumo.references import Following, Road, speeds_within
from rumo.simulation import Constant, Plant, Scenario
from rumo.simulation.faults import Disturbed
from rumo.studies.linearization.drives import Drive
from rumo.studies.paper import CLOSE_WEIGHTS
from rumo.terms import Weight
from rumo.vehicles import PASSENGER_CAR, Dugoff, VehicleParameters, dynamic_bicycle, four_wheel, friction_circles
from rumo.vehicles.chassis import BODY_STATES
from rumo.vehicles.four_wheel import WHEELS
from rumo.vehicles.parameters import GRAVITY

Bend = tuple[float, float, float]
"""Radius [m], angle [rad], positive to the left, and length of the clothoids before and after [m]."""

HAIRPIN: tuple[Bend, ...] = ((12.0, np.pi, 8.0),)
CHICANE: tuple[Bend, ...] = ((20.0, 0.7, 8.0), (20.0, -1.4, 8.0), (20.0, 0.7, 8.0))
RIGHT_ANGLE: tuple[Bend, ...] = ((15.0, -0.5 * np.pi, 8.0),)
LONG_BEND: tuple[Bend, ...] = ((20.0, np.pi, 15.0),)

CAR = replace(PASSENGER_CAR, brake_front=None)
"""A car that brakes with its rear wheels alone, and loses them sooner than one with brakes in front."""
LEAD = 30.0
"""Straight before the first bend, and after the last [m]."""
SPACING = 0.5
"""Of the stations between which speeds change [m]."""
BRAKING, DRIVING, TOP = 3.0, 2.0, 22.0
"""What the car may brake and accelerate by [m/s^2], and its speed on a straight [m/s]."""
IN_THE_BEND = 10.0
"""How far behind the first clothoid's end a car starts that starts in the bend, or the patch of ice begins [m]."""
ICE = 0.3
"""Friction where there is ice."""
WEIGHTS = {**CLOSE_WEIGHTS, "p_x": CLOSE_WEIGHTS["p_y"]}
"""A road leads anywhere, so the car is kept as close to it in both directions."""
STEERING, STEERING_RATE = np.deg2rad(45.0), 1.5
"""Limits [rad], [rad/s]."""


def curvature_of(bends: Sequence[Bend], straight: float = LEAD) -> tuple[list[float], list[float]]:
    """Stations [m] and the curvature there [1/m]: bends one after the other, with a straight before and after.

    Each bend is a clothoid from straight to its radius, an arc, and a clothoid back.
    """
    lengths, curvature = [0.0, straight], [0.0, 0.0]
    for radius, angle, clothoid in bends:
        lengths += [clothoid, radius * abs(angle) - clothoid, clothoid]
        curvature += [np.sign(angle) / radius] * 2 + [0.0]
    return [*accumulate([*lengths, straight])], [*curvature, 0.0]


@dataclass(frozen=True)
class CornerDrive(Drive):
    """A car that follows a road, at no clock's command.

    Parameters
    ----------
    bends : tuple of Bend
        Of the road.
    grip : float
        Share of mu g that driving along the road at its speed needs, at most.
    held_speed : bool
        The speed is that of the sharpest bend all along; else the car brakes before bends and accelerates behind them.
    in_the_bend : bool
        The car starts in the first bend, without a plan; else before it.
    ice : float
        For how long the road has a friction of 0.3, from a place in the first bend on [s]. No controller is told.
    car : VehicleParameters
        Of prediction and plant.
    torque : float
        The largest of each rear wheel [N m].
    """

    bends: tuple[Bend, ...] = HAIRPIN
    grip: float = 0.6
    held_speed: bool = False
    in_the_bend: bool = False
    ice: float = 0.0
    car: VehicleParameters = CAR
    torque: float = 750.0

    @property
    def place(self) -> float:
        """In the first bend, where a car starts that starts there, or the ice begins: its arc length [m]."""
        return LEAD + self.bends[0][2] + IN_THE_BEND

    @property
    def road(self) -> Road:
        """With the speeds that are wanted, from where the car starts."""
        stations, curvature = curvature_of(self.bends)
        s = np.arange(0.0, stations[-1], SPACING)
        kappa = np.interp(s, stations, curvature)
        limit = self.grip * min(self.car.front.mu, self.car.rear.mu) * GRAVITY
        v = speeds_within(s, kappa, lateral=limit, braking=BRAKING, driving=DRIVING, top=TOP)
        start = self.place if self.in_the_bend else 0.0
        return Road(tuple(s), tuple(kappa), float(v.min()) if self.held_speed else tuple(v), self.car, start)

    def problem(self) -> Problem:
        """The optimal control problem that every controller solves."""
        largest = {"torque": self.torque, "steering_rate": STEERING_RATE, "delta": STEERING}
        return Problem(
            dynamic_bicycle(self.car, Dugoff()),
            horizon=self.horizon,
            sampling_time=self.sampling_time,
            track=self.weights or WEIGHTS,
            moves={name: Weight(5.0, range=2.0 * largest[name]) for name in ("torque", "steering_rate")},
            bounds={name: (-bound, bound) for name, bound in largest.items()},
            constraints=friction_circles(self.car, self.penalty),
            delay=self.delay,
        )

    def initial_state(self) -> dict[str, float]:
        """Plant state at the start, rolling along the road, or beside it."""
        start = {name: float(values[0]) for name, values in self.road(np.zeros(1)).items()}
        start["p_x"] -= self.initial_error * np.sin(start["psi"])
        start["p_y"] += self.initial_error * np.cos(start["psi"])
        start["psi"] += self.heading_error
        return {name: start[name] for name in (*BODY_STATES, "delta")} | {
            f"w_{wheel}": start[f"w_{wheel[0]}"] for wheel in WHEELS
        }

    def plant(self) -> Plant:
        """The car that is driven."""
        return Plant(four_wheel(self.car, self.tyre), self.sampling_time)

    def scenario(self, controller: str | type[Controller], problem: Problem, plant: Plant) -> Scenario:
        """One drive: `problem()` solved by a controller that drives `plant()`."""
        road, faults = self.road, ()
        if self.ice:
            begin = road.time_at(self.place)
            faults = (Disturbed((begin, begin + self.ice), "mu", ICE),)
        common = super().scenario(controller, problem, plant)
        return replace(common, reference=Following(road), faults=faults, disturbances={})


CORNER = CornerDrive(horizon=25, estimator=None, noise={}, wind=Constant(0.0), initial_error=0.0, tyre=Dugoff())
"""The drive that is made harder."""
