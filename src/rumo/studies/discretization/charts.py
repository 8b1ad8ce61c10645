"""The discretisation study's figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rumo.registry import DISCRETIZATIONS
from rumo.report.charts import Chart, Line, Look, Panels
from rumo.studies.discretization.summary import LABELS, ROUNDING

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


def discretization_figures(content: Mapping[str, Any]) -> list[Chart | Panels]:
    """Figures of a summary: work and precision, closed loop, decay of a mode, order reduction."""
    cases, schemes = content["cases"].values(), list(content["schemes"])

    implicit = [name for name in schemes if not DISCRETIZATIONS[name].explicit]

    def panels(key: str, title: str, x: str, x_label: str, y: str, y_label: str, shown: Sequence[str]) -> Panels:
        shown_cases = tuple((_heading(case), _lines(case, shown, x, y)) for case in cases)
        logarithmic = "xy" if y == "error" else "x"
        return Panels(key, title, x_label, y_label, shown_cases, shared="", height=1.9, logarithmic=logarithmic)

    if not schemes:
        return []
    error, step = "Error of the prediction", "Time of a step [us]"
    of_cases = [
        panels("work-precision", f"{error} against the time of a step", "total_us", step, "error", "Error", schemes),
        panels(
            "work-precision-implicit",
            f"{error} against the time of a step, implicit schemes",
            "total_us",
            step,
            "error",
            "Error",
            implicit,
        ),
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
    ]
    return [*(of_cases if cases else []), damping_chart(content), order_panels(content)]


def _heading(case: Mapping[str, Any]) -> str:
    return case["title"] if case["unit"] == "1" else f"{case['title']} [{case['unit']}]"


def _lines(case: Mapping[str, Any], schemes: Sequence[str], x: str, y: str) -> tuple[Line, ...]:
    lines: list[Line] = []
    for name in schemes:
        least = case["error_floor"] if y == "error" else 0.0
        points = [(o[x], max(o[y], least)) for o in case["outcomes"] if o["scheme"] == name and o[y] is not None]
        if points:
            across, up = np.array(points).T
            lines.append(Line(LABELS[name], across, up, LOOKS[name]))
    return tuple(lines)


def damping_chart(content: Mapping[str, Any]) -> Chart:
    """What one step leaves of a decaying mode."""
    products, lines = -np.array(content["abs_r_at"]), list[Line]()
    for name, scheme in content["schemes"].items():
        left = np.array(scheme["abs_r"])
        shown = (left <= 3.0) & (left >= 1e-7)
        lines.append(Line(LABELS[name], products[shown], left[shown], replace(LOOKS[name], marker="")))
    return Chart(
        "damping",
        "What one step leaves of a decaying mode",
        "Rate of the mode times length of the step [1]",
        "|R| [1]",
        tuple(lines),
        logarithmic="xy",
    )


def order_panels(content: Mapping[str, Any]) -> Panels:
    """Error of one mode that follows a sine, slow and fast."""
    lines: dict[str, list[Line]] = {}
    for name, scheme in content["schemes"].items():
        for rate, errors in scheme["following_error"].items():
            error, steps = np.array(errors), 1.0 / np.array(content["following_intervals"])
            seen = error > ROUNDING
            lines.setdefault(rate, []).append(Line(LABELS[name], steps[seen], error[seen], LOOKS[name]))
    panels = tuple((f"Rate {float(rate):,.0f} 1/s", tuple(of_rate)) for rate, of_rate in lines.items())
    title = "Error of a state that follows a sine at a given rate"
    return Panels("order", title, "Step [s]", "Largest error", panels, height=2.8, logarithmic="xy")
