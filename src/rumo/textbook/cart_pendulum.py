"""Pendulum on a cart."""

from __future__ import annotations

from typing import Any

import casadi as ca

from rumo.model import Model, Parameter


def cart_pendulum() -> Model:
    """Point-mass pendulum on a cart that a force pushes; angle 0 is upright.

    States position [m], speed [m/s], angle [rad], rate [rad/s]; input force [N]. Source: Fantoni and Lozano,
    "Non-linear Control for Underactuated Mechanical Systems" (2002), ch. 3, without friction.
    """

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        sin, cos = ca.sin(x.angle), ca.cos(x.angle)
        mass = p.cart_mass + p.bob_mass * sin**2
        push = u.force + p.bob_mass * sin * (p.length * x.rate**2 - p.gravity * cos)
        acceleration = push / mass
        return {
            "position": x.speed,
            "speed": acceleration,
            "angle": x.rate,
            "rate": (p.gravity * sin - acceleration * cos) / p.length,
        }

    return Model(
        states={"position": "m", "speed": "m/s", "angle": "rad", "rate": "rad/s"},
        inputs={"force": "N"},
        dynamics=dynamics,
        parameters={
            "cart_mass": Parameter("kg", 1.0),
            "bob_mass": Parameter("kg", 0.1),
            "length": Parameter("m", 0.5),
            "gravity": Parameter("m/s^2", 9.81),
        },
        name="cart_pendulum",
    )
