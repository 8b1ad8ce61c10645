"""Terms of a problem: weights, bounds, constraints and the price of violating them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rumo.checks import checked
from rumo.errors import ArgumentError
from rumo.model import Expression


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
    """Price of violating a soft constraint by s: `l1 * s + l2 * s**2`.

    With `l1` above the constraint's multiplier the penalty is exact: the constraint holds whenever
    it can (Kerrigan and Maciejowski, 2000).

    Parameters
    ----------
    l1 : float
        Price per unit of violation, positive.
    l2 : float
        Additional price per squared unit, zero or more.
    """

    l1: float
    l2: float = 0.0


@dataclass(frozen=True)
class Constraint:
    """A path constraint `G(x, u) <= 0`, imposed wherever a free input can influence it.

    Parameters
    ----------
    expression : callable
        `(x, u, p) -> CasADi expression`, scalar; scale it so that 0.01 is a small violation.
    penalty : Penalty, optional
        Makes the constraint soft; without it the constraint is hard.
    """

    expression: Expression
    penalty: Penalty | None = None


@dataclass(frozen=True)
class Bounds:
    """Lower and upper bound of a signal; a penalty makes the bounds of a state soft.

    Parameters
    ----------
    lower, upper : float
        In the signal's unit; infinite where there is none.
    penalty : Penalty, optional
        Price per unit of violation; for states only.
    """

    lower: float = -np.inf
    upper: float = np.inf
    penalty: Penalty | None = None


BoundsLike = Bounds | Sequence[float]


def as_bounds(value: BoundsLike, argument: str) -> Bounds:
    """`value` as bounds that contain a number; anything else raises, naming `argument`."""
    pair = (value.lower, value.upper) if isinstance(value, Bounds) else value
    try:
        lower, upper = (float(limit) for limit in pair)
    except (TypeError, ValueError):
        raise ArgumentError(
            argument, repr(pair), "a pair (lower, upper)", "Use -inf or inf for a missing side."
        ) from None
    value = Bounds(lower, upper, value.penalty if isinstance(value, Bounds) else None)
    if np.isnan(value.lower) or np.isnan(value.upper):
        raise ArgumentError(argument, f"({value.lower}, {value.upper})", "numbers", "Use -inf or inf for no bound.")
    if value.lower > value.upper:
        raise ArgumentError(
            argument, f"({value.lower:g}, {value.upper:g})", "lower <= upper", "Exchange the two bounds."
        )
    if value.lower == np.inf or value.upper == -np.inf:
        raise ArgumentError(argument, f"({value.lower:g}, {value.upper:g})", "an interval with a finite number in it")
    return value


def check_penalty(penalty: Penalty | None, argument: str) -> None:
    """Raise, naming `argument`, unless the penalty is exact."""
    if penalty is None:
        return
    checked(penalty, argument, Penalty)
    for name, price in (("l1", penalty.l1), ("l2", penalty.l2)):
        if not isinstance(price, int | float | np.number):
            raise ArgumentError(f"{argument}.{name}", repr(price), "a number")
    if not 0.0 < penalty.l1 < np.inf or not 0.0 <= penalty.l2 < np.inf:
        raise ArgumentError(
            argument, f"l1={penalty.l1:g}, l2={penalty.l2:g}", "l1 > 0 and l2 >= 0, both finite", "l1 makes it exact."
        )
