"""A cooled reactor that changes its product, with limits of its temperature."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated

from rumo.problem import Problem
from rumo.references.signals import Sampled
from rumo.scenarios.arguments import Argument
from rumo.simulation import Plant, Scenario, Sensors
from rumo.terms import Bounds, Penalty, Weight
from rumo.textbook import van_de_vusse_reactor

SAMPLING_TIME = 36.0
START = {"c_a": 2.14, "c_b": 1.09, "temperature": 114.2, "jacket": 112.9}
"""The operating point, at which the safe input holds it."""
SAFE_INPUT = {"flow": 14.19, "cooling": -1113.5}


def reactor(
    *,
    horizon: Annotated[int, Argument("1", "Sampling intervals that the controller looks ahead.", least=2)] = 30,
    product: Annotated[float, Argument("mol/l", "Of cyclopentenol, wanted until the change.", above=0.0)] = 1.05,
    changed_product: Annotated[float, Argument("mol/l", "Wanted from then on.", above=0.0)] = 0.9,
    change: Annotated[float, Argument("s", "When the wanted product changes.", above=0.0)] = 360.0,
    temperature: Annotated[float, Argument("degC", "Wanted all the time.")] = 114.0,
    hottest: Annotated[float, Argument("degC", "Softly limited: the temperature.")] = 114.5,
    temperature_noise: Annotated[float, Argument("degC", "Standard deviation of the measurement.", least=0.0)] = 0.05,
    product_noise: Annotated[float, Argument("mol/l", "Standard deviation of the measurement.", least=0.0)] = 0.002,
) -> Scenario:
    """The van de Vusse reactor gets another product to make, and is to stay cool.

    What the feed brings are parameters of the plant: `plant.feed_concentration`, `plant.feed_temperature`.
    """
    problem = _problem(horizon)
    if hottest != HOTTEST:
        problem = problem.changed(bounds={"temperature": Bounds(upper=hottest)})
    wanted = Sampled((0.0, change), {"c_b": (product, changed_product), "temperature": (temperature,) * 2}, steps=True)
    noise = {"temperature": temperature_noise, "c_b": product_noise}
    return Scenario(
        problem,
        _plant(),
        START,
        wanted,
        3600.0,
        applied=SAFE_INPUT,
        sensors=Sensors(noise if any(noise.values()) else {}),
    )


HOTTEST = 114.5


@lru_cache(maxsize=32)
def _problem(horizon: int) -> Problem:
    return Problem(
        van_de_vusse_reactor(),
        horizon=horizon,
        sampling_time=SAMPLING_TIME,
        track={"c_b": Weight(1.0, range=0.2), "temperature": Weight(0.1, range=20.0)},
        moves={"flow": Weight(0.01, range=15.0), "cooling": Weight(0.01, range=4000.0)},
        bounds={
            "flow": (3.0, 35.0),
            "cooling": (-9000.0, 0.0),
            "temperature": Bounds(upper=HOTTEST, penalty=Penalty(1.0)),
        },
        safe_input=SAFE_INPUT,
    )


@lru_cache(maxsize=1)
def _plant() -> Plant:
    return Plant(van_de_vusse_reactor(), SAMPLING_TIME)
