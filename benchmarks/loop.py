"""Where the CPU time of a closed loop goes: what each part of it takes a sample.

    python benchmarks/loop.py [paper] [club] [--rounds 9]

Two drives with a controller and a plant that are there already, as in a campaign: the paper's 24 s, after a point that
moves on, and 24 s of `rumo drive` on the club circuit, along its path with an extended Kalman filter. Times are the
process's, so that other work on the machine does not count, and medians over some rounds. A clock around each part
takes time itself: it is measured, and taken off; `all` is of rounds without clocks, and `rest` what is left of it.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import wraps
from time import process_time_ns
from typing import Any
from unittest.mock import patch

import numpy as np

from rumo.controllers import Controller
from rumo.estimation.butterworth import RunningButterworth
from rumo.estimation.ekf.running import RunningExtendedKalman
from rumo.simulation import ClosedLoop, Recorder, Scenario
from rumo.simulation.driven import DrivenPlant
from rumo.simulation.moment import Moment
from rumo.simulation.observation import Observation
from rumo.simulation.previews import PreviewedParameters, Previews
from rumo.simulation.run import record
from rumo.simulation.sensors import RunningSensors
from rumo.studies import kpis
from rumo.studies.drive import Drive
from rumo.studies.kpis import DRIVING, KPIS, Driven
from rumo.studies.paper import PaperStudy

SECONDS = 24.0
PARTS: dict[str, tuple[tuple[Any, str], ...]] = {
    "set-up": ((ClosedLoop, "__init__"), (Recorder, "__init__")),
    "plant": ((DrivenPlant, "advance"),),
    "controller": ((Moment, "plan"),),
    "estimator": ((RunningButterworth, "update"), (RunningExtendedKalman, "update")),
    "reference": ((Previews, "at"),),
    "parameters ahead": ((PreviewedParameters, "look"),),
    "place": ((Observation, "told"),),
    "sensors": ((RunningSensors, "read"),),
    "recorder": ((Recorder, "record"),),
    "log": ((Recorder, "log"),),
    "figures of merit": ((kpis, "kpis"),),
}
"""What is told apart, and the functions that do it; none calls another."""


def paper() -> tuple[Scenario, Callable[[Any], Any]]:
    """The paper's drive, and what is said of its log."""
    study = PaperStudy(controllers=("rti",), duration=SECONDS)
    return study.runs()[("rti",)], lambda log: kpis.kpis(Driven(log), DRIVING)


def club() -> tuple[Scenario, Callable[[Any], Any]]:
    """The beginning of a lap, and what is said of its log."""
    study = Drive(track="club")
    lap: Any = next(iter(study.runs().values()))  # a DriveRun
    scenario = replace(lap.scenario, duration=SECONDS)
    road = lap.track, lap.path, lap.profile, study.car
    return scenario, lambda log: kpis.kpis(Driven(log, *road, scenario.plant), KPIS)


DRIVES = {"paper": paper, "club": club}


def drive(scenario: Scenario, controller: Controller, judge: Callable[[Any], Any]) -> float:
    """Time of a drive and of all that is said of it, a sample [us]."""
    start = process_time_ns()
    judge(record(ClosedLoop(scenario, controller)))
    return 1e-3 * (process_time_ns() - start) / scenario.samples


def clocked(spent: Counter[str], part: str, function: Callable[..., Any], clock: int) -> Callable[..., Any]:
    """A function whose time is added up, less that of the clock [ns]."""

    @wraps(function)
    def call(*arguments: Any, **named: Any) -> Any:
        start = process_time_ns()
        try:
            return function(*arguments, **named)
        finally:
            spent[part] += process_time_ns() - start - clock

    return call


@contextmanager
def clocks(spent: Counter[str], clock: int) -> Generator[None]:
    """Clocks around all parts."""
    with ExitStack() as stack:
        for part, functions in PARTS.items():
            for owner, name in functions:
                stack.enter_context(patch.object(owner, name, clocked(spent, part, getattr(owner, name), clock)))
        yield


def time_of_clock(repetitions: int = 20_000) -> int:
    """What a clock around nothing tells [ns]."""
    spent: Counter[str] = Counter()
    call = clocked(spent, "nothing", lambda: None, 0)
    for _ in range(repetitions):
        call()
    return round(spent["nothing"] / repetitions)


def measure(name: str, rounds: int) -> None:
    """Print what each part takes a sample [us]."""
    scenario, judge = DRIVES[name]()
    controller = scenario.make_controller()
    drive(scenario, controller, judge)
    clock = time_of_clock()
    every: list[float] = []
    parts: dict[str, list[float]] = {part: [] for part in PARTS}
    for _ in range(rounds):
        every.append(drive(scenario, controller, judge))
        spent: Counter[str] = Counter()
        with clocks(spent, clock):
            drive(scenario, controller, judge)
        for part, times in parts.items():
            times.append(1e-3 * spent[part] / scenario.samples)
    whole = float(np.median(every))
    medians = {part: float(np.median(times)) for part, times in parts.items()}
    print(f"\n{name}: {scenario.samples} samples, us of CPU time a sample, median of {rounds} drives")
    for part, time in sorted(medians.items(), key=lambda item: -item[1]):
        print(f"{part:>18} {time:7.1f}")
    print(f"{'rest':>18} {whole - sum(medians.values()):7.1f}")
    print(f"{'all':>18} {whole:7.1f}   {whole * scenario.samples * 1e-6:.3f} s a drive")
    print(f"{'all but the plant':>18} {whole - medians['plant']:7.1f}")


def main() -> None:
    """See above."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("drives", nargs="*", choices=[*DRIVES, []], default=[])
    parser.add_argument("--rounds", type=int, default=9)
    given = parser.parse_args()
    for name in given.drives or DRIVES:
        measure(name, given.rounds)


if __name__ == "__main__":
    main()
