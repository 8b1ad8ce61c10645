"""The discretisation study's figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rumo.registry import DISCRETIZATIONS
from rumo.report.charts import Chart, Line, Look, Panels
from rumo.report.discretization import LABELS
from rumo.studies.one_mode import decays, following_errors

LOOKS = {
    "implicit-euler": Look("#000000", "solid", 1.2, "circle"),
    "bdf2": Look("#009E73", "dash", 1.2, "square"),
    "sdirk2": Look("#56B4E9", "solid", 1.2, "triangle-up"),
    "radau2": Look("#0072B2", "solid", 2.0, "diamond"),
    "radau3": Look("#0072B2", "dashdot", 1.2, "star"),
    "implicit-midpoint": Look("#E69F00", "solid", 1.2, "triangle-down"),
    "trapezoidal": Look("#E69F00", "dash", 1.2, "x"),
    "gauss2": Look("#D55E00", "dashdot", 1.2, "cross"),
    "explicit-euler": Look("#999999", "dot", 1.2, "circle"),
    "rk4": Look("#CC79A7", "dot", 2.0, "square"),
}
"""L-stable schemes are black, blue and green; those that are only A-stable orange; explicit ones dotted."""

RATES = (1.0, 1e6)
INTERVALS = (4, 8, 16, 32, 64, 128)
ROUNDING = 1e-15
"""Errors below are not shown."""


def discretization_figures(content: Mapping[str, Any]) -> list[Chart | Panels]:
    """Figures of a summary: work and precision, closed loop, decay of a mode, order reduction."""
    cases, schemes = content["cases"].values(), list(content["schemes"])

    implicit = [name for name in schemes if not DISCRETIZATIONS[name].explicit]

    def panels(key: str, title: str, x: str, x_label: str, y: str, y_label: str, shown: Sequence[str]) -> Panels:
        of_cases = tuple((_heading(case), _lines(case, shown, x, y)) for case in cases)
        logarithmic = "xy" if y == "error" else "x"
        return Panels(key, title, x_label, y_label, of_cases, shared="", height=1.9, logarithmic=logarithmic)

    error, step = "Error of the prediction", "Time of a step [us]"
    return [
        panels("work-precision", f"{error} against time", "total_us", step, "error", "Error", schemes),
        panels("work-precision-implicit", f"{error}, implicit schemes", "total_us", step, "error", "Error", implicit),
        panels(
            "linearisation",
            f"{error} against the time to linearise the horizon",
            "linearize_us",
            "Time to linearise [us]",
            "error",
            "Error",
            implicit,
        ),
        panels("error-step", f"{error} against intervals", "step_s", "Interval [s]", "error", "Error", schemes),
        panels(
            "closed-loop",
            "Distance from the reference in closed loop",
            "step_s",
            "Interval, which is the sampling time [s]",
            "closed_loop_rms",
            "RMS",
            schemes,
        ),
        decay_chart(schemes),
        order_panels(schemes),
    ]


def _heading(case: Mapping[str, Any]) -> str:
    return case["title"] if case["unit"] == "1" else f"{case['title']} [{case['unit']}]"


def _lines(case: Mapping[str, Any], schemes: Sequence[str], x: str, y: str) -> tuple[Line, ...]:
    lines: list[Line] = []
    for name in schemes:
        points = [(o[x], o[y]) for o in case["outcomes"] if o["scheme"] == name and o[y] is not None]
        if points:
            across, up = np.array(points).T
            lines.append(Line(LABELS[name], across, up, LOOKS[name]))
    return tuple(lines)


def decay_chart(schemes: Sequence[str]) -> Chart:
    """What one step leaves of a decaying mode."""
    products = np.logspace(-1.0, 6.0, 141)
    left = decays(schemes, -products)
    shown = {name: (values <= 3.0) & (values >= 1e-7) for name, values in left.items()}
    return Chart(
        "decay",
        "What one step leaves of a decaying mode",
        "Rate of the mode times length of the step [1]",
        "Left after the step [1]",
        tuple(
            Line(LABELS[name], products[shown[name]], values[shown[name]], _without_marker(LOOKS[name]))
            for name, values in left.items()
        ),
        logarithmic="xy",
    )


def _without_marker(look: Look) -> Look:
    return Look(look.color, look.dash, look.width)


def order_panels(schemes: Sequence[str]) -> Panels:
    """Error of one mode that follows a sine, slow and fast."""
    panels: list[tuple[str, tuple[Line, ...]]] = []
    for rate in RATES:
        able = [name for name in schemes if rate <= RATES[0] or not DISCRETIZATIONS[name].explicit]
        lines: list[Line] = []
        for name, errors in following_errors(able, rate, INTERVALS).items():
            seen = errors > ROUNDING
            lines.append(Line(LABELS[name], 1.0 / np.array(INTERVALS)[seen], errors[seen], LOOKS[name]))
        panels.append((f"Rate {rate:,.0f} 1/s", tuple(lines)))
    title = "Error of a state that follows a sine at a given rate"
    return Panels("order", title, "Step [s]", "Largest error", tuple(panels), height=2.8, logarithmic="xy")
