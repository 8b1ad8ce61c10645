"""The paper's drive: a sine path in wind, with noisy sensors."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Annotated

from rumo.estimation import Butterworth, Estimator
from rumo.problem import Problem
from rumo.references import SinePath
from rumo.scenarios.arguments import Argument
from rumo.simulation import Constant, Plant, RandomWalk, Scenario
from rumo.studies.paper import (
    FILTER,
    HORIZON,
    NOISE,
    PATH,
    PENALTY,
    RUN,
    SAMPLING_TIME,
    TYRE,
    WIND,
    PaperStudy,
    kalman_filter,
    reference_ranges,
)
from rumo.terms import Penalty
from rumo.vehicles import PAPER_CAR, four_wheel, friction_circles
from rumo.vehicles.varied import OF_ALL_CARS

ESTIMATORS = ("butterworth", "ekf", "none")


def paper(
    *,
    duration: Annotated[float, Argument("s", "Of the drive.", above=0.0)] = RUN,
    speed: Annotated[float, Argument("m/s", "Along the path.", above=0.0)] = PATH.speed,
    amplitude: Annotated[float, Argument("m", "Of the path.")] = PATH.amplitude,
    wavelength: Annotated[float, Argument("m", "Of the path.", above=0.0)] = PATH.wavelength,
    initial_error: Annotated[float, Argument("m", "From the path at first, to the left.")] = 1.0,
    horizon: Annotated[int, Argument("1", "Sampling intervals that the controller looks ahead.", least=2)] = HORIZON,
    sampling_time: Annotated[float, Argument("s", "From one sample to the next.", above=0.0)] = SAMPLING_TIME,
    delay: Annotated[int, Argument("1", "Samples from measurement to input.", least=0)] = 1,
    penalty: Annotated[float, Argument("1", "Price of leaving the friction circles.", above=0.0)] = PENALTY.l1,
    estimator: Annotated[str, Argument("1", "From measurements to a state.", choices=ESTIMATORS)] = "butterworth",
    filter_cutoff: Annotated[float, Argument("Hz", "Of the Butterworth filter.", above=0.0)] = FILTER.cutoff,
    noise_scale: Annotated[float, Argument("1", "Times the paper's noise of the sensors.", least=0.0)] = 1.0,
    wind_mean: Annotated[float, Argument("m/s", "Of the wind, which blows across, to +y.")] = WIND.mean,
    wind_std: Annotated[float, Argument("m/s", "Standard deviation of the wind.", least=0.0)] = WIND.std,
    mass: Annotated[float, Argument("kg", "Of the car that is driven.", above=0.0)] = PAPER_CAR.m,
    inertia: Annotated[float, Argument("kg m^2", "Of the car that is driven.", above=0.0)] = PAPER_CAR.I,
    friction: Annotated[
        float, Argument("1", "Between the tyres and the road that is driven.", above=0.0)
    ] = PAPER_CAR.mu,
) -> Scenario:
    """A car follows a sine path in wind, with noisy sensors: the paper's case study.

    What the controller believes of the car stays the paper's. `plant.NAME` changes further numbers of the one that is
    driven: its plant has the numbers of `rumo.vehicles.varied.OF_ALL_CARS` as parameters.
    """
    path = SinePath(amplitude, wavelength, speed, PAPER_CAR)
    study = PaperStudy(
        duration=duration,
        path=path,
        delay=delay,
        horizon=horizon,
        sampling_time=sampling_time,
        estimator=_estimator(estimator, filter_cutoff),
        noise={name: noise_scale * deviation for name, deviation in NOISE.items()},
        wind=RandomWalk(wind_mean, wind_std),
        initial_error=initial_error,
    )
    problem = _problem(horizon, sampling_time, delay, path, penalty)
    scenario = study.scenario("rti", problem, _plant(sampling_time))
    driven = {"m": (mass, PAPER_CAR.m), "I": (inertia, PAPER_CAR.I), "mu": (friction, PAPER_CAR.mu)}
    other = {name: Constant(value) for name, (value, own) in driven.items() if value != own}
    return replace(scenario, disturbances={**scenario.disturbances, **other}) if other else scenario


def _estimator(name: str, cutoff: float) -> Estimator | None:
    if name == "none":
        return None
    return Butterworth(cutoff) if name == "butterworth" else kalman_filter()


@lru_cache(maxsize=64)
def _problem(horizon: int, sampling_time: float, delay: int, path: SinePath, penalty: float) -> Problem:
    """One structure, and so one build, for all paths and prices."""
    problem = _structure(horizon, sampling_time, delay)
    prices = {} if penalty == PENALTY.l1 else {name: Penalty(penalty) for name in friction_circles(PAPER_CAR)}
    ranges = {} if path == PATH else reference_ranges(path)
    return problem.changed(ranges=ranges, penalties=prices) if ranges or prices else problem


@lru_cache(maxsize=32)
def _structure(horizon: int, sampling_time: float, delay: int) -> Problem:
    return PaperStudy(horizon=horizon, sampling_time=sampling_time, delay=delay).problem()


@lru_cache(maxsize=32)
def _plant(sampling_time: float) -> Plant:
    return Plant(four_wheel(PAPER_CAR, TYRE, varied=OF_ALL_CARS), sampling_time)
