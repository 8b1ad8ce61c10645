"""Settings of the C core."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Settings:
    """The members of `rumo_settings`.

    Attributes
    ----------
    sqp_iterations, preparation_iterations, sqp_tolerance
        Linearisations per step, iterations before the measurement, and the change below which both end early.
    settling_iterations, trusted_step
        Further iterations where the first step is not to be trusted: where it is longer than this share of a range. If
        that is infinite, steps are not judged.
    qp_iterations, qp_tolerance, seconds
        Changes of the working set, accuracy of a row in units of the ranges, time.
    gate_width, gate_patience
        Of the innovation gate; an infinite width is no gate.
    """

    sqp_iterations: int = 1
    preparation_iterations: int = 0
    sqp_tolerance: float = 1e-9
    settling_iterations: int = 0
    trusted_step: float = np.inf
    qp_iterations: int = 1000
    qp_tolerance: float = 1e-10
    seconds: float = np.inf
    gate_width: float = np.inf
    gate_patience: int = 8
