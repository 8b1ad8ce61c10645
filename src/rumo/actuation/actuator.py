"""Actuators as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rumo.checks import checked_items, non_negative_number
from rumo.errors import ArgumentError
from rumo.signals import Array, Signals


@dataclass(frozen=True)
class Actuator:
    """What becomes of the command of one input: it comes late, and is followed by `y' = (command - y) / lag`.

    Parameters
    ----------
    lag : float
        Time constant of a first-order lag [s]; none for 0.
    rate : float
        Largest `|y'|`, in the input's unit per second.
    dead_time : float
        Until a command begins to act [s].
    """

    lag: float = 0.0
    rate: float = np.inf
    dead_time: float = 0.0

    def __post_init__(self) -> None:
        for name in ("lag", "dead_time"):
            if non_negative_number(getattr(self, name), f"Actuator.{name}") == np.inf:
                raise ArgumentError(f"Actuator.{name}", "inf", "a finite number of seconds")
        if non_negative_number(self.rate, "Actuator.rate") == 0.0:
            raise ArgumentError("Actuator.rate", "0", "a positive number", "A fault, Stuck, holds an actuator.")

    @property
    def follows_at_once(self) -> bool:
        """Whether there is neither lag nor limit."""
        return self.lag == 0.0 and self.rate == np.inf


@dataclass(frozen=True)
class Actuation:
    """From a measurement to what its command does: the time to compute it, and an actuator for each input.

    Parameters
    ----------
    actuators : mapping of str to Actuator
        By input; others do at once what they are told.
    computation : float
        From a measurement until its command leaves, communication included [s].
    """

    actuators: Mapping[str, Actuator] = field(default_factory=dict[str, Actuator])
    computation: float = 0.0

    def __post_init__(self) -> None:
        found = checked_items(self.actuators, "Actuation.actuators", Actuator, "rumo.Actuator(dead_time=0.03)")
        object.__setattr__(self, "actuators", found)
        if non_negative_number(self.computation, "Actuation.computation") == np.inf:
            raise ArgumentError("Actuation.computation", "inf", "a finite number of seconds")

    @property
    def moves(self) -> bool:
        """Whether some actuator has a lag or a limit."""
        return not all(actuator.follows_at_once for actuator in self.actuators.values())

    def check(self, inputs: Signals, argument: str) -> None:
        """Raise for an actuator of an input that there is not, naming `argument`."""
        for name in self.actuators:
            inputs.index(name, argument)

    def of(self, name: str) -> Actuator:
        """The actuator of an input."""
        return self.actuators.get(name, Actuator())

    def delays(self, inputs: Signals) -> Array:
        """From a measurement until its command begins to act, for each of some inputs (nu,) [s]."""
        return self.computation + np.array([self.of(name).dead_time for name in inputs], dtype=float)

    def least_dead_time(self, inputs: Signals) -> float:
        """What all inputs share [s]."""
        return min(self.of(name).dead_time for name in inputs)
