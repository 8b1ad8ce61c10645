"""Disturbances by place: what a plant meets where it is, such as ice on a part of a road."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from rumo.checks import as_mapping, as_names, checked, finite_number, non_negative_number
from rumo.errors import ArgumentError
from rumo.references import Path
from rumo.signals import Array, Signals

WINDOW = 10.0
"""How far along its path a plant gets from one sample to the next, at most [m]."""


@runtime_checkable
class DisturbanceByState(Protocol):
    """One parameter of a plant, by the state that the plant is in."""

    def start(self, states: Signals) -> Callable[[Array], float]:
        """Begin a run: a function from the plant's state (nx,) at a sample to the value, held until the next."""
        ...


@dataclass(frozen=True, eq=False)
class ByPlace:
    """A value for each stretch of a path.

    Parameters
    ----------
    path : Path
        Along which the plant moves, though not on it.
    values : mapping of float to float
        Arc length from which on [m] -> value; the first holds before as well.
    position : tuple of str
        States of the plant that say where it is.
    ahead : float
        How far ahead of there it counts [m]: l_f for what is under the front axle of a car.

    Examples
    --------
    Friction of a four-wheel car on a road with ice from 120 to 140 m:

    >>> from rumo.references import generators
    >>> ice = ByPlace(generators.straight(300.0), {0.0: 0.9, 120.0: 0.3, 140.0: 0.9})
    """

    path: Path
    values: Mapping[float, float]
    position: tuple[str, ...] = ("p_x", "p_y")
    ahead: float = 0.0
    _from: Array = field(init=False, repr=False)
    _values: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        checked(self.path, "path", Path)
        finite_number(self.ahead, "ahead")
        if len(as_names(self.position, "position")) != 2:
            raise ArgumentError("position", repr(self.position), 'two states, such as ("p_x", "p_y")')
        values = as_mapping(self.values, "values")
        if not values:
            raise ArgumentError("values", "none", "a value from some arc length on, such as {0.0: 0.9, 120.0: 0.3}")
        for place, value in values.items():
            finite_number(place, "values")
            finite_number(value, f"values[{place!r}]")
        first = sorted(values)
        object.__setattr__(self, "_from", np.array(first, dtype=float))
        object.__setattr__(self, "_values", np.array([values[place] for place in first], dtype=float))

    def start(self, states: Signals) -> Callable[[Array], float]:
        """Follow a plant along the path, see `DisturbanceByState`."""
        return _Followed(self, [states.index(name, "position") for name in self.position])

    def at(self, s: float) -> float:
        """Value where the plant is at an arc length [m]."""
        place = s + self.ahead
        if self.path.closed:
            place %= self.path.length
        return float(self._values[max(int(np.searchsorted(self._from, place, side="right")) - 1, 0)])


class _Followed:
    """The value where a plant is that moves along the path."""

    def __init__(self, place: ByPlace, rows: list[int]) -> None:
        self._place, self._rows = place, rows
        self._reach = 0.0, place.path.length

    def __call__(self, x: Array) -> float:
        p_x, p_y = x[self._rows].tolist()
        s = self._place.path.nearest(p_x, p_y, *self._reach)
        self._reach = s - WINDOW, s + WINDOW
        return self._place.at(s)


@dataclass(frozen=True)
class Patch:
    """Another value while a state is between two: ice across a road, from one place to another.

    All of it is numbers, as files have them. On a path that comes by the same place twice, take `ByPlace`.

    Parameters
    ----------
    value, elsewhere : float
        On the patch, and outside of it.
    begin, length : float
        Where it is, in the state's unit: from `begin` on, before `begin + length`; nowhere for a length of 0.
    state : str
        Of the plant.

    Examples
    --------
    >>> ice = Patch(value=0.3, elsewhere=0.9, begin=120.0, length=20.0)
    """

    value: float
    elsewhere: float
    begin: float
    length: float
    state: str = "p_x"

    def __post_init__(self) -> None:
        for name in ("value", "elsewhere", "begin"):
            finite_number(getattr(self, name), name)
        if non_negative_number(self.length, "length") == np.inf:
            raise ArgumentError("length", "inf", "a finite length")
        as_names((self.state,), "state")

    def start(self, states: Signals) -> Callable[[Array], float]:
        """The value by the plant's state (nx,), see `DisturbanceByState`."""
        row = states.index(self.state, "state")
        return lambda x: self.value if self.begin <= x[row] < self.begin + self.length else self.elsewhere
