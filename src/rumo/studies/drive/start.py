"""The motion in which a car begins: that of its profile where it is, so that no drive begins with a correction."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rumo.model import Model
from rumo.references import Path, SpeedProfile
from rumo.signals import Array
from rumo.vehicles import Acceleration, RearTorque, VehicleParameters, rolling_bicycle
from rumo.vehicles.axles import WHEELS

CRAWL = 1.0
"""Speed up to which a car rolls without slip [m/s]."""


def first_motion(
    path: Path,
    profile: SpeedProfile,
    car: VehicleParameters,
    drive: RearTorque | Acceleration,
    *,
    begin: float = 0.0,
    mu: float | None = None,
) -> tuple[dict[str, float], dict[str, float]]:
    """Motion of a car on its path at the profile's speed, and the inputs that hold it.

    The sideslip, the steering angle and the push of `rolling_bicycle` at which it turns as the path does, and gets
    faster as the profile does; those of rolling without slip where its tyres cannot.

    Parameters
    ----------
    path, profile : Path, SpeedProfile
        Where, and how fast.
    car : VehicleParameters
        The car.
    drive : RearTorque or Acceleration
        Its input.
    begin : float
        Arc length [m].
    mu : float, optional
        Friction of the road; the car's if not given.

    Returns
    -------
    motion : dict of str to float
        p_x, p_y, psi, v_x, v_y, omega and delta.
    inputs : dict of str to float
        Of `drive` and steering_rate.
    """
    from scipy.optimize import root  # takes longer to import than all the rest

    here, speed = path.at(begin), float(profile.speed_at(begin))
    curvature, gain = float(here.curvature), float(profile.acceleration_at(begin))
    model = _model(car, drive)
    ((along, _),) = drive.inputs(WHEELS).items()
    unit = car.m * car.r if isinstance(drive, RearTorque) else 1.0
    p = model.parameter_vector({} if mu is None else {"mu": mu})
    rows = [model.states.index(name) for name in ("v_x", "v_y", "omega")]
    wanted = np.array([gain, 0.0, speed**2 * float(here.curvature_rate) + gain * curvature])

    def motion(sideslip: float, delta: float) -> dict[str, float]:
        place = {"p_x": float(here.x), "p_y": float(here.y), "psi": float(here.heading) - sideslip}
        velocity = {"v_x": speed * float(np.cos(sideslip)), "v_y": speed * float(np.sin(sideslip))}
        return place | velocity | {"omega": speed * curvature, "delta": delta}

    def inputs(push: float) -> dict[str, float]:
        return {along: unit * push, "steering_rate": 0.0}

    def missing(z: Array) -> Array:
        x = model.states.vector(motion(z[0], z[1]), "x")
        u = model.inputs.vector(inputs(z[2]), "u")
        return model.f(x, u, p).full().ravel()[rows] - wanted

    z = np.array([np.arcsin(np.clip(car.l_r * curvature, -1.0, 1.0)), np.arctan(car.wheelbase * curvature), 0.0])
    if speed > CRAWL:
        found = root(missing, z)
        z = found.x if found.success else z
    return motion(float(z[0]), float(z[1])), inputs(float(z[2]))


@lru_cache(maxsize=16)
def _model(car: VehicleParameters, drive: RearTorque | Acceleration) -> Model:
    return rolling_bicycle(car, drive=drive)
