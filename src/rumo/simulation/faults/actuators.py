"""Actuators that do something else than they are told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rumo.checks import as_numbers, finite_number
from rumo.errors import ArgumentError
from rumo.signals import Array, Signals
from rumo.simulation.faults.base import Tellable


@dataclass(frozen=True)
class _Actuator(Tellable):
    """A fault of one actuator.

    Parameters
    ----------
    input : str
        What it applies.
    told : bool
        Controller and estimator learn what is applied; else they believe in their commands.
    """

    input: str

    def check(self, measured: Signals, inputs: Signals) -> None:
        """Raise for an unknown input."""
        inputs.index(self.input, "input")

    def _set(self, applied: Array, inputs: Signals, value: float) -> Array:
        applied = applied.copy()
        applied[inputs.index(self.input)] = value
        return applied


@dataclass(frozen=True)
class Stuck(_Actuator):
    """An actuator stays where it is, or goes where nobody told it to go.

    Parameters
    ----------
    input : str
        What it applies.
    value : float, optional
        Where it is; where it was at the last good sample if not given.
    told : bool
        Controller and estimator learn what is applied; else they believe in their commands.
    """

    value: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.value is not None:
            finite_number(self.value, "value")

    def act(self, applied: Array, past: Sequence[Array], bad: int, inputs: Signals) -> Array:
        """The value in place of the command."""
        last = past[len(past) - 1 - bad][inputs.index(self.input)]
        return self._set(applied, inputs, float(last) if self.value is None else self.value)


@dataclass(frozen=True)
class Weakened(_Actuator):
    """An actuator has lost some of its effect.

    Parameters
    ----------
    input : str
        What it applies.
    share : float
        What is left of the command: 0 for nothing.
    told : bool
        Controller and estimator learn what is applied; else they believe in their commands.
    """

    share: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_number(self.share, "share")

    def act(self, applied: Array, past: Sequence[Array], bad: int, inputs: Signals) -> Array:
        """A share of the command."""
        return self._set(applied, inputs, self.share * float(applied[inputs.index(self.input)]))


@dataclass(frozen=True)
class Slow(_Actuator):
    """An actuator goes only part of the way to its command in a sample.

    Parameters
    ----------
    input : str
        What it applies.
    share : float
        Of the way from where it was at the sample before: above 0, and 1 for all of it.
    told : bool
        Controller and estimator learn what is applied; else they believe in their commands.
    """

    share: float = 0.2

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < finite_number(self.share, "share") <= 1.0:
            raise ArgumentError("share", repr(self.share), "a part of the way, above 0 and up to 1")

    def act(self, applied: Array, past: Sequence[Array], bad: int, inputs: Signals) -> Array:
        """Part of the way."""
        i = inputs.index(self.input)
        return self._set(applied, inputs, float(past[-1][i] + self.share * (applied[i] - past[-1][i])))


@dataclass(frozen=True)
class Saturated(_Actuator):
    """An actuator does not reach as far as the controller thinks.

    Parameters
    ----------
    input : str
        What it applies.
    lower, upper : float
        Between which values it can be.
    told : bool
        Controller and estimator learn what is applied; else they believe in their commands.
    """

    lower: float = -np.inf
    upper: float = np.inf

    def __post_init__(self) -> None:
        super().__post_init__()
        limits = as_numbers((self.lower, self.upper), "lower, upper")
        if limits.shape != (2,) or not limits[0] <= limits[1] or limits[0] == np.inf or limits[1] == -np.inf:
            raise ArgumentError("lower, upper", f"({self.lower!r}, {self.upper!r})", "two limits, the lower one first")

    def act(self, applied: Array, past: Sequence[Array], bad: int, inputs: Signals) -> Array:
        """The command, limited."""
        value = np.clip(applied[inputs.index(self.input)], self.lower, self.upper)
        return self._set(applied, inputs, float(value))


@dataclass(frozen=True)
class Biased(_Actuator):
    """An actuator is off by a constant.

    Parameters
    ----------
    input : str
        What it applies.
    by : float
        What is added to the command.
    told : bool
        Controller and estimator learn what is applied; else they believe in their commands.
    """

    by: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        finite_number(self.by, "by")

    def act(self, applied: Array, past: Sequence[Array], bad: int, inputs: Signals) -> Array:
        """The command and the bias."""
        return self._set(applied, inputs, float(applied[inputs.index(self.input)]) + self.by)
