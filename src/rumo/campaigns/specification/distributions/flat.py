"""Distributions of equal likelihood: of numbers, orders of magnitude, whole numbers, and anything else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf
from typing import ClassVar

import numpy as np

from rumo.campaigns.specification.distributions.base import Distribution, ascending
from rumo.checks import as_list, non_negative_number, positive_number, whole_number
from rumo.errors import ArgumentError
from rumo.scenarios.arguments import Plain
from rumo.signals import Array


@dataclass(frozen=True)
class Uniform(Distribution):
    """All values between two are equally likely.

    Parameters
    ----------
    low, high : float
        The ends.
    """

    name: ClassVar[str] = "uniform"

    low: float
    high: float

    def __post_init__(self) -> None:
        ascending(self.low, self.high)

    @property
    def ends(self) -> tuple[float, float]:
        """See `Distribution`."""
        return self.low, self.high

    def values(self, shares: Array) -> list[float]:
        """See `Distribution`."""
        return (self.low + (self.high - self.low) * shares).tolist()


@dataclass(frozen=True)
class LogUniform(Uniform):
    """All orders of magnitude between two positive values are equally likely.

    Parameters
    ----------
    low, high : float
        The ends.
    """

    name: ClassVar[str] = "log-uniform"

    def __post_init__(self) -> None:
        super().__post_init__()
        positive_number(self.low, "low")

    def values(self, shares: Array) -> list[float]:
        """See `Distribution`."""
        return np.clip(self.low * (self.high / self.low) ** shares, self.low, self.high).tolist()


@dataclass(frozen=True)
class Integers(Distribution):
    """All whole numbers from one to another are equally likely.

    Parameters
    ----------
    low, high : int
        The least and the largest.
    """

    name: ClassVar[str] = "integers"

    low: int
    high: int

    def __post_init__(self) -> None:
        whole_number(self.low, "low", -(2**53))
        whole_number(self.high, "high", self.low, most=2**53)

    @property
    def ends(self) -> tuple[int, int]:
        """See `Distribution`."""
        return self.low, self.high

    def values(self, shares: Array) -> list[int]:
        """See `Distribution`."""
        count = self.high - self.low + 1
        return (self.low + np.minimum(np.floor(shares * count), count - 1).astype(int)).tolist()


@dataclass(frozen=True)
class Choice(Distribution):
    """One of some values.

    Parameters
    ----------
    among : sequence of plain data
        The values.
    weights : sequence of float, optional
        How likely each is, over their sum; all equally if not given.
    """

    name: ClassVar[str] = "choice"

    among: Sequence[Plain] = field(default=())
    weights: Sequence[float] | None = None

    def __post_init__(self) -> None:
        values = as_list(self.among, "among", "a list of values")
        object.__setattr__(self, "among", values)
        if self.weights is not None:
            weights = [non_negative_number(weight, "weights") for weight in as_list(self.weights, "weights", "numbers")]
            if len(weights) != len(values) or not 0.0 < sum(weights) < inf:
                raise ArgumentError("weights", repr(weights), f"{len(values)} numbers, not all 0")
            object.__setattr__(self, "weights", weights)

    @property
    def ends(self) -> tuple[Plain, ...]:
        """See `Distribution`."""
        return tuple(self.among)

    def values(self, shares: Array) -> list[Plain]:
        """See `Distribution`."""
        weights = np.ones(len(self.among)) if self.weights is None else np.asarray(self.weights, dtype=float)
        edges = np.cumsum(weights) / weights.sum()
        places = np.minimum(np.searchsorted(edges, shares, side="right"), len(self.among) - 1)
        return [self.among[place] for place in places.tolist()]
