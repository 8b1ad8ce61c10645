"""Stiff systems, each with a prediction to compute and a control problem to solve: for the study of schemes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from rumo.model import Model
from rumo.problem import Problem
from rumo.references import OfTime, Sine, SinePath
from rumo.signals import Array
from rumo.studies.paper import CLOSE_WEIGHTS, PaperStudy
from rumo.terms import Weight
from rumo.textbook import robertson_reactor, van_de_vusse_reactor, van_der_pol
from rumo.vehicles import PAPER_CAR


@dataclass(frozen=True)
class Case:
    """A system, and what is asked of it.

    Attributes
    ----------
    title : str
        In words.
    steps : tuple of float
        Interval lengths to try [s], at least three, each a multiple of the next.
    length : float
        Of the horizon [s].
    start : mapping of str to float
        State one interval before the prediction begins; what is fast has settled until then.
    inputs : callable
        Time [s] -> inputs (nu,) of the prediction, held over the longest intervals.
    outputs : tuple of str
        States whose error is measured: the distance in them.
    unit : str
        Of the outputs.
    perturbation : mapping of str to float
        A small error of a measured state, which the true system forgets in no time.
    control : callable
        (N, sampling time [s]) -> the problem of the closed loop.
    reference : callable
        What the closed loop follows.
    duration : float
        Of the closed loop [s].
    scales : mapping of str to float
        Sizes below which states do not matter, where far from 1.
    """

    title: str
    steps: tuple[float, ...]
    length: float
    start: Mapping[str, float]
    inputs: Callable[[float], Array]
    outputs: tuple[str, ...]
    unit: str
    perturbation: Mapping[str, float]
    control: Callable[[int, float], Problem]
    reference: OfTime
    duration: float
    scales: Mapping[str, float] = field(default_factory=dict)

    def intervals(self, step: float) -> int:
        """Number of intervals of the horizon."""
        return round(self.length / step)

    def problem(self, step: float) -> Problem:
        """The problem of the closed loop with intervals of this length."""
        return self.control(self.intervals(step), step)

    @cached_property
    def model(self) -> Model:
        """The system; in the closed loop it is the plant as well."""
        return self.problem(self.steps[0]).model


def _bicycle(speed: float) -> Case:
    path = SinePath(amplitude=3.0, wavelength=60.0, speed=speed, vehicle=PAPER_CAR)
    start = {name: float(values[0]) for name, values in path(np.zeros(1)).items()}
    wheels = {"w_f": speed / PAPER_CAR.r, "w_r": speed / PAPER_CAR.r}
    return Case(
        title=f"Car, {speed:g} m/s",
        steps=(0.16, 0.08, 0.04, 0.02),
        length=0.64,
        start=start | {"v_y": 0.0, "omega": 0.0, "delta": 0.0} | wheels,
        inputs=_steered,
        outputs=("p_x", "p_y"),
        unit="m",
        perturbation={"w_r": 0.05},
        control=partial(_driven, path),
        reference=path,
        duration=6.4,
    )


def _driven(path: SinePath, horizon: int, step: float) -> Problem:
    return PaperStudy(path=path, weights=CLOSE_WEIGHTS, horizon=horizon, sampling_time=step).problem()


def _steered(t: float) -> Array:
    return np.array([60.0 * np.sin(4.0 * t + 0.3), 0.4 * np.cos(5.0 * t)])


def _pushed(t: float) -> Array:
    return np.array([0.5 + 1.5 * np.sin(5.0 * t)])


def _fed(t: float) -> Array:
    return np.array([14.0 + 6.0 * np.sin(0.004 * t), -1100.0 + 900.0 * np.cos(0.005 * t)])


def _diluted(t: float) -> Array:
    return np.array([0.02 + 0.015 * np.sin(0.15 * t)])


def _oscillator(horizon: int, step: float) -> Problem:
    return Problem(
        van_der_pol(),
        horizon=horizon,
        sampling_time=step,
        track={"position": Weight(10.0, range=1.0)},
        moves={"force": Weight(0.1, range=4.0)},
        bounds={"force": (-4.0, 4.0)},
        delay=1,
        safe_input={"force": 1.6},
    )


def _reactor(horizon: int, step: float) -> Problem:
    return Problem(
        van_de_vusse_reactor(),
        horizon=horizon,
        sampling_time=step,
        track={"c_b": Weight(10.0, range=0.2)},
        moves={"flow": Weight(0.1, range=30.0), "cooling": Weight(0.1, range=9000.0)},
        bounds={"flow": (3.0, 35.0), "cooling": (-9000.0, 0.0)},
        delay=1,
        safe_input={"flow": 14.19, "cooling": -1113.5},
    )


def _kinetics(horizon: int, step: float) -> Problem:
    return Problem(
        robertson_reactor(),
        horizon=horizon,
        sampling_time=step,
        track={"a": Weight(10.0, range=0.5)},
        moves={"dilution": Weight(0.1, range=0.05)},
        bounds={"dilution": (0.0, 0.05)},
        delay=1,
        safe_input={"dilution": 0.015},
    )


CASES: dict[str, Callable[[], Case]] = {
    **{f"car-{speed}": partial(_bicycle, float(speed)) for speed in (2, 5, 10, 15)},
    "van-der-pol": lambda: Case(
        title="Van der Pol, mu = 1000",
        steps=(0.16, 0.08, 0.04, 0.02),
        length=0.64,
        start={"position": 2.0, "speed": 0.0},
        inputs=_pushed,
        outputs=("position",),
        unit="1",
        perturbation={"speed": 0.1},
        control=_oscillator,
        reference=Sine("position", 1.6, 0.2, 3.2),
        duration=6.4,
    ),
    "van-de-vusse": lambda: Case(
        title="Van de Vusse reactor",
        steps=(240.0, 120.0, 60.0, 30.0),
        length=960.0,
        start={"c_a": 2.14, "c_b": 1.09, "temperature": 114.2, "jacket": 112.9},
        inputs=_fed,
        outputs=("c_b",),
        unit="mol/l",
        perturbation={"jacket": 1.0},
        control=_reactor,
        reference=Sine("c_b", 1.0, 0.05, 3840.0),
        duration=7680.0,
    ),
    "robertson": lambda: Case(
        title="Robertson's kinetics",
        steps=(8.0, 4.0, 2.0, 1.0),
        length=32.0,
        start={"a": 0.8, "b": 2.6e-5, "c": 0.2},
        inputs=_diluted,
        outputs=("a",),
        unit="1",
        perturbation={"b": 1e-6},
        control=_kinetics,
        reference=Sine("a", 0.84, 0.02, 128.0),
        duration=256.0,
        scales={"b": 1e-4},
    ),
}
"""Makers of the cases, by name."""
