"""Disturbances over a run: wind, or any other parameter of the plant that varies with time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from rumo.checks import finite_number, non_negative_number, positive_number
from rumo.signals import Array


@runtime_checkable
class Disturbance(Protocol):
    """A time series of one plant parameter."""

    def sample(self, times: Array, rng: np.random.Generator) -> Array:
        """Values (K,) at the sampling times (K,) [s], each held until the next."""
        ...


@dataclass(frozen=True)
class Constant:
    """Always the same value."""

    value: float

    def __post_init__(self) -> None:
        finite_number(self.value, "value")

    def sample(self, times: Array, rng: np.random.Generator) -> Array:
        """Values (K,), see `Disturbance`."""
        return np.full(len(times), self.value)


@dataclass(frozen=True)
class RandomWalk:
    """Integrated Gaussian noise, brought to a mean and a standard deviation over the run.

    Parameters
    ----------
    mean, std : float
        Mean and standard deviation of the samples; the paper's wind has 2 and 1.5 m/s.
    """

    mean: float
    std: float

    def __post_init__(self) -> None:
        finite_number(self.mean, "mean")
        non_negative_number(self.std, "std")

    def sample(self, times: Array, rng: np.random.Generator) -> Array:
        """Values (K,), see `Disturbance`."""
        walk = np.cumsum(rng.standard_normal(len(times)))
        walk -= walk.mean()
        spread = walk.std()
        return self.mean + (walk * self.std / spread if spread > 0.0 else walk)


@dataclass(frozen=True)
class OrnsteinUhlenbeck:
    """Stationary coloured noise.

    Parameters
    ----------
    mean, std : float
        Of the stationary distribution.
    correlation_time : float
        Time after which the correlation has fallen to 1/e [s].
    """

    mean: float
    std: float
    correlation_time: float

    def __post_init__(self) -> None:
        finite_number(self.mean, "mean")
        non_negative_number(self.std, "std")
        positive_number(self.correlation_time, "correlation_time")

    def sample(self, times: Array, rng: np.random.Generator) -> Array:
        """Values (K,), see `Disturbance`."""
        noise = rng.standard_normal(len(times))
        decay = np.exp(-np.diff(times) / self.correlation_time)
        deviation = np.empty(len(times))
        deviation[0] = noise[0]
        for k, keep in enumerate(decay):
            deviation[k + 1] = keep * deviation[k] + np.sqrt(1.0 - keep**2) * noise[k + 1]
        return self.mean + self.std * deviation


@dataclass(frozen=True)
class Gust:
    """A single "1 - cosine" gust on a constant wind.

    Parameters
    ----------
    mean, peak : float
        Value before and after, and at the top.
    start, duration : float
        When the gust begins and how long it lasts [s].
    """

    mean: float
    peak: float
    start: float
    duration: float

    def __post_init__(self) -> None:
        for name in ("mean", "peak", "start"):
            finite_number(getattr(self, name), name)
        positive_number(self.duration, "duration")

    def sample(self, times: Array, rng: np.random.Generator) -> Array:
        """Values (K,), see `Disturbance`."""
        progress = np.clip((times - self.start) / self.duration, 0.0, 1.0)
        return self.mean + 0.5 * (self.peak - self.mean) * (1.0 - np.cos(2.0 * np.pi * progress))
