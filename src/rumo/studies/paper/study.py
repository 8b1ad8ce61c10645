"""The paper's case study: a car follows a sine path in wind, with noisy sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rumo.checks import known_names
from rumo.controllers import Controller
from rumo.discretization import Radau2
from rumo.errors import ArgumentError
from rumo.estimation import Butterworth, Estimator, ExtendedKalman
from rumo.problem import Problem
from rumo.references import SinePath
from rumo.registry import CONTROLLERS
from rumo.report.contents import Report
from rumo.simulation import Constant, Disturbance, Plant, RandomWalk, Scenario, Sensors
from rumo.studies.base import Key, Study
from rumo.studies.kpis import driving_kpis
from rumo.studies.paper.report import claims, sections
from rumo.terms import Penalty, Weight
from rumo.vehicles import PAPER_CAR, AsPrinted, ModifiedDugoff, dynamic_bicycle, four_wheel, friction_circles
from rumo.vehicles.chassis import BODY_STATES
from rumo.vehicles.commands import REAR_TORQUE, Drive
from rumo.vehicles.four_wheel import WHEELS
from rumo.vehicles.tyres import Tyre

if TYPE_CHECKING:
    import xarray as xr

SAMPLING_TIME = 0.04
HORIZON = 15
RUN = 24.0
"""Length of the paper's run [s]."""
TRACKED = ("p_x", "p_y", "psi", "v_x")
PATH = SinePath(amplitude=3.0, wavelength=60.0, speed=8.0, vehicle=PAPER_CAR)
PENALTY = Penalty(l1=1.0)
FILTER = Butterworth(cutoff=3.5)
WIND = RandomWalk(mean=2.0, std=1.5)
TYRE = ModifiedDugoff()
CORRECTED = AsPrinted()

CLOSE_WEIGHTS = {
    "p_x": Weight(10.0, 50.0),
    "p_y": Weight(10.0, 6.0),
    "psi": Weight(1.0, 0.6),
    "v_x": Weight(1.0, 10.0),
}
"""Weights that keep the car closer to its path than the paper's."""

NOISE = {
    "p_x": 0.05,
    "p_y": 0.05,
    "psi": 0.01,
    "v_x": 0.05,
    "v_y": 0.05,
    "omega": 0.01,
    "w_fl": 0.01,
    "w_fr": 0.01,
    "w_rl": 0.01,
    "w_rr": 0.01,
    "delta": 0.01,
}
"""The paper's table of measurement noise: standard deviations in the states' units."""


def kalman_filter() -> ExtendedKalman:
    """An extended Kalman filter for the study, in place of the Butterworth filter.

    Noise as in the paper's table; process noise by `fit_process_noise` on drives at 8 and 12 m/s in wind, rounded
    up. The scheme is its own: implicit Euler, ahead by half a sample, would be the largest part of what it misses.
    """
    axle = {"w_f": NOISE["w_fl"] / np.sqrt(2.0), "w_r": NOISE["w_rl"] / np.sqrt(2.0)}
    body = {name: NOISE[name] for name in (*BODY_STATES, "delta")}
    process = {"p_x": 5e-4, "p_y": 5e-4, "psi": 1e-4, "v_x": 5e-4, "v_y": 5e-4, "omega": 3e-4, "delta": 3e-5}
    return ExtendedKalman(noise=body | axle, process=process | {"w_f": 1e-3, "w_r": 1e-3}, discretization=Radau2())


def reference_ranges(path: SinePath) -> dict[str, float]:
    """Span of each tracked output over the paper's run; 0 to 10 m/s for the constant speed."""
    reference = path(SAMPLING_TIME * np.arange(round(RUN / SAMPLING_TIME)))
    return {name: 10.0 if name == "v_x" else float(np.ptp(reference[name])) for name in TRACKED}


def paper_weights(path: SinePath) -> dict[str, Weight]:
    """The paper's relative weight of 1 on each output, normalised by its range."""
    return {name: Weight(1.0, span) for name, span in reference_ranges(path).items()}


