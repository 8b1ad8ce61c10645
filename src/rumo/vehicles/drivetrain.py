"""From one torque to the wheels: what drives, and what brakes.

A car with brakes drives with some axles, `drive_front` of it in front, and brakes with all wheels, `brake_front` of it
in front. A negative torque is the brakes' while it moves forward, and the motor's when it stands or reverses; in
between it passes from one to the other.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

from rumo.vehicles.parameters import VehicleParameters

CREEPING = 0.5
"""Speed [m/s] about which the motor takes over from the brakes."""
LOCKING = 1.0
"""Speed of a wheel [rad/s] below which brakes let go of it: they hold what turns, and turn nothing backwards."""


def axle_torques(torque: Any, v_x: Any, parameters: VehicleParameters) -> tuple[Any, Any]:
    """Torques of the front and the rear axle [N m] that are `torque` together."""
    drive, brake = parameters.drive_front, parameters.brake_front
    if brake is None:
        return drive * torque, (1.0 - drive) * torque
    driving, braking = _parts(torque, v_x)
    front = drive * driving + brake * braking
    return front, torque - front


def held(torque: Any, wheel_speed: Any, v_x: Any, parameters: VehicleParameters) -> Any:
    """Torque on a wheel [N m] of what brakes would give it if they could turn it backwards."""
    if parameters.brake_front is None:
        return torque
    driving, braking = _parts(torque, v_x)
    turning = ca.fmax(wheel_speed, 0.0) / ca.sqrt(wheel_speed**2 + LOCKING**2)
    return driving + turning * braking


def _parts(torque: Any, v_x: Any) -> tuple[Any, Any]:
    """What of a torque drives, and what brakes."""
    forward = (ca.fmax(v_x, 0.0) / CREEPING) ** 4
    braking = ca.fmin(torque, 0.0) * forward / (forward + 1.0)
    return torque - braking, braking
