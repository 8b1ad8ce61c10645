"""Van der Pol's oscillator, forced."""

from __future__ import annotations

from typing import Any

from rumo.model import Model, Parameter


def van_der_pol() -> Model:
    """A relaxation oscillator, `speed' = mu^2 ((1 - position^2) speed - position + force)`, in units of its slow time.

    States position [1] and speed [1/s]; input force [1]. With mu = 1000, the default, the speed settles a million
    times faster than the position moves, but for two jumps in each period of 1.6 s. Source: Hairer and Wanner (1996),
    ch. IV.10 (VDPOL).
    """

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "position": x.speed,
            "speed": p.mu**2 * ((1.0 - x.position**2) * x.speed - x.position + u.force),
        }

    return Model(
        states={"position": "1", "speed": "1/s"},
        inputs={"force": "1"},
        dynamics=dynamics,
        parameters={"mu": Parameter("1", 1000.0)},
        name="van_der_pol",
    )
