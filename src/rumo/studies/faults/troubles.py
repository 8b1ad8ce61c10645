"""What can go wrong in a drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from rumo.model import Model
from rumo.simulation.faults import Changed, Drift, Fault, Noisy, make_fault
from rumo.studies.paper import PaperStudy
from rumo.vehicles import PAPER_CAR, AsPrinted, VehicleParameters, four_wheel
from rumo.vehicles.chassis import BODY_STATES
from rumo.vehicles.commands import Drive
from rumo.vehicles.tyres import Tyre

ABSURD_STEERING = 100.0
"""A steering rate [rad/s] that no later input can make up for within the hard bounds of the steering angle."""
DRIFT = 0.5
"""Of a drifting position [m/s]."""
NOISIER = 30.0
"""Standard deviation of noise over that of the sensors."""
ICE = 0.3
"""Friction coefficient."""

Make = Callable[[range, PaperStudy], Fault]
"""(bad samples, settings of the drive) -> what goes wrong."""


@dataclass(frozen=True)
class Trouble:
    """What goes wrong in a drive.

    Attributes
    ----------
    title : str
        In words.
    make : callable or None
        The fault, of some samples of a drive; None if nothing goes wrong.
    whole : bool
        It is there for the whole drive, since such things do not come and go.
    """

    title: str
    make: Make | None = None
    whole: bool = False

    def faults(self, bad: range, drive: PaperStudy) -> tuple[Fault, ...]:
        """Of the bad samples of a drive."""
        return () if self.make is None else (self.make(bad, drive),)


def _of(kind: str, **settings: Any) -> Make:
    return lambda bad, drive: make_fault(kind, bad, **settings)


def _noisy(bad: range, drive: PaperStudy) -> Fault:
    more = np.sqrt(NOISIER**2 - 1.0)  # on top of the sensors' own
    noise = {name: more * drive.noise.get(name, 0.0) for name in (*BODY_STATES, "delta")}
    # The speed of an axle is the mean of its wheels'.
    axles = {f"w_{axle}": more * drive.noise.get(f"w_{axle}l", 0.0) / np.sqrt(2.0) for axle in "fr"}
    return Noisy(bad, noise | axles, seed=drive.seed)


def _car(**changes: Any) -> Make:
    car = replace(PAPER_CAR, **changes)
    return lambda bad, drive: Changed(bad, _model(car, drive.tyre, drive.as_printed, drive.drive))


@lru_cache(maxsize=16)
def _model(car: VehicleParameters, tyre: Tyre, as_printed: AsPrinted, drive: Drive) -> Model:
    return four_wheel(car, tyre, as_printed, drive=drive)


def _stiffness(factor: float) -> Make:
    tyres = {
        axle: replace(tyre, C_s=factor * tyre.C_s, C_a=factor * tyre.C_a)
        for axle, tyre in (("front", PAPER_CAR.front), ("rear", PAPER_CAR.rear))
    }
    return _car(**tyres)


NO_SOLUTION = {"torque": 0.0, "steering_rate": ABSURD_STEERING}

FAULTS: dict[str, Trouble] = {
    "none": Trouble("No fault"),
    # Numbers that cannot be
    "nan": Trouble("NaN in a state", _of("reading", signal="psi", value=np.nan)),
    "infinite": Trouble("Infinite speed", _of("reading", signal="v_x", value=np.inf)),
    "jump": Trouble("Position off by 100 m", _of("offset", signal="p_y", by=100.0)),
    "spin": Trouble("Yaw rate 50 rad/s", _of("reading", signal="omega", value=50.0)),
    "frozen": Trouble("Frozen measurements", _of("frozen")),
    "missing": Trouble("No measurement", _of("missing")),
    "dropout": Trouble("Half of the samples missing", lambda bad, drive: make_fault("dropout", bad, seed=drive.seed)),
    # Numbers that could be
    "turn": Trouble("Heading a turn too large", _of("offset", signal="psi", by=2.0 * np.pi)),
    "turn-back": Trouble("Heading a turn too small", _of("offset", signal="psi", by=-2.0 * np.pi)),
    "heading": Trouble("Heading off by 1 rad", _of("offset", signal="psi", by=1.0)),
    "near": Trouble("Position off by 5 m", _of("offset", signal="p_y", by=5.0)),
    "far": Trouble("Position off by 30 m", _of("offset", signal="p_y", by=30.0)),
    "drift": Trouble("Position drifts, 0.5 m/s", lambda bad, drive: Drift(bad, "p_y", DRIFT * drive.sampling_time)),
    "stuck": Trouble("Position stuck", _of("frozen", signals=("p_y",))),
    "sign": Trouble("Heading of wrong sign", _of("scaled", signals=("psi",), factor=-1.0)),
    "swapped": Trouble("x and y swapped", _of("swapped", first="p_x", second="p_y")),
    "zero": Trouble("All zero", _of("scaled", factor=0.0)),
    "standing": Trouble("Speed zero", _of("reading", signal="v_x", value=0.0)),
    "noise": Trouble("30 times the noise", _noisy),
    "late": Trouble("One sample late", _of("late-measurement", by=1)),
    # Actuators and commands
    "dead": Trouble("Steering dead", _of("weakened", input="steering_rate", share=0.0)),
    "dead-told": Trouble("Steering dead, told", _of("weakened", input="steering_rate", share=0.0, told=True)),
    "slow": Trouble("Steering slow", _of("slow", input="steering_rate", share=0.2)),
    "slow-told": Trouble("Steering slow, told", _of("slow", input="steering_rate", share=0.2, told=True)),
    "weak": Trouble("Half the torque", _of("weakened", input="torque", share=0.5)),
    "delay": Trouble("Delay 2 for 1", _of("late-command", by=1)),
    # The solver
    "failure": Trouble("Solver fails", _of("misinformed", applied=NO_SOLUTION)),
    "budget": Trouble("Budget of 0 iterations", _of("budget", iterations=0)),
    # The world
    "ice": Trouble("Friction 0.3", _of("disturbed", parameter="mu", value=ICE)),
    "gust": Trouble("Gust of 25 m/s", _of("disturbed", parameter="wind_speed", value=25.0)),
    "heavy": Trouble("Mass +20 %", _car(m=1.2 * PAPER_CAR.m), whole=True),
    "light": Trouble("Mass -20 %", _car(m=0.8 * PAPER_CAR.m), whole=True),
    "stiff": Trouble("Tyres 20 % stiffer", _stiffness(1.2), whole=True),
    "soft": Trouble("Tyres 20 % softer", _stiffness(0.8), whole=True),
}
"""What can go wrong, by name; the first is the undisturbed drive."""
