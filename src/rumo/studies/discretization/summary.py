"""What came of the schemes, in numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rumo.registry import DISCRETIZATIONS
from rumo.signals import Array
from rumo.studies.discretization.one_case import CaseResult, Outcome
from rumo.studies.discretization.one_mode import INTERVALS, PRODUCTS, ModeResult

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
ROUNDING = 1e-15
"""Errors below are not shown."""


def scheme_outcomes(schemes: Sequence[str], mode: ModeResult | None) -> dict[str, Any]:
    """What each scheme declares, and what it makes of one mode; nothing if that is not known.

    `abs_r` is |R(z)| at the z of `PRODUCTS`; `following_error` and `observed_order` are those of the model of Prothero
    and Robinson, by its rate.
    """
    return {} if mode is None else {name: _scheme(name, mode) for name in schemes}


def _scheme(name: str, mode: ModeResult) -> dict[str, Any]:
    scheme, left = DISCRETIZATIONS[name], mode.damping[name]
    following = {f"{rate:g}": errors[name] for rate, errors in mode.following.items() if name in errors}
    return {
        "title": LABELS[name],
        "order": scheme.order,
        "a_stable": scheme.a_stable,
        "l_stable": scheme.l_stable,
        "explicit": scheme.explicit,
        "abs_r_at_minus_1e6": float(left[np.argmin(np.abs(PRODUCTS - FAST))]),
        "abs_r": left.tolist(),
        "following_error": {rate: errors.tolist() for rate, errors in following.items()},
        "observed_order": {rate: _order(errors) for rate, errors in following.items()},
    }


def _order(errors: Array) -> float:
    """Slope of the errors over the step, where they are not rounding."""
    seen = errors > 10.0 * ROUNDING
    return float(-np.polyfit(np.log(np.array(INTERVALS)[seen]), np.log(errors[seen]), 1)[0])


def case_outcome(result: CaseResult) -> dict[str, Any]:
    """What became of a case; None stands for what is not finite."""
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
