"""Actuators that do something else than they are told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np

from rumo.signals import Array, Signals
from rumo.simulation.faults.base import Fault


@dataclass(frozen=True)
class _Actuator(Fault):
    """A fault of one actuator.

    Parameters
    ----------
    input : str
        What it applies.
    told : bool
        Controller and estimator learn what is applied; else they believe in their commands.
    """

    input: str
    _: KW_ONLY
    told: bool = False

    def check(self, measured: Signals, inputs: Signals) -> None:
        """Raise for an unknown input."""
        inputs.index(self.input, "input")

    @property
    def known(self) -> bool:
        """Whether controller and estimator learn what is applied."""
        return self.told

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

    def act(self, applied: Array, past: Sequence[Array], bad: int, inputs: Signals) -> Array:
        """A share of the command."""
        return self._set(applied, inputs, self.share * float(applied[inputs.index(self.input)]))


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

    def act(self, applied: Array, past: Sequence[Array], bad: int, inputs: Signals) -> Array:
        """The command and the bias."""
        return self._set(applied, inputs, float(applied[inputs.index(self.input)]) + self.by)
