"""References of single signals, as data: they can be sent to another process, which a lambda cannot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rumo.checks import as_mapping, as_numbers, finite_number, positive_number
from rumo.errors import ArgumentError, ShapeError
from rumo.references.base import OfTime
from rumo.signals import Array


@dataclass(frozen=True)
class Sine(OfTime):
    """One signal that swings about a value.

    Parameters
    ----------
    signal : str
        Its name.
    middle, amplitude : float
        In its unit.
    period : float
        [s].
    """

    pointwise: ClassVar[bool] = True

    signal: str
    middle: float
    amplitude: float
    period: float

    def __post_init__(self) -> None:
        finite_number(self.middle, "middle")
        finite_number(self.amplitude, "amplitude")
        positive_number(self.period, "period")

    def __call__(self, t: Array) -> dict[str, Array]:
        """Values at times t (n,) [s]."""
        phase = 2.0 * np.pi * np.asarray(t) / self.period
        return {self.signal: self.middle + self.amplitude * np.sin(phase)}


@dataclass(frozen=True)
class Sampled(OfTime):
    """Signals given at some times, with straight lines between; the first and the last values are held outside.

    Parameters
    ----------
    times : sequence of float
        Ascending [s].
    values : mapping of str to sequence of float
        One for each time.
    steps : bool
        Each value is held until the next, without lines.
    """

    pointwise: ClassVar[bool] = True

    times: Sequence[float]
    values: Mapping[str, Sequence[float]]
    steps: bool = False

    def __post_init__(self) -> None:
        times = as_numbers(self.times, "times")
        if times.ndim != 1 or not len(times) or not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
            raise ArgumentError("times", f"{times.tolist()}", "at least one time, ascending")
        table: dict[str, tuple[float, ...]] = {}
        for name, given in as_mapping(self.values, "values").items():
            values = as_numbers(given, f"values[{name!r}]")
            if values.shape != times.shape:
                expected = f"shape {times.shape}: one value for each time"
                raise ShapeError(f"values[{name!r}]", f"shape {values.shape}", expected)
            if not np.isfinite(values).all():
                raise ArgumentError(f"values[{name!r}]", "NaN or infinity", "finite numbers")
            table[name] = tuple(values.tolist())
        # Data of its own, which compare.
        object.__setattr__(self, "times", tuple(times.tolist()))
        object.__setattr__(self, "values", table)

    def __call__(self, t: Array) -> dict[str, Array]:
        """Values at times t (n,) [s]."""
        times = np.asarray(self.times, dtype=float)
        if self.steps:
            latest = np.clip(np.searchsorted(times, t, side="right") - 1, 0, None)
            return {name: np.asarray(values, dtype=float)[latest] for name, values in self.values.items()}
        return {name: np.interp(t, times, np.asarray(values, dtype=float)) for name, values in self.values.items()}
