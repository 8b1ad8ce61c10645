"""What measurements say beyond what was expected of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rumo.signals import Array


@dataclass(frozen=True, eq=False)
class Innovation:
    """Innovations of one sample: measured less predicted, of all that has come for it.

    Attributes
    ----------
    values : ndarray, shape (m,)
        In the units of the measurements, NaN where there was none; angles less whole turns.
    deviations : ndarray, shape (m,)
        Standard deviations expected of them, of state and noise together.
    used : ndarray of bool, shape (m,)
        Whether the estimate was corrected by it: not where none came or the gate took it for an outlier.
    nis : float
        Normalised innovation squared of all that were used together: chi-square distributed with as many degrees of
        freedom, if model and noise are what the filter believes.
    log_likelihood : float
        Logarithm of the probability density of these.
    """

    values: Array
    deviations: Array
    used: NDArray[np.bool_]
    nis: float
    log_likelihood: float
