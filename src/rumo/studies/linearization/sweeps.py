"""What makes a drive harder, step by step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from rumo.checks import finite_number, non_negative_number, positive_number
from rumo.estimation import Estimator
from rumo.studies.linearization.corners import CHICANE, CORNER, HAIRPIN, LONG_BEND, RIGHT_ANGLE, CornerDrive
from rumo.studies.linearization.drives import Drive
from rumo.studies.paper import FILTER, NOISE


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
    base : Drive or None
        What is made harder; None: what the study says.
    """

    title: str
    unit: str
    values: tuple[float, ...]
    drive: Callable[[Any, float], Drive]
    check: Callable[[object, str], float] = non_negative_number
    base: Drive | None = None


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


def _with_grip(base: CornerDrive, share: float) -> Drive:
    return replace(base, grip=share)


def _with_ice(base: CornerDrive, duration: float) -> Drive:
    return replace(base, ice=duration)


def _corner(title: str, values: tuple[float, ...], **changes: Any) -> Sweep:
    return Sweep(title, "mu g", values, _with_grip, positive_number, replace(CORNER, **changes))


BEND = replace(CORNER, bends=LONG_BEND, held_speed=True)
"""Along a bend at the speed that it is made for, which is held."""

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
    "hairpin": _corner("Grip used in a hairpin", (0.7, 0.85, 1.0, 1.1), bends=HAIRPIN),
    "chicane": _corner("Grip used in a chicane", (0.7, 0.85, 1.0, 1.1), bends=CHICANE),
    "right_angle": _corner("Grip used in a right angle", (0.7, 0.85, 1.0, 1.1), bends=RIGHT_ANGLE),
    "cold_start": Sweep(
        "Grip used in a bend, cold start",
        "mu g",
        (0.5, 0.7, 0.9, 1.0, 1.1),
        _with_grip,
        positive_number,
        replace(BEND, in_the_bend=True),
    ),
    "bend_error": Sweep(
        "Start in a bend, to its inside",
        "m",
        (-12.0, -8.0, -4.0, -2.0, 2.0, 4.0, 8.0, 12.0),
        _with_initial_error,
        finite_number,
        replace(BEND, grip=0.5, in_the_bend=True),
    ),
    "ice": Sweep(
        "Time on ice in a bend",
        "s",
        (0.16, 0.32, 0.64, 1.0, 1.2),
        _with_ice,
        base=BEND,
    ),
}
"""What can grow, by name. On the sine path noise is driven at 12 m/s, all else but speed at the base's speed, 8 m/s."""
