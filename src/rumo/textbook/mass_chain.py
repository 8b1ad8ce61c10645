"""Masses between springs."""

from __future__ import annotations

from typing import Any

from rumo.checks import whole_number
from rumo.model import Model, Parameter


def mass_chain(masses: int = 12) -> Model:
    """Equal masses in a row between two walls, joined by springs and weak dampers; a force pushes the first one.

    States x_1 .. x_n [m], displacements, and v_1 .. v_n [m/s]; input force [N]. By the defaults, frequencies go up to
    2 rad/s and damping ratios up to 0.01: a discretisation that damps does not suit it. Source: Wang and Boyd (2010),
    "Fast model predictive control using online optimization", sec. V; there undamped and with other inputs.

    Parameters
    ----------
    masses : int
        Number n of masses.
    """
    masses = whole_number(masses, "masses", 1)
    positions, speeds = ([f"{kind}_{i + 1}" for i in range(masses)] for kind in "xv")

    def dynamics(x: Any, u: Any, p: Any) -> dict[str, Any]:
        place, speed = ([0.0, *(getattr(x, name) for name in names), 0.0] for names in (positions, speeds))
        pull = [
            p.stiffness * (place[i + 1] - place[i]) + p.damping * (speed[i + 1] - speed[i]) for i in range(masses + 1)
        ]
        force = [pull[i + 1] - pull[i] for i in range(masses)]
        force[0] += u.force
        return {name: getattr(x, v) for name, v in zip(positions, speeds, strict=True)} | {
            name: total / p.mass for name, total in zip(speeds, force, strict=True)
        }

    return Model(
        states=dict.fromkeys(positions, "m") | dict.fromkeys(speeds, "m/s"),
        inputs={"force": "N"},
        dynamics=dynamics,
        parameters={
            "mass": Parameter("kg", 1.0),
            "stiffness": Parameter("N/m", 1.0),
            "damping": Parameter("N s/m", 0.01),
        },
        name="mass_chain",
    )
