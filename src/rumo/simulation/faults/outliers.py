"""Sensors with heavy tails: mostly right, and now and then far off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rumo.checks import as_mapping, non_negative_number, share, whole_number
from rumo.errors import ArgumentError
from rumo.signals import Array, Signals
from rumo.simulation.faults.base import Fault


@dataclass(frozen=True)
class Outliers(Fault):
    """Measurements are far off now and then, by chance, each for itself: the gross errors of Huber's model.

    Parameters
    ----------
    errors : mapping of str to float
        Standard deviation of a gross error, by signal, in its unit.
    share : float
        Of the measurements, how many have one: the probability of each.
    seed : int
        The same seed spoils the same measurements by the same errors.
    """

    errors: Mapping[str, float]
    share: float = 0.1
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, deviation in as_mapping(self.errors, "errors").items():
            if non_negative_number(deviation, f"errors[{name!r}]") == np.inf:
                raise ArgumentError(f"errors[{name!r}]", "inf", "a finite standard deviation")
        share(self.share, "share")
        whole_number(self.seed, "seed", 0, most=np.inf)

    def check(self, measured: Signals, inputs: Signals) -> None:
        """Raise for an unknown signal."""
        for name in self.errors:
            measured.index(name, "errors")

    def sense(self, received: Array, past: Sequence[Array], bad: int, signals: Signals) -> Array:
        """The measurement, or the measurement and a gross error."""
        chance = np.random.default_rng((self.seed, bad))
        spoilt = chance.random(len(received)) < self.share
        deviations = np.array([self.errors.get(name, 0.0) for name in signals])
        return received + np.where(spoilt, deviations * chance.standard_normal(len(received)), 0.0)
