"""One sample of ordinary differential equations that may be stiff, and may jump."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
from scipy.integrate import ODEintWarning, odeint

from rumo.errors import PlantError
from rumo.signals import Array

COARSER = 100.0
"""Factor of the tolerance at the second attempt."""
STEPS = 1000
"""Of LSODA, within a sample, before an attempt is given up: some 50 are usual."""
SHORT = 1e-5
"""Step where equations slide along a jump [s]: a fifth of the longest that is stable for wheels at 0.1 m/s."""


def integrated(rates: Callable[[list[float]], list[float]], x: Array, duration: float, tolerance: float) -> Array:
    """State (nx,) after a duration, by LSODA (Petzold, 1983).

    On both sides of a jump, such as the one of a hard switch, equations may lead back to it. The solution then slides
    along the jump (Filippov, 1988), and methods that control their error shorten their steps without end. Where two
    attempts of LSODA come to nothing, explicit Euler goes on in short steps, off the solution by about one of them.

    Parameters
    ----------
    rates : callable
        Derivatives (nx,) at a state (nx,), as lists, which are faster here.
    x : ndarray, shape (nx,)
        State at the beginning.
    duration : float
        [s].
    tolerance : float
        Absolute and relative.

    Raises
    ------
    PlantError
        If `rates` divide by zero or leave the finite numbers.
    """
    try:
        for attempt in (tolerance, COARSER * tolerance):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ODEintWarning)  # `message` says the same
                path, said = odeint(
                    lambda x, t: rates(x.tolist()),
                    x,
                    (0.0, duration),
                    rtol=attempt,
                    atol=attempt,
                    mxstep=STEPS,
                    full_output=True,
                )
            if said["message"] == "Integration successful.":
                return path[-1]
        end, count = x.tolist(), int(np.ceil(duration / SHORT))
        for _ in range(count):
            end = [value + duration / count * rate for value, rate in zip(end, rates(end), strict=True)]
    except (ArithmeticError, ValueError) as error:  # ValueError: sines of infinity
        raise PlantError(
            f"The equations have no value within the sample that begins at x = {x.tolist()}: {error}"
        ) from None
    return np.array(end)
