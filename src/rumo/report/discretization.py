"""The discretisation study's summary, tables and sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rumo.registry import DISCRETIZATIONS
from rumo.report.charts import Chart, Panels
from rumo.report.page import Section
from rumo.report.tables import Table, number
from rumo.studies.discretization import CaseResult, DiscretizationStudy, Outcome
from rumo.studies.one_mode import decays

LABELS = {
    "implicit-euler": "Implicit Euler",
    "implicit-midpoint": "Implicit midpoint",
    "trapezoidal": "Trapezoidal",
    "bdf2": "BDF2",
    "sdirk2": "SDIRK2",
    "radau2": "Radau2",
    "radau3": "Radau3",
    "gauss2": "Gauss2",
    "explicit-euler": "Explicit Euler",
    "rk4": "RK4",
}
FAST = -1e6
"""Product of rate and step of the mode in the table of properties."""
SHARES = (0.1, 0.01, 0.001, 1e-4)
"""Of the outputs' range along the horizon: accuracies to ask for."""
FORGOTTEN = 0.01
"""A scheme that leaves more of a kick has not forgotten it."""


def summary(study: DiscretizationStudy, results: Mapping[str, CaseResult]) -> dict[str, Any]:
    """Content of `summary.json`; None stands for what is not finite."""
    left = decays(study.schemes, np.array([FAST]))
    return {
        "study": "discretization",
        "backend": study.backend,
        "schemes": {
            name: {
                "title": LABELS[name],
                "order": DISCRETIZATIONS[name].order,
                "a_stable": DISCRETIZATIONS[name].a_stable,
                "l_stable": DISCRETIZATIONS[name].l_stable,
                "explicit": DISCRETIZATIONS[name].explicit,
                "left_of_a_fast_mode": float(left[name][0]),
            }
            for name in study.schemes
        },
        "cases": {name: _case(result) for name, result in results.items()},
    }


def _case(result: CaseResult) -> dict[str, Any]:
    return {
        "title": result.case.title,
        "length_s": result.case.length,
        "outputs": list(result.case.outputs),
        "unit": result.case.unit,
        "span": result.span,
        "fastest_rate_1_s": result.rate,
        "largest_stable_step_s": dict(result.stable_steps),
        "error_with_a_tenth_fewer_substeps": {name: _finite(error) for name, error in result.errors_beyond.items()},
        "outcomes": [_outcome(outcome) for outcome in result.outcomes],
    }


