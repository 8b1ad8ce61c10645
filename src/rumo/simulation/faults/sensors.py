"""Sensors that tell something else than what is, or nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rumo.checks import as_mapping, as_names, as_numbers, finite_number, whole_number
from rumo.errors import ArgumentError
from rumo.signals import Array, Signals
from rumo.simulation.faults.base import Fault


@dataclass(frozen=True)
class _One(Fault):
    """A fault of one sensor.

    Parameters
    ----------
    signal : str
        What it measures.
    """

    signal: str

    def check(self, measured: Signals, inputs: Signals) -> None:
        """Raise for an unknown signal."""
        measured.index(self.signal, "signal")


@dataclass(frozen=True)
class Reading(_One):
    """A sensor says the same value, whatever is: NaN, infinity, or one that cannot be.

    Parameters
    ----------
    signal : str
        What it measures.
    value : float
        In the signal's unit.
    """

    value: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.ndim(as_numbers(self.value, "value")):
            raise ArgumentError("value", repr(self.value), "a number, NaN and infinity among them")

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """The value in place of the measurement."""
        received = received.copy()
        received[signals.index(self.signal)] = self.value
        return received


@dataclass(frozen=True)
class Offset(_One):
    """A sensor is off by a constant.

    Parameters
    ----------
    signal : str
        What it measures.
    by : float
        What is added, in the signal's unit.
    """

    by: float

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_number(self.by, "by")

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """The measurement and the offset."""
        received = received.copy()
        received[signals.index(self.signal)] += self.by
        return received


@dataclass(frozen=True)
class Drift(Offset):
    """A sensor is further off from sample to sample.

    Parameters
    ----------
    signal : str
        What it measures.
    by : float
        What is added more at each bad sample, the first among them, in the signal's unit.
    """

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """The measurement and what has come together."""
        received = received.copy()
        received[signals.index(self.signal)] += self.by * (bad + 1)
        return received


@dataclass(frozen=True)
class Swapped(Fault):
    """Two sensors are mixed up.

    Parameters
    ----------
    first, second : str
        What they measure.
    """

    first: str
    second: str

    def check(self, measured: Signals, inputs: Signals) -> None:
        """Raise for an unknown signal, or the same one twice."""
        if measured.index(self.first, "first") == measured.index(self.second, "second"):
            raise ArgumentError("second", repr(self.second), "another signal than the first")

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """Each in the other's place."""
        places = [signals.index(self.first), signals.index(self.second)]
        received = received.copy()
        received[places] = received[places[::-1]]
        return received


@dataclass(frozen=True)
class _Some(Fault):
    """A fault of some sensors.

    Parameters
    ----------
    signals : tuple of str
        What they measure; everything if not given.
    """

    signals: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        as_names(self.signals, "signals")

    def check(self, measured: Signals, inputs: Signals) -> None:
        """Raise for an unknown signal."""
        for name in self.signals:
            measured.index(name, "signals")

    def _replaced(self, received: Array, by: Array, signals: Signals) -> Array:
        return np.where([not self.signals or name in self.signals for name in signals], by, received)


@dataclass(frozen=True)
class Missing(_Some):
    """Measurements do not arrive: NaN.

    Parameters
    ----------
    signals : tuple of str
        Those that don't; all if not given.
    """

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """NaN."""
        return self._replaced(received, np.full(len(received), np.nan), signals)


@dataclass(frozen=True)
class Dropout(_Some):
    """Some samples do not arrive, by chance: NaN.

    Parameters
    ----------
    signals : tuple of str
        What does not arrive then; everything if not given.
    share : float
        Of the bad samples, how many are lost: the probability of each.
    seed : int
        The same seed loses the same samples.
    """

    share: float = 0.5
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= finite_number(self.share, "share") <= 1.0:
            raise ArgumentError("share", repr(self.share), "a probability from 0 to 1")
        whole_number(self.seed, "seed", 0, most=np.inf)

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """NaN or the measurement."""
        if np.random.default_rng((self.seed, bad)).random() >= self.share:
            return received
        return self._replaced(received, np.full(len(received), np.nan), signals)


@dataclass(frozen=True)
class Scaled(_Some):
    """Sensors say a multiple of what is: -1 for a wrong sign, 0 for silence that looks like a number.

    Parameters
    ----------
    signals : tuple of str
        What they measure; everything if not given.
    factor : float
        By which measurements are multiplied.
    """

    factor: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_number(self.factor, "factor")

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """The multiple."""
        return self._replaced(received, self.factor * received, signals)


@dataclass(frozen=True)
class Noisy(Fault):
    """Sensors have more Gaussian noise than they should, on top of their own.

    Parameters
    ----------
    noise : mapping of str to float
        Standard deviation of what is added, by signal, in its unit.
    seed : int
        The same seed adds the same.
    """

    noise: Mapping[str, float]
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, deviation in as_mapping(self.noise, "noise").items():
            if finite_number(deviation, f"noise[{name!r}]") < 0.0:
                raise ArgumentError(f"noise[{name!r}]", repr(deviation), "a standard deviation of 0 or more")
        whole_number(self.seed, "seed", 0, most=np.inf)

    def check(self, measured: Signals, inputs: Signals) -> None:
        """Raise for an unknown signal."""
        for name in self.noise:
            measured.index(name, "noise")

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """The measurement and more noise."""
        deviations = np.array([self.noise.get(name, 0.0) for name in signals])
        return received + deviations * np.random.default_rng((self.seed, bad)).standard_normal(len(received))


@dataclass(frozen=True)
class Frozen(_Some):
    """Sensors say what they said at the last good sample.

    Parameters
    ----------
    signals : tuple of str
        What they measure; everything if not given.
    """

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """The last good measurement; NaN without one."""
        good = len(past) - 2 - bad
        return self._replaced(received, past[good] if good >= 0 else np.full(len(received), np.nan), signals)


@dataclass(frozen=True)
class LateMeasurement(_Some):
    """Measurements arrive late: each bad sample gets that of some samples ago.

    Parameters
    ----------
    signals : tuple of str
        Those that do; all if not given.
    by : int
        Number of samples.
    """

    by: int = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        whole_number(self.by, "by", 1)

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """An old measurement; NaN before the first has arrived."""
        old = len(past) - 1 - self.by
        return self._replaced(received, past[old] if old >= 0 else np.full(len(received), np.nan), signals)
