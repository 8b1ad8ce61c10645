"""What the bicycle and the four-wheel car share: the rigid body in the plane, its drag, a wheel on the ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from rumo.checks import check_signature, checked
from rumo.errors import ArgumentError
from rumo.model import Parameter
from rumo.vehicles.errata import AsPrinted
from rumo.vehicles.parameters import TyreParameters, VehicleParameters
from rumo.vehicles.tyres import Tyre, slip

BODY_STATES = {"p_x": "m", "p_y": "m", "psi": "rad", "v_x": "m/s", "v_y": "m/s", "omega": "rad/s"}
WIND = {"wind_speed": Parameter("m/s", 0.0), "wind_direction": Parameter("rad", 0.0)}
"""Wind over ground and the direction it blows to, from the x axis."""
LEAST_FRICTION = 1e-3
"""Friction below this is taken for this: no tyre has a direction of force without any."""
TINY_USE = 1e-6
"""Added to the use of friction under its root, which has a slope at 0 so."""


@dataclass(frozen=True)
class WheelForces:
    """Forces of one tyre.

    Attributes
    ----------
    F_x, F_y : expression
        In the wheel plane: along, and to the left [N].
    X, Y : expression
        In the car's frame [N].
    """

    F_x: Any
    F_y: Any
    X: Any
    Y: Any


def choices(
    parameters: VehicleParameters, tyre: Tyre | None, as_printed: AsPrinted | None, default: Tyre
) -> tuple[Tyre, AsPrinted]:
    """Tyre and equations of a car, which may be left out; raises for what is none of these."""
    checked(parameters, "parameters", VehicleParameters, "Write rumo.vehicles.PAPER_CAR for the paper's.")
    if isinstance(tyre, type) or not hasattr(tyre or default, "force"):
        raise ArgumentError("tyre", repr(tyre), "a tyre such as rumo.vehicles.Dugoff()")
    model = tyre or default
    expected = "one of (tyre, sigma, tan_alpha, F_z, mu, direction)"
    check_signature(model.force, "tyre.force", 6, expected, "Friction is an argument: it belongs to the road.")
    return model, checked(as_printed or AsPrinted(), "as_printed", AsPrinted)


def friction(parameters: VehicleParameters, *names: str) -> dict[str, Parameter]:
    """Road friction as parameters of a model, `mu` if no names are given; the car's own by default."""
    return dict.fromkeys(names or ("mu",), Parameter("1", parameters.mu, lower=0.0))


def tyre_friction(mu: Any, tyre: TyreParameters, parameters: VehicleParameters) -> Any:
    """Friction of a tyre where that of the car's worse tyres is mu: the others keep their ratio to these."""
    return ca.fmax(mu, LEAST_FRICTION) * (tyre.mu / parameters.mu)


def wheel_forces(
    x: Any,
    mu: Any,
    position: tuple[float, float],
    tan_delta: Any,
    wheel_speed: Any,
    load: Any,
    tyre: TyreParameters,
    model: Tyre,
    parameters: VehicleParameters,
    as_printed: AsPrinted,
) -> WheelForces:
    """Force of a tyre at `position` (forward, left) from the centre of gravity [m], steered by delta, on a road mu."""
    forward, left = position
    cos = 1.0 / ca.sqrt(1.0 + tan_delta**2)
    sin = tan_delta * cos
    signed = as_printed.signed_slip
    if as_printed.slip_at_center:
        sigma, tan_alpha, direction = _slip_at_center(x, forward, tan_delta, wheel_speed, parameters, signed)
    else:
        v_forward, v_left = x.v_x - left * x.omega, x.v_y + forward * x.omega
        v_lon, v_lat = v_forward * cos + v_left * sin, v_left * cos - v_forward * sin
        sigma, tan_alpha, direction = slip(v_lon, v_lat, wheel_speed, parameters.r, signed=signed)
    F_x, F_y = model.force(tyre, sigma, tan_alpha, load, tyre_friction(mu, tyre, parameters), direction)
    return WheelForces(F_x, F_y, F_x * cos - F_y * sin, F_x * sin + F_y * cos)


def friction_use(force: WheelForces, mu: Any, load: Any, tyre: TyreParameters, parameters: VehicleParameters) -> Any:
    """Force of a tyre over mu F_z, what friction would let it have: near 1 at its peak [1]."""
    limit = tyre_friction(mu, tyre, parameters) * load
    return ca.sqrt((force.F_x**2 + force.F_y**2) / limit**2 + TINY_USE**2)


def _slip_at_center(
    x: Any, forward: float, tan_delta: Any, wheel_speed: Any, parameters: VehicleParameters, signed: bool
) -> tuple[Any, Any, Any]:
    """Equations (slip-angle) and (slip-ratio), with `alpha = delta - atan(q)` as its tangent."""
    sigma, minus_q, direction = slip(x.v_x, x.v_y + forward * x.omega, wheel_speed, parameters.r, signed=signed)
    return sigma, (tan_delta + minus_q) / (1.0 - tan_delta * minus_q), direction


def planar_motion(
    x: Any, p: Any, X: Any, Y: Any, moment: Any, parameters: VehicleParameters, as_printed: AsPrinted
) -> dict[str, Any]:
    """Derivatives of the body's states under tyre forces X, Y [N] and their moment [N m], wind drag added."""
    drag_x, drag_y = _drag(x, p, parameters, as_printed)
    across = -x.v_y if as_printed.lateral_kinematics else x.v_y
    return {
        "p_x": x.v_x * ca.cos(x.psi) - x.v_y * ca.sin(x.psi),
        "p_y": x.v_x * ca.sin(x.psi) + across * ca.cos(x.psi),
        "psi": x.omega,
        "v_x": x.omega * x.v_y + (X + drag_x) / parameters.m,
        "v_y": -x.omega * x.v_x + (Y + drag_y) / parameters.m,
        "omega": moment / parameters.I,
    }


def _drag(x: Any, p: Any, parameters: VehicleParameters, as_printed: AsPrinted) -> tuple[Any, Any]:
    wind_x = p.wind_speed * ca.cos(p.wind_direction - x.psi)
    wind_y = p.wind_speed * ca.sin(p.wind_direction - x.psi)
    if as_printed.drag:
        return -parameters.b_lon * (x.v_x + wind_x) ** 2, -parameters.b_lat * (x.v_y + wind_y) ** 2
    flow_x, flow_y = x.v_x - wind_x, x.v_y - wind_y
    return -parameters.b_lon * flow_x * ca.fabs(flow_x), -parameters.b_lat * flow_y * ca.fabs(flow_y)
