"""Terms of a problem: weights, bounds, constraints and the price of violating them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import FARTHEST, as_float, as_numbers, checked
from rumo.errors import ArgumentError, ShapeError
from rumo.model import Expression
from rumo.signals import Array


@dataclass(frozen=True)
class Weight:
    """Weight of a squared deviation, normalised by the range the signal moves in.

    The cost term is `value * (deviation / range)**2`.

    Parameters
    ----------
    value : float or sequence of float, length N
        One weight for all stages, or one for each of stages 1 to N.
    range : float
        Span between the smallest and largest expected value, in the signal's unit.
    """

    value: ArrayLike
    range: float = 1.0


@dataclass(frozen=True)
class Penalty:
    """Price of violating a soft constraint by s, at each stage: `l1 * s + l2 * s**2`.

    For a constraint given by an expression s is its value above the limit. For a bound of a state the price does not
    depend on units: `N * (l1 * s + l2 * s**2)`, with s the violation over the width of the bounds where it is largest
    (or over the distance from zero, where there is only one), and N the length of the horizon in samples. So with
    `l1 = 1` a violation as large as that costs as much as errors as large as their range, with a weight of 1, on the
    whole horizon.

    With `l1` above the constraint's multiplier the penalty is exact: the constraint holds whenever it can (Kerrigan and
    Maciejowski, 2000).

    Parameters
    ----------
    l1 : float
        Price of the violation, positive.
    l2 : float
        Additional price of its square, zero or more.
    """

    l1: float
    l2: float = 0.0


@dataclass(frozen=True)
class Constraint:
    """A path constraint `G(x, u) <= limit`, imposed wherever a free input can influence it.

    Parameters
    ----------
    expression : callable
        `(x, u, p) -> CasADi expression`, scalar; scale it so that 0.01 is a small violation.
    penalty : Penalty, optional
        Makes the constraint soft; without it the constraint is hard.
    limit : float or sequence of float, length N
        One limit for all stages, or one for each of stages 1 to N.
    """

    expression: Expression
    penalty: Penalty | None = None
    limit: ArrayLike = 0.0


@dataclass(frozen=True)
class Bounds:
    """Lower and upper bound of a signal; a penalty makes the bounds of a state soft.

    Parameters
    ----------
    lower, upper : float or sequence of float, length N
        In the signal's unit; infinite where there is none. A sequence has one for each of stages 1 to N of a state, or
        for each interval of an input.
    penalty : Penalty, optional
        Price of a violation; for states only.
    """

    lower: ArrayLike = -np.inf
    upper: ArrayLike = np.inf
    penalty: Penalty | None = None


BoundsLike = Bounds | Sequence[ArrayLike]


def as_limits(value: BoundsLike, argument: str, horizon: int) -> tuple[Array, Array]:
    """Lower and upper limits (N,), each pair with a number between them; anything else raises, naming `argument`."""
    pair: Any = (value.lower, value.upper) if isinstance(value, Bounds) else value
    try:
        given = [np.array([float(limit)] if np.ndim(limit) == 0 else limit, dtype=float) for limit in pair]
        lower, upper = (np.broadcast_to(limits, horizon) if limits.size == 1 else limits for limits in given)
    except (TypeError, ValueError, OverflowError):
        raise ArgumentError(
            argument, repr(pair), "a pair (lower, upper)", "Use -inf or inf for a missing side."
        ) from None
    for limits in (lower, upper):
        if limits.shape != (horizon,):
            raise ShapeError(
                argument, f"{limits.size} limits", f"one limit, or {horizon}: one for each interval of the horizon"
            )
    for k, (low, high) in enumerate(zip(lower.tolist(), upper.tolist(), strict=True)):
        where = argument if all(limits.size == 1 for limits in given) else f"{argument} at {k}"
        if np.isnan(low) or np.isnan(high):
            raise ArgumentError(where, f"({low}, {high})", "numbers", "Use -inf or inf for no bound.")
        if low > high:
            raise ArgumentError(where, f"({low:g}, {high:g})", "lower <= upper", "Exchange the two bounds.")
        if any(FARTHEST < abs(limit) < np.inf for limit in (low, high)):
            raise ArgumentError(
                where,
                f"({low:g}, {high:g})",
                f"limits of at most {FARTHEST:.4g}, whose differences are numbers",
                "Use -inf or inf for no bound.",
            )
        if low == np.inf or high == -np.inf:
            raise ArgumentError(where, f"({low:g}, {high:g})", "an interval with a finite number in it")
    return lower, upper


def stage_weights(value: object, argument: str, horizon: int, *, positive: bool = False) -> Array:
    """Weights (N,) of one number or N of them; anything else raises, naming `argument`."""
    values = as_numbers(value, argument)
    if values.shape not in ((), (horizon,)):
        raise ShapeError(
            argument, f"{values.size} weights", f"one weight, or {horizon}: one for each stage of the horizon"
        )
    if not np.all(np.isfinite(values)) or np.any(values < 0.0) or (positive and np.any(values <= 0.0)):
        kind = "positive" if positive else "non-negative"
        raise ArgumentError(argument, f"weight {value!r}", f"{kind} finite numbers")
    return np.broadcast_to(values, horizon)


def check_penalty(penalty: Penalty | None, argument: str) -> None:
    """Raise, naming `argument`, unless the penalty is exact."""
    if penalty is None:
        return
    checked(penalty, argument, Penalty)
    for name, price in (("l1", penalty.l1), ("l2", penalty.l2)):
        if not isinstance(price, int | float | np.number):
            raise ArgumentError(f"{argument}.{name}", repr(price), "a number")
    l1, l2 = as_float(penalty.l1), as_float(penalty.l2)
    if not 0.0 < l1 < np.inf or not 0.0 <= l2 < np.inf:
        raise ArgumentError(argument, f"l1={l1:g}, l2={l2:g}", "l1 > 0 and l2 >= 0, both finite", "l1 makes it exact.")
