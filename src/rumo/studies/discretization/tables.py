"""The discretisation study's tables, from its summary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rumo.report.tables import Table, number
from rumo.status import Status

SHARES = (0.1, 0.01, 0.001, 1e-4)
"""Of the outputs' range along the horizon: accuracies to ask for."""
FORGOTTEN = 0.01
"""A scheme that leaves more of a perturbation has not forgotten it."""


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
    return number(100.0 * share) if share >= 1e-6 else "0"


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
                title = content["schemes"][best["scheme"]]["title"]
                words = f"{title}, {best['step_s']:g}\u00a0s: {best['total_us']:.3g}\u00a0us"
            row.append(words)
        rows.append(row)
    return Table(["Error below", *(f"{100.0 * share:g} %" for share in SHARES)], rows, tuple(range(1 + len(SHARES))))


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
