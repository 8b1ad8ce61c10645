"""The figures of the paper's study."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rumo.report.charts import LIMIT, NEUTRAL, REFERENCE, Chart, Line, Panels
from rumo.signals import Array
from rumo.simulation.log import signal
from rumo.studies.kpis import tracking_error
from rumo.studies.looks import label, look

if TYPE_CHECKING:
    import xarray as xr


def paper_charts(logs: Mapping[str, xr.Dataset]) -> list[Chart | Panels]:
    """The paper's figures, in its order, how far the controllers are from each other, a histogram for each."""
    first = next(iter(logs.values()))
    time = first["time"].to_numpy()
    dt = float(first.attrs["sampling_time_s"])
    end = dt * len(time)
    return [
        _trajectory("trajectory-first-2s", f"Trajectories, first {min(2.0, end):g} s", logs, 2.0),
        _trajectory("trajectory", f"Trajectories, {end:g} s", logs, np.inf),
        Chart(
            "wind",
            "Wind speed",
            "Time [s]",
            "Wind speed [m/s]",
            (Line("Wind", time, signal(first, "disturbance", "wind_speed"), NEUTRAL, steps=True),),
        ),
        _input("torque", "Torque on each rear wheel", "N m", logs),
        _input("steering_rate", "Steering rate", "rad/s", logs),
        Chart(
            "tracking-error",
            "Tracking error",
            "Time [s]",
            "Distance from the reference [m]",
            tuple(Line(label(name), time, tracking_error(log), look(name)) for name, log in logs.items()),
        ),
        *([_differences(logs)] if len(logs) > 1 else []),
        *(_step_times(name, log, dt) for name, log in logs.items()),
    ]


def _trajectory(key: str, title: str, logs: Mapping[str, xr.Dataset], until: float) -> Chart:
    first = next(iter(logs.values()))
    shown = first["time"].to_numpy() <= until
    lines = [
        Line(
            label(name),
            signal(log, "plant", "p_x")[shown],
            signal(log, "plant", "p_y")[shown],
            look(name),
        )
        for name, log in logs.items()
    ]
    reference = Line(
        "Reference", signal(first, "reference", "p_x")[shown], signal(first, "reference", "p_y")[shown], REFERENCE
    )
    return Chart(key, title, "Position p_x [m]", "Position p_y [m]", (*lines, reference), equal=np.isfinite(until))


def _input(name: str, title: str, unit: str, logs: Mapping[str, xr.Dataset]) -> Chart:
    first = next(iter(logs.values()))
    limits = first[["input_lower", "input_upper"]].sel(input=name).isel(time=0)
    lower, upper = float(limits["input_lower"]), float(limits["input_upper"])
    lines = [
        Line(label(key), log["time"].to_numpy(), signal(log, "applied", name), look(key), steps=True)
        for key, log in logs.items()
    ]
    # A limit far from the data would flatten the curves; the title names it all the same.
    reach = max(float(np.abs(line.y).max()) for line in lines)
    span = first["time"].to_numpy()[[0, -1]]
    for limit, words in ((lower, "Lower limit"), (upper, "Upper limit")):
        if abs(limit) <= 2.0 * reach:
            lines.append(Line(words, span, np.full(2, limit), LIMIT))
    return Chart(
        name.replace("_", "-"),
        f"{title} (limits {lower:g} and {upper:g} {unit})",
        "Time [s]",
        f"{title.split(' on ')[0]} [{unit}]",
        tuple(lines),
    )


def _step_times(name: str, log: xr.Dataset, dt: float) -> Chart:
    samples = 1e3 * log["step_time"].to_numpy()
    return Chart(
        f"step-time-{name}",
        f"Execution time of a step, {label(name)}",
        "Time [ms]",
        "Steps",
        histogram=Line(f"{label(name)}, mean {samples.mean():.3g} ms", samples, samples, look(name)),
        markers=((1e3 * dt, f"Sampling period, {1e3 * dt:g} ms"),),
    )


def _differences(logs: Mapping[str, xr.Dataset]) -> Panels:
    """How far controllers are from the direct NLP, or the first of them if it did not drive: curves that coincide."""
    best = "nlp" if "nlp" in logs else next(iter(logs))

    def lines(variable: str, name: str, steps: bool = False) -> tuple[Line, ...]:
        return tuple(
            Line(label(key), log["time"].to_numpy(), _less(log, logs[best], variable, name), look(key), steps)
            for key, log in logs.items()
            if key != best
        )

    return Panels(
        "difference",
        f"Difference from the {label(best)}'s drive".replace("the Direct", "the direct"),
        "Time [s]",
        "Difference [unit in the title]",
        (
            ("Position p_x [m]", lines("plant", "p_x")),
            ("Position p_y [m]", lines("plant", "p_y")),
            ("Torque on each rear wheel [N m]", lines("applied", "torque", steps=True)),
            ("Steering rate [rad/s]", lines("applied", "steering_rate", steps=True)),
        ),
        shared="x",
        height=1.9,
    )


def _less(log: xr.Dataset, other: xr.Dataset, variable: str, name: str) -> Array:
    return signal(log, variable, name) - signal(other, variable, name)