def _outcome(outcome: Outcome) -> dict[str, Any]:
    linearize, prepare, feedback = outcome.times_us
    return {
        "scheme": outcome.scheme,
        "step_s": outcome.step,
        "intervals": outcome.intervals,
        "substeps": outcome.substeps,
        "error": _finite(outcome.error.outputs),
        "state_error": _finite(outcome.error.states),
        "kick_left": _finite(outcome.error.kick_left),
        "closed_loop_rms": outcome.rms,
        "status_counts": dict(outcome.statuses),
        "linearize_us": linearize,
        "prepare_us": prepare,
        "feedback_us": feedback,
        "total_us": prepare + feedback,
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def properties_table(content: Mapping[str, Any]) -> Table:
    """What each scheme declares, and what it leaves of a fast mode; and its largest stable step in each case."""
    cases = content["cases"].values()
    heads = ["", "Order", "A-stable", "L-stable", "Left of a\nfast mode", *(f"{case['title']}" for case in cases)]
    rows = [
        [
            scheme["title"],
            str(scheme["order"]),
            *("yes" if scheme[key] else "no" for key in ("a_stable", "l_stable")),
            f"{scheme['left_of_a_fast_mode']:.0e}" if abs(scheme["left_of_a_fast_mode"] - 1.0) > 1e-3 else "1",
            *(_duration(case["largest_stable_step_s"].get(name)) for case in cases),
        ]
        for name, scheme in content["schemes"].items()
    ]
    return Table(heads, rows)


def _duration(seconds: float | None) -> str:
    if seconds is None:
        return "any"
    scale, unit = next((s, u) for s, u in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")) if seconds >= s)
    return f"{seconds / scale:.3g} {unit}"


def outcome_table(case: Mapping[str, Any], schemes: Mapping[str, Any]) -> Table:
    """Every scheme and step of a case."""
    unit = "" if case["unit"] == "1" else f" [{case['unit']}]"
    heads = [
        "",
        "Interval",
        "Intervals x\nsubsteps",
        f"Error{unit}",
        "of the\nrange [%]",
        "Kick\nleft [%]",
        f"Closed loop\nRMS{unit}",
        "Linearise\n[us]",
        "Step\n[us]",
    ]
    rows: list[list[str]] = []
    for outcome in case["outcomes"]:
        error, left = outcome["error"], outcome["kick_left"]
        rows.append(
            [
                schemes[outcome["scheme"]]["title"],
                f"{outcome['step_s']:g} s",
                f"{outcome['intervals']} x {outcome['substeps']}",
                "-" if error is None else f"{error:.1e}",
                "-" if error is None else _percent(error / case["span"]),
                "-" if left is None else _percent(left),
                number(outcome["closed_loop_rms"]),
                number(outcome["linearize_us"]),
                number(outcome["total_us"]),
            ]
        )
    return Table(heads, rows)


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g}" if share >= 1e-6 else "0"


def cheapest(case: Mapping[str, Any], share: float) -> Mapping[str, Any] | None:
    """The outcome of a case with the shortest step time whose error is below a share of the outputs' range.

    Among those that forget a kick, and whose closed loop was solved throughout; None if there is none.
    """
    good = [
        outcome
        for outcome in case["outcomes"]
        if outcome["error"] is not None
        and outcome["error"] <= share * case["span"]
        and outcome["kick_left"] <= FORGOTTEN
        and set(outcome["status_counts"]) <= {"OPTIMAL", "SOFT_VIOLATED"}
    ]
    return min(good, key=lambda outcome: outcome["total_us"], default=None)


def cheapest_table(content: Mapping[str, Any]) -> Table:
    """For each case and accuracy, the scheme and interval with the shortest step time."""
    rows: list[list[str]] = []
    for case in content["cases"].values():
        row = [case["title"]]
        for share in SHARES:
            best = cheapest(case, share)
            words = "-"
            if best is not None:
                words = (
                    f"{content['schemes'][best['scheme']]['title']}, {best['step_s']:g} s: {best['total_us']:.3g} us"
                )
            row.append(words)
        rows.append(row)
    return Table(["Error below", *(f"{100.0 * share:g} %" for share in SHARES)], rows)


def find(case: Mapping[str, Any], scheme: str, step: float | None = None) -> Mapping[str, Any] | None:
    """The outcome of a scheme, with intervals of a length [s] or else with the cheapest step; None if not tried."""
    tried = [o for o in case["outcomes"] if o["scheme"] == scheme and step in (None, o["step_s"])]
    return min(tried, key=lambda outcome: outcome["total_us"], default=None)


def findings(content: Mapping[str, Any]) -> list[str]:
    """What the figures say, case by case, in sentences; only of schemes that were tried."""
    return [sentence for case in content["cases"].values() for sentence in _findings_of(case)]


def _findings_of(case: Mapping[str, Any]) -> list[str]:
    steps = sorted({outcome["step_s"] for outcome in case["outcomes"]}, reverse=True)
    coarse, fine = steps[1], steps[2]
    unit = "" if case["unit"] == "1" else f" {case['unit']}"
    euler, radau, rk4 = find(case, "implicit-euler", fine), find(case, "radau2", coarse), find(case, "rk4", fine)
    sentences: list[str] = []
    if euler is not None and rk4 is not None:
        sentences.append(
            f"{case['title']}: RK4 needs {rk4['substeps']} substeps in an interval of {fine:g} s to be stable; its "
            f"linearisation takes {_times(rk4['linearize_us'] / euler['linearize_us'])} as long as implicit Euler's, "
            f"its step {_times(rk4['total_us'] / euler['total_us'])}."
        )
    if euler is not None and radau is not None and None not in (euler["error"], radau["error"]):
        sentences.append(
            f"{case['title']}: Radau2 at {coarse:g} s is off by {radau['error']:.2g}{unit} and takes "
            f"{radau['total_us']:.3g} us a step, implicit Euler at {fine:g} s by {euler['error']:.2g}{unit} in "
            f"{euler['total_us']:.3g} us."
        )
    return sentences


def _times(ratio: float) -> str:
    return f"{ratio:,.0f} times" if ratio >= 10.0 else f"{ratio:.2g} times"


def discretization_sections(content: Mapping[str, Any], figures: Sequence[Chart | Panels]) -> list[Section]:
    """What the page shows, from `summary`, and the figures."""
    every_case = [
        Section(case["title"], [outcome_table(case, content["schemes"])]) for case in content["cases"].values()
    ]
    return [
        Section("The cheapest step for an accuracy", [CHEAPEST, cheapest_table(content)]),
        Section("What the figures say", findings(content)),
        Section("Stability", [STABILITY, properties_table(content)]),
        Section("Figures", figures),
        *every_case,
    ]


CHEAPEST = (
    "Error of the predicted outputs over the horizon, against CVODES, as a share of their range; time of preparation "
    "and feedback. Left out: schemes that keep a small error of a fast state, or more than "
    f"{100.0 * FORGOTTEN:g} % of it, until the end of the horizon."
)
STABILITY = (
    f"What is left of a mode after one step with lambda h = {FAST:.0e}, and the largest step with which no mode grows "
    "in a case. Explicit schemes are given as many substeps as that takes."
)
