"""Outputs of every car: where it goes, and how fast, which is not where its body points."""

from __future__ import annotations

from typing import Any

import casadi as ca

from rumo.model import Output

STANDSTILL = 0.05
"""Speed [m/s] below which a course fades into the heading."""


def sideslip(v_x: Any, v_y: Any) -> Any:
    """Angle from the body to the velocity [rad], `atan2(v_y, v_x)`; 0 at standstill, smoothly."""
    squared = v_x**2 + v_y**2
    moving = squared / (squared + STANDSTILL**2)
    return ca.atan2(moving * v_y, moving * v_x + (1.0 - moving))


def speed(v_x: Any, v_y: Any) -> Any:
    """Speed over ground [m/s], within 0.2 % from 1 m/s on, and with finite slopes at standstill."""
    squared = v_x**2 + v_y**2
    return squared / ca.sqrt(squared + STANDSTILL**2)


MOTION = {
    "course": Output("rad", lambda x, u, p: x.psi + sideslip(x.v_x, x.v_y)),
    "speed": Output("m/s", lambda x, u, p: speed(x.v_x, x.v_y)),
    "velocity_x": Output("m/s", lambda x, u, p: x.v_x * ca.cos(x.psi) - x.v_y * ca.sin(x.psi)),
    "velocity_y": Output("m/s", lambda x, u, p: x.v_x * ca.sin(x.psi) + x.v_y * ca.cos(x.psi)),
}
"""Of models with position and heading. At standstill a course is the heading, while velocities stay what they are."""
PATH_MOTION = {
    "course_error": Output("rad", lambda x, u, p: x.heading_error + sideslip(x.v_x, x.v_y)),
    "speed": Output("m/s", lambda x, u, p: speed(x.v_x, x.v_y)),
    "velocity_along": Output("m/s", lambda x, u, p: x.v_x * ca.cos(x.heading_error) - x.v_y * ca.sin(x.heading_error)),
    "velocity_across": Output("m/s", lambda x, u, p: x.v_x * ca.sin(x.heading_error) + x.v_y * ca.cos(x.heading_error)),
}
"""Of models that know the car by its place beside a path: velocities along it, and to its left."""