@dataclass(frozen=True)
class PaperStudy(Study):
    """Settings of the case study; the defaults are the paper's, or what Rumo takes where the paper is silent.

    Parameters
    ----------
    controllers : tuple of str
        Names in `rumo.registry.CONTROLLERS`.
    seed : int
        Of wind and noise, the same for every controller.
    duration : float
        [s]; the paper's run is 24.
    path : SinePath
        What to follow.
    weights : mapping of str to Weight, optional
        Of the tracked outputs p_x, p_y, psi, v_x; the paper's if not given.
    penalty : Penalty, optional
        Of the friction circles; None makes them hard.
    delay : int
        Samples from measurement to input.
    horizon : int
        Sampling intervals that the controllers look ahead.
    sampling_time : float
        [s].
    estimator : Estimator, optional
        The paper's Butterworth filter by default; None gives the raw measurements.
    noise : mapping of str to float
        Standard deviation of each plant state's measurement.
    wind : Disturbance
        Wind speed [m/s], blowing across, to +y.
    initial_error : float
        Distance from the first point of the reference in p_y [m].
    as_printed : AsPrinted
        Equations to take as the paper prints them, in prediction and plant alike.
    drive : Drive
        What the car is told along its way: the torque of each rear wheel, as in the paper, or of their axle.
    tyre : Tyre
        Of the plant.

    Raises
    ------
    ArgumentError
        If a controller is unknown or the duration is shorter than a sample.
    """

    keeps_logs: ClassVar[bool] = True

    controllers: tuple[str, ...] = ("rti", "nlp", "ltv")
    seed: int = 0
    duration: float = RUN
    path: SinePath = PATH
    weights: Mapping[str, Weight] | None = None
    penalty: Penalty | None = PENALTY
    delay: int = 1
    horizon: int = HORIZON
    sampling_time: float = SAMPLING_TIME
    estimator: Estimator | None = FILTER
    noise: Mapping[str, float] = field(default_factory=NOISE.copy)
    wind: Disturbance = WIND
    initial_error: float = 1.0
    as_printed: AsPrinted = CORRECTED
    drive: Drive = REAR_TORQUE
    tyre: Tyre = TYRE

    def __post_init__(self) -> None:
        known_names(self.controllers, "controllers", CONTROLLERS)
        if not self.duration >= self.sampling_time or not np.isfinite(self.duration):
            raise ArgumentError("duration", f"{self.duration:g} s", f"at least one sample of {self.sampling_time:g} s")

    def problem(self) -> Problem:
        """The optimal control problem that every controller solves."""
        return Problem(
            dynamic_bicycle(PAPER_CAR, as_printed=self.as_printed, drive=self.drive),
            horizon=self.horizon,
            sampling_time=self.sampling_time,
            track=self.weights or paper_weights(self.path),
            moves={"torque": Weight(5.0, range=600.0), "steering_rate": Weight(5.0, range=3.0)},
            bounds={
                "torque": (-300.0, 300.0),
                "steering_rate": (-1.5, 1.5),
                "delta": (-np.deg2rad(45.0), np.deg2rad(45.0)),
            },
            constraints=friction_circles(PAPER_CAR, self.penalty, self.as_printed),
            delay=self.delay,
        )

    def initial_state(self) -> dict[str, float]:
        """Plant state beside the first point of the reference, driving along it without slip."""
        start = {name: float(values[0]) for name, values in self.path(np.zeros(1)).items()}
        state = {name: start.get(name, 0.0) for name in BODY_STATES} | {"v_y": 0.0, "omega": 0.0}
        state["p_y"] += self.initial_error
        return state | {f"w_{wheel}": self.path.speed / PAPER_CAR.r for wheel in WHEELS} | {"delta": 0.0}

    def runs(self) -> dict[Key, Scenario]:
        """A drive with each controller, by its name."""
        problem, plant = self.problem(), self.plant()
        return {(name,): self.scenario(name, problem, plant) for name in self.controllers}

    def summary(self, results: Mapping[str, xr.Dataset]) -> dict[str, Any]:
        """How each controller drives, and the paper's claims; `results` are logs by controller name."""
        controllers = {name: driving_kpis(log) for name, log in results.items()}
        return {
            "study": "paper",
            "seed": self.seed,
            "sampling_time_s": self.sampling_time,
            "horizon": self.horizon,
            "controllers": controllers,
            "claims": claims(controllers, {name: log.sizes["time"] for name, log in results.items()}),
        }

    def report(self, results: Mapping[str, xr.Dataset]) -> Report:
        """The summary, as tables, and the paper's figures."""
        content = self.summary(results)
        lead = (
            f"A car follows a sine path at {self.path.speed:g} m/s for {self.duration:g} s {self.conditions}; "
            f"horizon {self.horizon}, sampling period {1e3 * self.sampling_time:g} ms, seed {self.seed}."
        )
        return Report("The paper's case study", lead, content, sections(content, results))

    @property
    def conditions(self) -> str:
        """Wind and measurements, in words."""
        wind = "without wind" if self.wind == Constant(0.0) else "in wind"
        noise = "noisy" if any(self.noise.values()) else "exact"
        return f"{wind}, with {noise}, {'unfiltered' if self.estimator is None else 'filtered'} measurements"

    def plant(self) -> Plant:
        """The car that is driven."""
        model = four_wheel(PAPER_CAR, self.tyre, self.as_printed, drive=self.drive)
        return Plant(model, self.sampling_time)

    def scenario(self, controller: str | type[Controller], problem: Problem, plant: Plant) -> Scenario:
        """One drive: `problem()` solved by a controller that drives `plant()`."""
        return Scenario(
            problem,
            plant,
            self.initial_state(),
            self.path,
            self.duration,
            controller=controller,
            sensors=Sensors(self.noise),
            estimator=self.estimator,
            disturbances={"wind_speed": self.wind, "wind_direction": Constant(np.pi / 2.0)},
            seed=self.seed,
        )
