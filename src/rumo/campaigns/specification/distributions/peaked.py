"""Distributions with a likeliest value, by SciPy."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log
from typing import ClassVar

import numpy as np

from rumo.campaigns.specification.distributions.base import Distribution, ascending
from rumo.checks import finite_number, non_negative_number, positive_number
from rumo.errors import ArgumentError
from rumo.signals import Array


@dataclass(frozen=True)
class Normal(Distribution):
    """The normal distribution, cut off where it has ends.

    Parameters
    ----------
    mean, std : float
        Mean and standard deviation, of the whole that it is cut from.
    low, high : float
        Ends; infinite for none.
    """

    name: ClassVar[str] = "normal"

    mean: float
    std: float
    low: float = -inf
    high: float = inf

    def __post_init__(self) -> None:
        finite_number(self.mean, "mean")
        positive_number(self.std, "std")
        ascending(self.low, self.high, bounded=False)

    @property
    def ends(self) -> tuple[float, ...]:
        """See `Distribution`."""
        return tuple(end for end in (self.low, self.high) if abs(end) < inf)

    def values(self, shares: Array) -> list[float]:
        """See `Distribution`."""
        from scipy.stats import truncnorm  # takes longer to import than all the rest

        low, high = (self.low - self.mean) / self.std, (self.high - self.mean) / self.std
        found = truncnorm.ppf(shares, low, high, loc=self.mean, scale=self.std)
        return np.clip(found, self.low, self.high).tolist()


@dataclass(frozen=True)
class LogNormal(Distribution):
    """The logarithm is normal, cut off where it has ends.

    Parameters
    ----------
    median : float
        Half of all are below.
    sigma : float
        Standard deviation of the natural logarithm: 0.1 for about 10 %.
    low, high : float
        Ends; infinite for none.
    """

    name: ClassVar[str] = "log-normal"

    median: float
    sigma: float
    low: float = 0.0
    high: float = inf

    def __post_init__(self) -> None:
        positive_number(self.median, "median")
        positive_number(self.sigma, "sigma")
        non_negative_number(self.low, "low")
        ascending(self.low, self.high, bounded=False)

    @property
    def ends(self) -> tuple[float, ...]:
        """See `Distribution`."""
        return tuple(end for end in (self.low, self.high) if 0.0 < end < inf)

    def values(self, shares: Array) -> list[float]:
        """See `Distribution`."""
        low, high = (log(end) if end > 0.0 else -inf for end in (self.low, self.high))
        return np.exp(Normal(log(self.median), self.sigma, low, high).values(shares)).tolist()


@dataclass(frozen=True)
class Triangular(Distribution):
    """More likely the nearer to a value, less towards two ends.

    Parameters
    ----------
    low, mode, high : float
        The least, the likeliest, the largest.
    """

    name: ClassVar[str] = "triangular"

    low: float
    mode: float
    high: float

    def __post_init__(self) -> None:
        ascending(self.low, self.high)
        if not self.low <= finite_number(self.mode, "mode") <= self.high:
            raise ArgumentError("mode", repr(self.mode), f"a number from {self.low:g} to {self.high:g}")

    @property
    def ends(self) -> tuple[float, float]:
        """See `Distribution`."""
        return self.low, self.high

    def values(self, shares: Array) -> list[float]:
        """See `Distribution`."""
        from scipy.stats import triang

        span = self.high - self.low
        return triang.ppf(shares, (self.mode - self.low) / span, loc=self.low, scale=span).tolist()
