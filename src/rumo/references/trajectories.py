"""Reference trajectories: functions from times [s] to named arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ellipeinc

from rumo.checks import as_numbers, positive_number
from rumo.errors import ShapeError
from rumo.signals import Array
from rumo.vehicles.parameters import VehicleParameters

Reference = Callable[[Array], Mapping[str, Array]]
"""Times (n,) [s] -> signal name -> values (n,)."""


def constant(values: Mapping[str, float]) -> Reference:
    """Hold each signal at a value."""
    levels = {name: as_numbers(value, f"reference[{name!r}]") for name, value in values.items()}
    for name, level in levels.items():
        if level.ndim:
            raise ShapeError(f"reference[{name!r}]", f"shape {level.shape}", "a number", "Give a function of times.")
    return lambda t: {name: np.full(np.shape(t), level) for name, level in levels.items()}


@dataclass(frozen=True)
class SinePath:
    """A sine path `p_y = a sin(2 pi p_x / w)`, driven at constant speed along it.

    Gives p_x, p_y, psi (the path's tangent), v_x and omega; with a vehicle also v_y, w_f, w_r and delta of driving the
    path's curvature without slip, which completes the state of the dynamic bicycle.

    Parameters
    ----------
    amplitude, wavelength : float
        a and w [m].
    speed : float
        Along the path [m/s].
    vehicle : VehicleParameters, optional
        The car that is to drive it.
    """

    amplitude: float = 3.0
    wavelength: float = 60.0
    speed: float = 8.0
    vehicle: VehicleParameters | None = None

    def __post_init__(self) -> None:
        positive_number(self.wavelength, "wavelength")

    def __call__(self, t: Array) -> dict[str, Array]:
        """Reference at times t (n,) [s]."""
        k = 2.0 * np.pi / self.wavelength
        slope = self.amplitude * k
        phase = self._phase(k, slope, self.speed * np.asarray(t, dtype=float))
        curvature = -slope * k * np.sin(phase) / (1.0 + (slope * np.cos(phase)) ** 2) ** 1.5
        speed = np.full_like(phase, self.speed)
        omega = speed * curvature
        reference = {
            "p_x": phase / k,
            "p_y": self.amplitude * np.sin(phase),
            "psi": np.arctan(slope * np.cos(phase)),
            "v_x": speed,
            "omega": omega,
        }
        if self.vehicle is not None:
            car = self.vehicle
            reference |= {
                "v_y": car.l_r * omega,
                "w_f": speed * np.sqrt(1.0 + (car.wheelbase * curvature) ** 2) / car.r,
                "w_r": speed / car.r,
                "delta": np.arctan(car.wheelbase * curvature),
            }
        return reference

    def _phase(self, k: float, slope: float, distance: Array) -> Array:
        """Phase k p_x at an arc length [m]: the arc length is an elliptic integral, inverted by Newton's method.

        On steep paths Newton's step can leave the interval that holds the solution; it is halved then instead.
        """
        m = slope**2 / (1.0 + slope**2)
        scale = np.sqrt(1.0 + slope**2) / k
        # The path is at least as long as its projection, and at most sqrt(1 + slope^2) times as long.
        ends = k * distance / np.sqrt(1.0 + slope**2), k * distance
        low, high = np.minimum(*ends), np.maximum(*ends)
        phase = 0.5 * (low + high)
        for _ in range(200):
            excess = scale * ellipeinc(phase, m) - distance
            low, high = np.where(excess < 0.0, phase, low), np.where(excess < 0.0, high, phase)
            newton = phase - excess / (scale * np.sqrt(1.0 - m * np.sin(phase) ** 2))
            new = np.where((low <= newton) & (newton <= high), newton, 0.5 * (low + high))
            step, phase = np.abs(new - phase), new
            if (step <= 4e-16 * np.abs(phase)).all():
                break
        return phase
