"""The discretisation study's summary, tables and sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rumo.registry import DISCRETIZATIONS
from rumo.report.charts import Chart, Panels
from rumo.report.machine import machine
from rumo.report.page import Section
from rumo.report.tables import Table, number
from rumo.signals import Array
from rumo.status import Status
from rumo.studies.discretization.one_mode import INTERVALS, PRODUCTS
from rumo.studies.discretization.study import CaseResult, DiscretizationStudy, Outcome, Results

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
"""A scheme that leaves more of a perturbation has not forgotten it."""
ROUNDING = 1e-15
"""Errors below are not shown."""


def summary(study: DiscretizationStudy, results: Results) -> dict[str, Any]:
    """Content of `summary.json`; None stands for what is not finite.

    `abs_r` is |R(z)| at the z of `abs_r_at`; `following_error` and `observed_order` are those of the model of Prothero
    and Robinson, by its rate.
    """
    at_fast = int(np.argmin(np.abs(PRODUCTS - FAST)))
    return {
        "study": "discretization",
        "machine": machine(),
        "schemes": {
            name: {
                "title": LABELS[name],
                "order": DISCRETIZATIONS[name].order,
                "a_stable": DISCRETIZATIONS[name].a_stable,
                "l_stable": DISCRETIZATIONS[name].l_stable,
                "explicit": DISCRETIZATIONS[name].explicit,
                "abs_r_at_minus_1e6": float(results.damping[name][at_fast]),
                "abs_r": results.damping[name].tolist(),
                "following_error": {
                    f"{rate:g}": e[name].tolist() for rate, e in results.following.items() if name in e
                },
                "observed_order": {f"{rate:g}": _order(e[name]) for rate, e in results.following.items() if name in e},
            }
            for name in study.schemes
        },
        "abs_r_at": PRODUCTS.tolist(),
        "following_intervals": list(INTERVALS),
        "cases": {name: _case(result) for name, result in results.cases.items()},
    }


def _order(errors: Array) -> float:
    """Slope of the errors over the step, where they are not rounding."""
    seen = errors > 10.0 * ROUNDING
    return float(-np.polyfit(np.log(np.array(INTERVALS)[seen]), np.log(errors[seen]), 1)[0])


def _case(result: CaseResult) -> dict[str, Any]:
    return {
        "title": result.case.title,
        "backend": result.backend,
        "length_s": result.case.length,
        "outputs": list(result.case.outputs),
        "unit": result.case.unit,
        "span": result.span,
        "error_floor": result.floor,
        "fastest_rate_1_s": result.rate,
        "largest_stable_step_s": dict(result.stable_steps),
        "error_with_a_tenth_fewer_substeps": {name: _finite(error) for name, error in result.errors_beyond.items()},
        "outcomes": [_outcome(outcome) for outcome in result.outcomes],
    }


def _outcome(outcome: Outcome) -> dict[str, Any]:
    accuracy, times = outcome.accuracy, outcome.times
    return {
        "scheme": outcome.scheme,
        "step_s": outcome.step,
        "intervals": outcome.intervals,
        "substeps": outcome.substeps,
        "error": _finite(accuracy.outputs),
        "state_error": _finite(accuracy.states),
        "perturbation_left": _finite(accuracy.perturbation_left),
        "closed_loop_rms": outcome.rms,
        "status_counts": dict(outcome.statuses),
        "linearize_us": times.linearize,
        "prepare_us": times.prepare,
        "feedback_us": times.feedback,
        "total_us": times.prepare + times.feedback,
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def properties_table(content: Mapping[str, Any]) -> Table:
    """What each scheme declares, and what it leaves of a fast mode; and its largest stable step in each case."""
    cases = content["cases"].values()
    heads = ["", "Order", "A-stable", "L-stable", "|R(-1e6)|", *(f"{case['title']}" for case in cases)]
    rows = [
        [
            scheme["title"],
            str(scheme["order"]),
            *("yes" if scheme[key] else "no" for key in ("a_stable", "l_stable")),
            f"{scheme['abs_r_at_minus_1e6']:.0e}" if abs(scheme["abs_r_at_minus_1e6"] - 1.0) > 1e-3 else "1",
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
        "Perturbation\nleft [%]",
        f"Closed loop\nRMS{unit}",
        "Linearise\n[us]",
        "Step\n[us]",
    ]
    rows: list[list[str]] = []
    for outcome in case["outcomes"]:
        error, left = outcome["error"], outcome["perturbation_left"]
        rows.append(
            [
                schemes[outcome["scheme"]]["title"],
                f"{outcome['step_s']:g} s",
                f"{outcome['intervals']} x {outcome['substeps']}",
                "-" if error is None else _error(error, case["error_floor"]),
                "-" if error is None else _percent(error / case["span"]),
                "-" if left is None else _percent(left),
                number(outcome["closed_loop_rms"]),
                number(outcome["linearize_us"]),
                number(outcome["total_us"]),
            ]
        )
    return Table(heads, rows)


def _error(error: float, floor: float) -> str:
    return f"{error:.1e}" if error > floor else f"< {floor:.0e}"


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
        and outcome["perturbation_left"] <= FORGOTTEN
        and all(Status[status].solved for status in outcome["status_counts"])
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


def order_table(content: Mapping[str, Any]) -> Table:
    """Declared orders, and those observed on one mode that follows a sine."""
    schemes = content["schemes"].values()
    rates = list(dict.fromkeys(rate for scheme in schemes for rate in scheme["following_error"]))
    middle = len(content["following_intervals"]) // 2
    step = f"1/{content['following_intervals'][middle]} s"
    rows: list[list[str]] = []
    for scheme in schemes:
        orders, errors = scheme["observed_order"], scheme["following_error"]
        rows.append(
            [
                scheme["title"],
                str(scheme["order"]),
                *(f"{orders[rate]:.1f}" if rate in orders else "-" for rate in rates),
                *(f"{errors[rate][middle]:.1e}" if rate in errors else "-" for rate in rates),
            ]
        )
    heads = [f"Observed,\nrate {float(rate):,.0f} 1/s" for rate in rates]
    heads += [f"Error, step {step},\nrate {float(rate):,.0f} 1/s" for rate in rates]
    return Table(["", "Order", *heads], rows)


def find(case: Mapping[str, Any], scheme: str, step: float) -> Mapping[str, Any] | None:
    """The outcome of a scheme with intervals of a length [s]; None if not tried."""
    return next((o for o in case["outcomes"] if o["scheme"] == scheme and o["step_s"] == step), None)


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
        linearise, whole = (_times(rk4[key] / euler[key]) for key in ("linearize_us", "total_us"))
        sentences.append(
            f"{case['title']}: RK4 needs {_counted(rk4['substeps'], 'substep')} in an interval of {fine:g} s to be "
            f"stable; its linearisation takes {linearise} as long as implicit Euler's, its step {whole}."
        )
    if euler is not None and radau is not None and None not in (euler["error"], radau["error"]):
        sentences.append(
            f"{case['title']}: Radau2 at {coarse:g} s is off by {radau['error']:.2g}{unit} and takes "
            f"{radau['total_us']:.3g} us a step, implicit Euler at {fine:g} s by {euler['error']:.2g}{unit} in "
            f"{euler['total_us']:.3g} us."
        )
    return sentences


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


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
        Section("Order", [ORDER, order_table(content)]),
        Section("Figures", figures),
        *every_case,
    ]


CHEAPEST = (
    "Error of the predicted outputs over the horizon, against CVODES, as a share of their range; time of preparation "
    f"and feedback. Only schemes that forget all but {100.0 * FORGOTTEN:g} % of a small error of a fast state within "
    "the horizon, and whose closed loop was solved at every step."
)
STABILITY = (
    "|R(-1e6)| is what one step leaves of a mode that is a million times faster; below each case the largest step with "
    "which none of its modes grows. Explicit schemes are given as many substeps as that takes."
)
ORDER = "One state that follows a sine: as slow as the sine, and a million times faster (Prothero and Robinson, 1974)."
