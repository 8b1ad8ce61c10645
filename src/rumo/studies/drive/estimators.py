"""Estimators for a car on a track, by name, and the noise of its sensors."""

from __future__ import annotations

from rumo.errors import UnknownNameError
from rumo.estimation import Butterworth, Estimator, MovingHorizon
from rumo.studies.paper import NOISE
from rumo.vehicles import VehicleParameters, car_filter
from rumo.vehicles.chassis import BODY_STATES
from rumo.vehicles.problems import LONG

MEASURED = (*BODY_STATES, "delta")
WINDOW = 5
"""Samples that the moving horizon looks back on."""
EXACT = "none"
ESTIMATORS = ("ekf", "mhe", "butterworth", EXACT)


def noise_of(car: VehicleParameters) -> dict[str, float]:
    """Standard deviations of what is measured: the paper's, positions by the size of the car."""
    scale = car.length / LONG
    return {name: NOISE[name] * (scale if name in ("p_x", "p_y") else 1.0) for name in MEASURED}


def estimator_of(name: str, car: VehicleParameters) -> Estimator | None:
    """An estimator by name; None of "none", where the state is known exactly.

    Raises
    ------
    UnknownNameError
        If there is none of that name.
    """
    if name not in ESTIMATORS:
        raise UnknownNameError("estimator", name, ESTIMATORS)
    if name == EXACT:
        return None
    if name == "butterworth":
        return Butterworth()
    kalman = car_filter(car, noise_of(car))
    return kalman if name == "ekf" else MovingHorizon(kalman, window=WINDOW)
