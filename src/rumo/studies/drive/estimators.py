"""Estimators for a car on a track, by name, and the noise of its sensors."""

from __future__ import annotations

from rumo.errors import UnknownNameError
from rumo.estimation import Butterworth, Estimator, ExtendedKalman, MovingHorizon
from rumo.studies.paper import NOISE
from rumo.vehicles import VehicleParameters
from rumo.vehicles.chassis import BODY_STATES
from rumo.vehicles.problems import LONG

MEASURED = (*BODY_STATES, "delta")
PROCESS = {"p_x": 1.5e-3, "p_y": 1.5e-3, "psi": 3e-4, "v_x": 0.015, "v_y": 0.015, "omega": 6e-3, "delta": 3e-4}
"""What a prediction at the limit of grip misses in a sample: standard deviations in the states' units."""
WINDOW = 5
"""Samples that the moving horizon looks back on."""
EXACT = "none"
ESTIMATORS = ("ekf", "mhe", "butterworth", EXACT)


def noise_of(car: VehicleParameters) -> dict[str, float]:
    """Standard deviations of what is measured: the paper's, positions by the size of the car."""
    return {name: NOISE[name] * (_scale(car) if name in ("p_x", "p_y") else 1.0) for name in MEASURED}


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
    process = {state: size * (_scale(car) if state in ("p_x", "p_y") else 1.0) for state, size in PROCESS.items()}
    kalman = ExtendedKalman(noise=noise_of(car), process=process)
    return kalman if name == "ekf" else MovingHorizon(kalman, window=WINDOW)


def _scale(car: VehicleParameters) -> float:
    return car.length / LONG
