"""How busy the actuators are, and whether commands were within bounds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rumo.signals import Array
from rumo.simulation.log import names, signal
from rumo.studies.kpis.base import Kpi, table
from rumo.studies.kpis.driven import Driven

AT_REST = 0.1
"""Speed below which a car is at rest [m/s]."""


def _by_input(drive: Driven, of: Callable[[str, Array], float | None]) -> dict[str, float | None] | None:
    """A figure of the moves (K - 1,) of each input from sample to sample."""
    if len(drive.time) < 2:
        return None
    every = names(drive.log, "input")
    return {name: of(name, np.abs(np.diff(signal(drive.log, "applied", name)))) for name in every}


def _range(drive: Driven, name: str) -> float:
    """Of the bounds, infinite where there are none."""
    lower, upper = (drive.log[f"input_{side}"].sel(input=name).to_numpy() for side in ("lower", "upper"))
    return float(np.max(upper - lower))


def _variation(drive: Driven) -> dict[str, float | None] | None:
    return _by_input(drive, lambda name, moves: float(moves.sum()) / _span(drive, moves))


def _activity(drive: Driven) -> dict[str, float | None] | None:
    def of(name: str, moves: Array) -> float | None:
        reach = _range(drive, name)
        return float(moves.sum()) / _span(drive, moves) / reach if np.isfinite(reach) else None

    return _by_input(drive, of)


def _activity_at_rest(drive: Driven) -> dict[str, float | None] | None:
    velocity = drive.motion("v_x", "v_y")
    if velocity is None:
        return None
    resting = np.hypot(*velocity) < AT_REST
    between = resting[1:] & resting[:-1]
    if not between.any():
        return None

    def of(name: str, moves: Array) -> float | None:
        reach = _range(drive, name)
        return 100.0 * float(moves[between].mean()) / reach if np.isfinite(reach) else None

    return _by_input(drive, of)


def _span(drive: Driven, moves: Array) -> float:
    return len(moves) * drive.sampling_time


def _out_of_bounds(drive: Driven) -> int:
    commands = drive.log["commanded"].to_numpy()
    within = (commands >= drive.log["input_lower"].to_numpy()) & (commands <= drive.log["input_upper"].to_numpy())
    return int((~within.all(axis=1)).sum())


INPUTS = table(
    [
        Kpi(
            "input_variation",
            "Variation a second",
            "1/s",
            "Total variation of each input over the time, in the input's unit.",
            _variation,
        ),
        Kpi(
            "input_activity",
            "Variation a second, over range",
            "1/s",
            "Total variation of each input over the time and its range, that between its bounds.",
            _activity,
        ),
        Kpi(
            "input_activity_at_rest",
            "Move a step at rest, over range",
            "%",
            "Mean move of each input from sample to sample while the car stands, over its range.",
            _activity_at_rest,
        ),
        Kpi(
            "bad_commands",
            "Bad commands",
            "1",
            "Steps with a command that is not finite or out of bounds.",
            _out_of_bounds,
        ),
    ]
)
"""Of the inputs."""
