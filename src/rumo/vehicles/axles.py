"""Forces of the axles of a car whose wheels roll: what is left where spinning wheels are no states.

Along the car an axle pushes with its wheels' torque, less what turns them faster; across it, by its slip angle, with
what friction leaves. Loads follow the accelerations, quasi-statically: along the car with the torque, across it with
`v_x omega`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from rumo.terms import Constraint, Penalty
from rumo.vehicles.chassis import WheelForces, tyre_friction
from rumo.vehicles.commands import Drive, Steering
from rumo.vehicles.parameters import TyreParameters, VehicleParameters
from rumo.vehicles.traction import traction
from rumo.vehicles.tyres import Tyre, slip

WHEELS = ("f", "r")
"""Each stands for the two of an axle."""
LEAST_LOAD = 0.05
"""Of the mean load of an axle's wheels: what the inner one keeps at least."""
LEAST_SHARE = 0.3
"""Of friction: what is left for forces across the car at least, however large those along it."""


@dataclass(frozen=True)
class AxleForces(WheelForces):
    """Forces of a mean wheel of an axle, and the loads of the two.

    Attributes
    ----------
    inner, outer : expression
        Normal load of the wheel inside, and outside, of the bend [N].
    mu : expression
        Friction of the tyres.
    slip : expression
        What a linear tyre's force across the wheel would be, as a multiple of mu F_z.
    """

    inner: Any
    outer: Any
    mu: Any
    slip: Any


@dataclass(frozen=True)
class Axles:
    """The axles of a car, its tyres, and what it is told.

    Parameters
    ----------
    parameters : VehicleParameters
        The car.
    tyre : Tyre
        Its model.
    drive, steering : Drive, Steering
        Its inputs.
    load_transfer : bool
        Whether loads follow accelerations.
    """

    parameters: VehicleParameters
    tyre: Tyre
    drive: Drive
    steering: Steering
    load_transfer: bool

    def forces(self, x: Any, u: Any, p: Any) -> tuple[AxleForces, AxleForces]:
        """Of the front and the rear axle, in the state x with inputs u and parameters p of a model."""
        par = self.parameters
        torques = self.drive.torques(x, u, WHEELS, par)
        gain = 2.0 * (torques["f"] + torques["r"]) / (par.r * par.rolling_mass)
        # Wheels turn faster with the car. What that takes of their torque does not reach the road.
        torques = {wheel: torque - par.J / par.r * gain for wheel, torque in torques.items()}
        # Of each wheel [N]: what an axle gains along the car, and loses at its inner wheel, for its share.
        to_rear = 0.5 * par.h / par.wheelbase * par.m * gain if self.load_transfer else 0.0
        to_outer = par.m * par.h / (2.0 * par.t_w) * x.v_x * x.omega if self.load_transfer else 0.0
        steered = ca.tan(self.steering.angle(x, u))
        front = self._axle(
            x, p.mu, par.l_f, steered, torques["f"], par.front, par.front_load - to_rear, par.l_r * to_outer
        )
        rear = self._axle(x, p.mu, -par.l_r, 0.0, torques["r"], par.rear, par.rear_load + to_rear, par.l_f * to_outer)
        return front, rear

    def _axle(
        self,
        x: Any,
        mu: Any,
        forward: float,
        tan_delta: Any,
        torque: Any,
        tyre: TyreParameters,
        load: Any,
        transfer: Any,
    ) -> AxleForces:
        """Forces of an axle whose wheels carry `load` on average; `transfer` / L of it goes from one to the other."""
        par = self.parameters
        friction = tyre_friction(mu, tyre, par)
        moved: Any = 0.0
        if self.load_transfer:
            load = ca.fmax(load, LEAST_LOAD * (par.front_load if forward > 0.0 else par.rear_load))
            moved = ca.fmin(ca.fabs(transfer) / par.wheelbase, (1.0 - LEAST_LOAD) * load)
        cos = 1.0 / ca.sqrt(1.0 + tan_delta**2)
        sin = tan_delta * cos
        left = x.v_y + forward * x.omega
        _, tan_alpha, direction = slip(x.v_x * cos + left * sin, left * cos - x.v_x * sin, 0.0, par.r)
        F_x = torque / par.r
        across = friction * ca.sqrt(ca.fmax(1.0 - (F_x / (friction * load)) ** 2, LEAST_SHARE**2))
        loads = (load - moved, load + moved) if self.load_transfer else (load,)
        F_y = sum(self.tyre.force(tyre, 0.0, tan_alpha, F_z, across, direction)[1] for F_z in loads) / len(loads)
        X, Y = F_x * cos - F_y * sin, F_x * sin + F_y * cos
        return AxleForces(
            F_x, F_y, X, Y, load - moved, load + moved, friction, tyre.C_a * tan_alpha / (friction * load)
        )

    def sums(self, x: Any, u: Any, p: Any) -> tuple[Any, Any, Any]:
        """Forces of all wheels along and across the car [N], and their moment [N m]."""
        front, rear = self.forces(x, u, p)
        par = self.parameters
        return 2.0 * (front.X + rear.X), 2.0 * (front.Y + rear.Y), 2.0 * (par.l_f * front.Y - par.l_r * rear.Y)

    def ellipses(self, penalty: Penalty | None, grip: float) -> dict[str, Constraint]:
        """Friction ellipses of the front and of the rear axle."""
        par = self.parameters
        shares = traction(par.front, par.front_load), traction(par.rear, par.rear_load)

        def ellipse(axle: int) -> Any:
            def expression(x: Any, u: Any, p: Any) -> Any:
                wheel = self.forces(x, u, p)[axle]
                limit, mean = grip * wheel.mu, 0.5 * (wheel.inner + wheel.outer)
                along = shares[axle] * limit * wheel.inner
                return (wheel.F_x / along) ** 2 + (wheel.F_y / (limit * mean)) ** 2 - 1.0

            return expression

        return {"friction_front": Constraint(ellipse(0), penalty), "friction_rear": Constraint(ellipse(1), penalty)}

    def slips(self, penalty: Penalty | None, largest: float) -> dict[str, Constraint]:
        """Limits of the slip angles of the front and of the rear axle."""

        def slip_of(axle: int) -> Any:
            return lambda x, u, p: (self.forces(x, u, p)[axle].slip / largest) ** 2 - 1.0

        return {"slip_front": Constraint(slip_of(0), penalty), "slip_rear": Constraint(slip_of(1), penalty)}
