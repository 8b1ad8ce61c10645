"""Distributions of settings, by SciPy: from numbers between 0 and 1 to values."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from math import inf, log
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from rumo.checks import as_list, finite_number, non_negative_number, positive_number, whole_number
from rumo.errors import ArgumentError, UnknownNameError
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
        _ascending(self.low, self.high)

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
        _ascending(self.low, self.high, bounded=False)

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
        _ascending(self.low, self.high, bounded=False)

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
        _ascending(self.low, self.high)
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


DISTRIBUTIONS: Mapping[str, type[Distribution]] = MappingProxyType(
    {kind.name: kind for kind in (Uniform, LogUniform, Normal, LogNormal, Triangular, Integers, Choice)}
)
"""By name."""


def distribution_of(table: Mapping[str, Any]) -> Distribution:
    """A distribution from plain data: `{"distribution": "uniform", "low": 0.7, "high": 1.1}`.

    Raises
    ------
    ArgumentError
        If name or parameter is unknown, one is missing, or a value cannot be.
    """
    name = table.get(DISTRIBUTION)
    if not isinstance(name, str) or name not in DISTRIBUTIONS:
        raise UnknownNameError(DISTRIBUTION, name, DISTRIBUTIONS)
    kind, given = DISTRIBUTIONS[name], {key: value for key, value in table.items() if key != DISTRIBUTION}
    known = {item.name: item for item in fields(kind)}  # pyright: ignore[reportArgumentType]
    for key in given:
        if key not in known:
            raise UnknownNameError(key, key, known)
    for key, item in known.items():
        if key not in given and item.default is MISSING and item.default_factory is MISSING:
            raise ArgumentError(key, "nothing", f"a number: {name} needs it")
    return kind(**given)


def _ascending(low: float, high: float, *, bounded: bool = True) -> None:
    for argument, end in (("low", low), ("high", high)):
        if bounded or end not in (-inf, inf):
            finite_number(end, argument)
    if not low < high:
        raise ArgumentError("high", repr(high), f"a number above low = {low:g}")
    if bounded and not high - low < inf:
        raise ArgumentError("high", repr(high), "ends whose distance is a number")
