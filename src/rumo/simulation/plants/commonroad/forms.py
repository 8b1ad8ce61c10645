"""The models of CommonRoad: what their states are in Rumo's terms, and where they begin.

Names are Rumo's wherever a state is what Rumo calls so, and in the order of CommonRoad's vectors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import atan2, copysign, cos, hypot, pi, sin, tan
from typing import Any

MOTION = {"p_x": "m", "p_y": "m", "psi": "rad", "v_x": "m/s", "v_y": "m/s", "omega": "rad/s", "delta": "rad"}
"""States of `rolling_bicycle`, all of which every form has as states or outputs."""


@dataclass(frozen=True)
class Form:
    """One of CommonRoad's models.

    Attributes
    ----------
    states : mapping of str to str
        Units, in the order of CommonRoad's vector.
    start : callable
        From a motion, with the names of `MOTION`, and the car's parameters to a state (nx,).
    observe : callable
        From a state (nx,) and the car's parameters to what of `MOTION` is no state, and to `more`.
    more : mapping of str to str
        Further outputs, with units.
    wheels : tuple of int
        Which states are speeds of wheels, which cannot be negative.
    friction : bool
        Whether tyres know a largest force.
    reverse : bool
        Whether equations hold for a car that drives backwards.
    """

    states: Mapping[str, str]
    start: Callable[[Mapping[str, float], Any], list[float]]
    observe: Callable[[list[float], Any], dict[str, float]]
    wheels: tuple[int, ...] = ()
    friction: bool = False
    reverse: bool = True
    more: Mapping[str, str] = field(default_factory=dict[str, str])
    outputs: dict[str, str] = field(init=False)

    def __post_init__(self) -> None:
        missing = {name: unit for name, unit in MOTION.items() if name not in self.states}
        object.__setattr__(self, "outputs", {**missing, **self.more})


def _velocity(motion: Mapping[str, float]) -> tuple[float, float]:
    """Speed, negative in reverse, and sideslip angle within a quarter turn."""
    v_x, v_y = motion["v_x"], motion["v_y"]
    if v_x == 0.0:
        return abs(v_y), copysign(0.5 * pi, v_y) if v_y else 0.0
    return copysign(hypot(v_x, v_y), v_x), atan2(copysign(1.0, v_x) * v_y, abs(v_x))


def _start_kinematic(motion: Mapping[str, float], p: Any) -> list[float]:
    """A rear axle that rolls: its speed is v_x, while v_y and omega follow from the steering angle."""
    x, y, psi = motion["p_x"], motion["p_y"], motion["psi"]
    return [x - p.b * cos(psi), y - p.b * sin(psi), motion["delta"], motion["v_x"], psi]


def _observe_kinematic(x: list[float], p: Any) -> dict[str, float]:
    rear_x, rear_y, delta, v_x, psi, *_ = x
    omega = v_x * tan(delta) / (p.a + p.b)
    return {"p_x": rear_x + p.b * cos(psi), "p_y": rear_y + p.b * sin(psi), "v_y": p.b * omega, "omega": omega}


def _start_single_track(motion: Mapping[str, float], p: Any) -> list[float]:
    v, beta = _velocity(motion)
    return [motion["p_x"], motion["p_y"], motion["delta"], v, motion["psi"], motion["omega"], beta]


def _start_drift(motion: Mapping[str, float], p: Any) -> list[float]:
    from vehiclemodels.init_std import init_std

    return init_std(_start_single_track(motion, p), p)


def _start_multi_body(motion: Mapping[str, float], p: Any) -> list[float]:
    from vehiclemodels.init_mb import init_mb

    return init_mb(_start_single_track(motion, p), p)


def _observe_speed(x: list[float], p: Any) -> dict[str, float]:
    return {"v_x": x[3] * cos(x[6]), "v_y": x[3] * sin(x[6])}


def _observe_loads(x: list[float], p: Any) -> dict[str, float]:
    """Of tyres: springs, which pull at the road where a wheel would be in the air. Left and right as for the wheels."""
    loads: dict[str, float] = {}
    for axle, track, roll, z in (("f", p.T_f, x[13], x[16]), ("r", p.T_r, x[18], x[21])):
        mean, half = z + p.R_w * (cos(roll) - 1.0), 0.5 * track * sin(roll)
        loads[f"load_{axle}l"], loads[f"load_{axle}r"] = p.K_zt * (mean + half), p.K_zt * (mean - half)
    return loads


LOADS: Mapping[str, str] = dict.fromkeys(("load_fl", "load_fr", "load_rl", "load_rr"), "N")
KINEMATIC = {"rear_x": "m", "rear_y": "m", "delta": "rad", "v_x": "m/s", "psi": "rad"}
SINGLE_TRACK = {"p_x": "m", "p_y": "m", "delta": "rad", "v": "m/s", "psi": "rad", "omega": "rad/s", "beta": "rad"}


def _axle(axle: str) -> dict[str, str]:
    """States of an axle of the multi-body model."""
    rates = {f"roll_{axle}": "rad", f"roll_rate_{axle}": "rad/s", f"v_y_{axle}": "m/s"}
    return {**rates, f"z_{axle}": "m", f"v_z_{axle}": "m/s"}


MULTI_BODY = {
    **{"p_x": "m", "p_y": "m", "delta": "rad", "v_x": "m/s", "psi": "rad", "omega": "rad/s"},
    **{"roll": "rad", "roll_rate": "rad/s", "pitch": "rad", "pitch_rate": "rad/s"},
    **{"v_y": "m/s", "z": "m", "v_z": "m/s"},
    **_axle("f"),
    **_axle("r"),
    # CommonRoad's axes point down and to the right; with angles that turn left, its left is our right.
    **dict.fromkeys(("w_fr", "w_fl", "w_rr", "w_rl"), "rad/s"),
    **{"shift_f": "m", "shift_r": "m"},
}

FORMS: Mapping[str, Form] = {
    "ks": Form(KINEMATIC, _start_kinematic, _observe_kinematic),
    "kst": Form(
        {**KINEMATIC, "hitch": "rad"}, lambda motion, p: [*_start_kinematic(motion, p), 0.0], _observe_kinematic
    ),
    "st": Form(SINGLE_TRACK, _start_single_track, _observe_speed, reverse=False),
    "std": Form(
        {**SINGLE_TRACK, "w_f": "rad/s", "w_r": "rad/s"}, _start_drift, _observe_speed, wheels=(7, 8), friction=True
    ),
    "mb": Form(
        MULTI_BODY,
        _start_multi_body,
        _observe_loads,
        wheels=(23, 24, 25, 26),
        friction=True,
        reverse=False,
        more=LOADS,
    ),
}
"""By CommonRoad's names."""
