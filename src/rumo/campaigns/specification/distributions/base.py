"""What a distribution of a setting is: from numbers between 0 and 1 to values."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import fields
from math import inf
from typing import ClassVar

from rumo.checks import finite_number
from rumo.errors import ArgumentError
from rumo.scenarios.arguments import Plain
from rumo.signals import Array

DISTRIBUTION = "distribution"
"""Key of a table that says which."""


class Distribution(ABC):
    """Values of a setting, more or less likely."""

    name: ClassVar[str]

    @abstractmethod
    def values(self, shares: Array) -> Sequence[Plain]:
        """Values that so large shares of all are below (n,), each from 0 to 1, themselves excluded."""

    @property
    @abstractmethod
    def ends(self) -> tuple[Plain, ...]:
        """The extreme values, where there are any."""

    @property
    def plain(self) -> dict[str, Plain]:
        """As plain data, from which `distribution_of` makes it again."""
        own = {item.name: getattr(self, item.name) for item in fields(self)}  # pyright: ignore[reportArgumentType]
        finite = {name: value for name, value in own.items() if value is not None and value not in (inf, -inf)}
        return {DISTRIBUTION: self.name, **finite}


def ascending(low: float, high: float, *, bounded: bool = True) -> None:
    """Raise unless two ends are ascending numbers, finite if `bounded`."""
    for argument, end in (("low", low), ("high", high)):
        if bounded or end not in (-inf, inf):
            finite_number(end, argument)
    if not low < high:
        raise ArgumentError("high", repr(high), f"a number above low = {low:g}")
    if bounded and not high - low < inf:
        raise ArgumentError("high", repr(high), "ends whose distance is a number")
