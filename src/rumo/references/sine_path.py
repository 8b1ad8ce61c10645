"""A sine path, driven at constant speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import ellipeinc

from rumo.checks import finite_number, positive_number
from rumo.references.base import OfTime
from rumo.references.motion import Rolling, check_vehicle
from rumo.signals import Array


@dataclass(frozen=True)
class SinePath(OfTime):
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
        The car that is to drive it, or anything else that is `Rolling`.
    """

    pointwise: ClassVar[bool] = True

    amplitude: float = 3.0
    wavelength: float = 60.0
    speed: float = 8.0
    vehicle: Rolling | None = None

    def __post_init__(self) -> None:
        finite_number(self.amplitude, "amplitude")
        positive_number(self.wavelength, "wavelength")
        finite_number(self.speed, "speed")
        check_vehicle(self.vehicle)

    def __call__(self, t: Array) -> dict[str, Array]:
        """Reference at times t (n,) [s]."""
        k = 2.0 * np.pi / self.wavelength
        slope = self.amplitude * k
        phase = self._phase(k, slope, self.speed * np.asarray(t, dtype=float))
        curvature = -slope * k * np.sin(phase) / (1.0 + (slope * np.cos(phase)) ** 2) ** 1.5
        speed = np.full_like(phase, self.speed)
        reference = {
            "p_x": phase / k,
            "p_y": self.amplitude * np.sin(phase),
            "psi": np.arctan(slope * np.cos(phase)),
            "v_x": speed,
            "omega": speed * curvature,
        }
        if self.vehicle is not None:
            reference |= self.vehicle.rolling(speed, curvature)
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
        found = np.zeros(phase.shape, dtype=bool)  # those are left as they are: no time is to depend on others
        for _ in range(200):
            excess = scale * ellipeinc(phase, m) - distance
            low, high = np.where(excess < 0.0, phase, low), np.where(excess < 0.0, high, phase)
            newton = phase - excess / (scale * np.sqrt(1.0 - m * np.sin(phase) ** 2))
            new = np.where((low <= newton) & (newton <= high), newton, 0.5 * (low + high))
            step, phase = np.abs(new - phase), np.where(found, phase, new)
            found |= step <= 4e-16 * np.abs(new)
            if found.all():
                break
        return phase
