"""What makes a drive harder, step by step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rumo.checks import non_negative_number, positive_number
from rumo.estimation import Estimator
from rumo.simulation import Constant
from rumo.studies.paper import CLOSE_WEIGHTS, FILTER, NOISE, PaperStudy


@dataclass(frozen=True)
class Drive(PaperStudy):
    """The case study with a car that may point away from its path at first.

    Parameters
    ----------
    heading_error : float
        Angle from the path's tangent to the car at the start [rad].
    """

    heading_error: float = 0.0

    def initial_state(self) -> dict[str, float]:
        """Plant state at the start, driving straight ahead without slip."""
        state = super().initial_state()
        return state | {"psi": state["psi"] + self.heading_error}


BASE = Drive(weights=CLOSE_WEIGHTS, estimator=None, noise={}, wind=Constant(0.0), initial_error=0.0)
"""The drive that is made harder: the paper's path and car, but exact measurements, no wind, a start on the path."""


@dataclass(frozen=True)
class Sweep:
    """One thing that grows from drive to drive.

    Attributes
    ----------
    title, unit : str
        What grows, and its unit.
    values : tuple of float
        By default.
    drive : callable
        (base, value) -> the drive.
    check : callable
        (value, argument) -> value; raises for a value that cannot be driven.
    """

    title: str
    unit: str
    values: tuple[float, ...]
    drive: Callable[[Drive, float], Drive]
    check: Callable[[object, str], float] = non_negative_number


def _with_initial_error(base: Drive, error: float) -> Drive:
    return replace(base, initial_error=error)


def _with_heading(base: Drive, error: float) -> Drive:
    return replace(base, heading_error=error)


def _with_speed(base: Drive, speed: float) -> Drive:
    return replace(base, path=replace(base.path, speed=speed))


def _with_curvature(base: Drive, curvature: float) -> Drive:
    # A sine path bends most at its crests, by a (2 pi / w)^2.
    wavelength = 2.0 * np.pi * np.sqrt(base.path.amplitude / curvature)
    return replace(base, path=replace(base.path, wavelength=wavelength))


def _with_noise(base: Drive, scale: float, estimator: Estimator | None) -> Drive:
    noise = {name: scale * deviation for name, deviation in NOISE.items()}
    return replace(base, noise=noise, estimator=estimator, path=replace(base.path, speed=12.0))


SWEEPS: dict[str, Sweep] = {
    "initial_error": Sweep(
        "Initial distance from the path",
        "m",
        (0.0, 1.0, 2.0, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0),
        _with_initial_error,
    ),
    "heading": Sweep(
        "Initial heading error",
        "rad",
        (0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.4),
        _with_heading,
    ),
    "curvature": Sweep(
        "Peak curvature of the path",
        "1/m",
        (0.03, 0.06, 0.09, 0.12, 0.15, 0.18, 0.21, 0.24, 0.27),
        _with_curvature,
        positive_number,
    ),
    "speed": Sweep(
        "Speed",
        "m/s",
        (4.0, 8.0, 12.0, 14.0, 16.0, 17.0, 18.0, 19.0, 20.0, 22.0),
        _with_speed,
        positive_number,
    ),
    "noise": Sweep(
        "Filtered noise over the paper's",
        "1",
        (0.0, 0.5, 1.0, 1.5, 2.0, 3.0),
        partial(_with_noise, estimator=FILTER),
    ),
    "raw_noise": Sweep(
        "Raw noise over the paper's",
        "1",
        (0.0, 0.5, 1.0, 1.5, 2.0, 3.0),
        partial(_with_noise, estimator=None),
    ),
}
"""What can grow, by name. Noise is driven at 12 m/s, all else but speed at the speed of the base, 8 m/s."""
