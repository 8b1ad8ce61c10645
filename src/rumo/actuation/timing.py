"""When commands act, in samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rumo.actuation.actuator import Actuation
from rumo.checks import positive_number
from rumo.signals import Array, Signals

SAME_TIME = 1e-6
"""Share of a sample by which two times may be apart and are still the same."""


@dataclass(frozen=True, eq=False)
class ActingInputs:
    """When the command of a sample begins to act on each input.

    Attributes
    ----------
    delay : int
        Whole samples until the first input does: a problem's `delay`.
    share : float
        Of a sample, 0 or more and less than 1: until it does, besides.
    rest : ndarray, shape (nu,)
        Samples, and shares of one, by which each input is later than `delay`.
    """

    delay: int
    share: float
    rest: Array


def acting_inputs(actuation: Actuation, inputs: Signals, sampling_time: float) -> ActingInputs:
    """When inputs act, of commands that are computed once each sampling time [s].

    `Problem(delay=acting_inputs(...).delay)` is what a controller has to know; the share of a sample is for the loop.
    """
    samples = actuation.delays(inputs) / positive_number(sampling_time, "sampling_time")
    delay, share = in_samples(float(samples.min()))
    rest = np.array([sum(in_samples(float(each) - delay)) for each in samples])
    return ActingInputs(delay, share, rest)


def in_samples(samples: float) -> tuple[int, float]:
    """Whole samples, and the share of one that is left, without rounding errors."""
    whole = int(np.floor(samples + SAME_TIME))
    share = samples - whole
    return whole, share if share > SAME_TIME else 0.0
