"""A figure for each question: what tells the estimators apart there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rumo.report.charts import LIMIT, REFERENCE, Chart, Line, Look, Panels
from rumo.signals import Array
from rumo.studies.estimation.contenders import CONTENDERS
from rumo.studies.estimation.outcome import NEAR
from rumo.studies.estimation.questions import QUESTIONS
from rumo.studies.estimation.summary import Results

TITLES = {
    "position": "Position",
    "psi": "Heading",
    "v_x": "Speed along the car",
    "v_y": "Speed across the car",
    "omega": "Yaw rate",
    "delta": "Steering angle",
}
"""Signals that sensors measure, from top to bottom."""
FIRST_SECONDS = 4.0
"""Of a wrong start, what is shown [s]."""
SMALLEST = 1e-4
"""Smaller errors are drawn as this one, on logarithmic axes [rad]."""
APART = 0.16
"""Between the marks of estimators that are alike, as a share of the distance of signals."""


def chart(question: str, content: Mapping[str, Any], results: Results) -> Chart | Panels | None:
    """The figure of a question, from the summary and what came of its drives; None if there is nothing to be shown."""
    drives = {name: of for name, of in results.get(question, {}).items() if of}
    if not drives:
        return None
    asked = QUESTIONS[question]
    if asked.extra:
        return unknown_chart(question, drives)
    if asked.off:
        return start_chart(question, drives)
    return error_chart(question, content)


def error_chart(question: str, content: Mapping[str, Any]) -> Panels:
    """Error of each signal over the noise of its sensor, for each estimator a mark."""
    asked, noise = content["questions"][question], content["noise"]
    sensors = {**noise, "position": float(np.hypot(noise["p_x"], noise["p_y"]))}
    rows, every = {name: -i for i, name in enumerate(TITLES)}, asked["estimators"]

    def marks(i: int, name: str, found: Mapping[str, Any]) -> Line:
        known = {signal: value for signal, value in found["rmse"].items() if signal in rows and value is not None}
        ratio = np.array([value / sensors[signal] for signal, value in known.items()])
        places = np.array([float(rows[signal]) for signal in known]) + APART * (0.5 * (len(every) - 1) - i)
        contender = CONTENDERS[name]
        return Line(contender.title, ratio, places, Look(contender.look.color, "", 1.0, contender.look.marker, 7.0))

    lines = tuple(marks(i, name, found) for i, (name, found) in enumerate(every.items()))
    raw = Line("Sensor alone", np.ones(2), np.array([min(rows.values()) - 0.7, 0.7]), REFERENCE)
    return Panels(
        f"errors-{question}",
        f"{asked['title']}: error of the estimate",
        "Root mean square error over the noise of the sensor [1]",
        "",
        (("", (*lines, raw)),),
        height=3.0,
        across=1,
        names=tuple((float(row), TITLES[signal]) for signal, row in rows.items()),
        logarithmic="x",
    )


def start_chart(question: str, drives: Mapping[str, Any]) -> Chart:
    """Error of the heading from the start on, in the drives of the first seed."""
    lines: list[Line] = []
    for name, of in drives.items():
        found = next(iter(of.values())).outcome
        time, error = _array(found["time_s"]), np.abs(_array(found["heading_error_rad"]))
        shown = time <= FIRST_SECONDS
        look = CONTENDERS[name].look
        lines.append(Line(CONTENDERS[name].title, time[shown], np.maximum(error[shown], SMALLEST), _plain(look)))
    ends = np.array([0.0, FIRST_SECONDS])
    lines.append(Line(f"Settled, {NEAR:g} rad", ends, np.full(2, NEAR), LIMIT))
    return Chart(
        f"errors-{question}",
        f"{QUESTIONS[question].title}: error of the heading",
        "Time [s]",
        "Error of the heading [rad]",
        tuple(lines),
        logarithmic="y",
    )


def unknown_chart(question: str, drives: Mapping[str, Any]) -> Chart:
    """What is estimated besides the states, in the drives of the first seed, and its bounds."""
    asked = QUESTIONS[question]
    (unknown,) = asked.extra
    lines: list[Line] = []
    end = 0.0
    for name, of in drives.items():
        found = next(iter(of.values())).outcome
        time = _array(found["time_s"])
        end = max(end, float(time[-1]))
        lines.append(
            Line(CONTENDERS[name].title, time, _array(found["unknowns"][unknown]), _plain(CONTENDERS[name].look))
        )
    most = asked.bounds[unknown][1]
    lines.append(Line("Bound", np.array([0.0, end]), np.full(2, most), LIMIT))
    return Chart(
        f"unknown-{question}",
        f"{asked.title}: the friction that is estimated",
        "Time [s]",
        "Friction [1]",
        tuple(lines),
    )


def _plain(look: Look) -> Look:
    """Without markers."""
    return Look(look.color, look.dash, look.width)


def _array(values: list[float | None]) -> Array:
    return np.array([np.nan if value is None else value for value in values])
