"""The numbers of a problem: all that can change while what is built from its structure stays."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from rumo.signals import Array
from rumo.structure import Structure
from rumo.terms import Penalty


@dataclass(frozen=True, eq=False)
class ProblemNumbers:
    """The numbers of a problem; arrays that cannot be written to.

    Attributes
    ----------
    shares : ndarray, shape (N,)
        Length of each interval over the sampling time.
    tracking, ranges : ndarray, shapes (N, ny), (ny,)
        Weights and ranges of the tracked outputs as given.
    moving, input_scales : ndarray, shapes (N, nu), (nu,)
        Weights and ranges of the inputs' increments as given.
    input_lower, input_upper : ndarray, shape (N, nu)
        Bounds of the inputs on each interval.
    move_lower, move_upper : ndarray, shape (nu,)
        Bounds of their increments.
    limits : ndarray, shape (N, nc)
        Path constraints are `G <= limits`, at stages 1 to N.
    constraint_scales : ndarray, shape (nc,)
        Typical size of each path constraint.
    stakes : ndarray, shape (nc,)
        Price of a violation as large as the scale, for l1 = 1: the length of the horizon in samples for bounds, 1 for
        constraints given by expressions.
    prices : ndarray, shape (2, nc)
        l1 and l2 as given; l1 is infinite for hard constraints.
    chosen, safe_input : ndarray, shape (nu,)
        Safe input as given, NaN where it is not; and 0 or the nearest bound there.
    parameters : ndarray, shape (N, np_)
        Of the model, on each interval.
    """

    shares: Array
    tracking: Array
    ranges: Array
    moving: Array
    input_scales: Array
    input_lower: Array
    input_upper: Array
    move_lower: Array
    move_upper: Array
    limits: Array
    constraint_scales: Array
    stakes: Array
    prices: Array
    chosen: Array
    safe_input: Array
    parameters: Array

    def __post_init__(self) -> None:
        # Controllers build on these numbers; a change would reach some and not others.
        for value in vars(self).values():
            value.flags.writeable = False

    def with_parameters(self, parameters: Array) -> ProblemNumbers:
        """The same with other parameters (N, np_): all other arrays are shared, not copied."""
        other = object.__new__(type(self))
        vars(other).update(vars(self), parameters=_fixed(parameters))
        return other

    def differences(self, other: ProblemNumbers) -> list[str]:
        """Which arrays are not the very ones of others."""
        return [field.name for field in fields(self) if getattr(self, field.name) is not getattr(other, field.name)]

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self.__post_init__()

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def output_weights(self) -> Array:
        """Weights of squared output errors (N, ny), by their units."""
        return _fixed(self.tracking / _squares(self.ranges) * self.shares[:, None])

    @cached_property
    def move_weights(self) -> Array:
        """Weights of squared input increments (N, nu), by their units."""
        return _fixed(self.moving / _squares(self.input_scales))

    @property
    def cost_scale(self) -> float:
        """The largest weight as given."""
        return float(max(self.tracking.max(), self.moving.max()))

    @cached_property
    def l1(self) -> Array:
        """Price of a violation (nc,), by its unit; infinite for hard constraints."""
        return _fixed(self.prices[0] * self.stakes / self.constraint_scales)

    @cached_property
    def l2(self) -> Array:
        """Price of a squared violation (nc,), by its unit."""
        return _fixed(self.prices[1] * self.stakes / _squares(self.constraint_scales))


@dataclass(frozen=True, eq=False)
class PathConstraint:
    """A path constraint with its numbers, `expression <= limits`.

    Attributes
    ----------
    scale : float
        Typical size, in the constraint's unit.
    limits : ndarray, shape (N,)
        At stages 1 to N.
    penalty : Penalty or None
        Price of a violation in the constraint's unit; None where it is hard.
    """

    name: str
    unit: str
    scale: float
    expression: Any
    limits: Array
    penalty: Penalty | None


def path_constraints(structure: Structure, numbers: ProblemNumbers) -> tuple[PathConstraint, ...]:
    """The path constraints of a structure with numbers."""
    prices = zip(numbers.l1.tolist(), numbers.l2.tolist(), strict=True)
    penalties = [Penalty(l1, l2) if l1 < np.inf else None for l1, l2 in prices]
    columns = zip(structure.rows, numbers.constraint_scales.tolist(), numbers.limits.T, penalties, strict=True)
    return tuple(
        PathConstraint(row.name, row.unit, scale, row.expression, limits, penalty)
        for row, scale, limits, penalty in columns
    )


def _fixed(array: Array) -> Array:
    array.flags.writeable = False
    return array


def _squares(array: Array) -> Array:
    return np.array([number**2 if number < 1e154 else np.inf for number in array.tolist()])
