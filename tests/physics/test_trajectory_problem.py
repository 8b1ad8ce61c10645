"""Cars are where they are to be when they are to be there: in reverse, at rest, at walking speed and at 30 m/s."""

import numpy as np
import pytest

import rumo
from rumo.references import SpeedLimits, SpeedProfile, TimedPath, generators, speed_profile
from rumo.references.manoeuvres import reverse_parking
from rumo.studies.drive import DrivenCar
from rumo.studies.drive.estimators import noise_of
from rumo.vehicles import (
    PASSENGER_CAR,
    Acceleration,
    RearTorque,
    SteeringAngle,
    SteeringRate,
    car_filter,
    four_wheel,
    trajectory_problem,
)


def driven(reference, problem=None, *, noisy=True, **commands):
    """A car by its reference from the first moment on; its way from where it is to be (K,) [m], and the log."""
    problem = problem or trajectory_problem(PASSENGER_CAR, **commands)
    known = {*problem.model.states}
    noise = {name: std for name, std in noise_of(PASSENGER_CAR).items() if noisy and name in known}
    drive = commands.get("drive", RearTorque())
    plant = four_wheel(PASSENGER_CAR, **commands)
    first = {name: float(values[0]) for name, values in reference.start(problem)(np.zeros(1)).items()}
    log = rumo.Scenario(
        problem,
        plant,
        DrivenCar(plant, drive, PASSENGER_CAR).start(first),
        reference,
        reference.duration + 2.0,
        backend="portable",
        sensors=rumo.Sensors(noise),
        estimator=car_filter(PASSENGER_CAR, noise, steering=commands.get("steering", SteeringRate()))
        if noisy
        else None,
    ).run()
    wanted = reference.start(problem)(log["time"].to_numpy())
    away = [log["true_states"].sel(state=name).to_numpy() - wanted[name] for name in ("p_x", "p_y")]
    return np.hypot(*away), log


def activity(log, which=slice(None)):
    """Mean move of each input a sample, in percent of its range."""
    reach = (log["input_upper"] - log["input_lower"]).to_numpy()[0]
    moves = np.abs(np.diff(log["applied"].to_numpy(), axis=0))[which]
    return 100.0 * moves.mean(axis=0) / reach


@pytest.mark.parametrize(("inputs", "steering"), [(RearTorque(), SteeringRate()), (Acceleration(), SteeringAngle())])
def test_cars_park_in_reverse(inputs, steering):
    away, log = driven(reverse_parking(vehicle=PASSENGER_CAR), noisy=False, drive=inputs, steering=steering)
    assert away.max() < 0.05
    assert away[-1] < 0.02
    assert set(log["status"].to_numpy()) == {"OPTIMAL"}


@pytest.mark.parametrize("steering", [SteeringRate(), SteeringAngle()])
def test_a_standing_car_is_quiet(steering):
    path = generators.straight(20.0)
    profile = speed_profile(path, SpeedLimits.comfort(top=10.0), start=0.0)
    away, log = driven(TimedPath(path, profile, PASSENGER_CAR, pauses={0.0: 4.0}), steering=steering)
    assert away.max() < 0.15
    assert activity(log, slice(1, 99)).max() < 0.5


def test_a_crawling_car_is_quiet():
    path = generators.straight(1.0)
    away, log = driven(TimedPath(path, SpeedProfile((0.0, 1.0), (0.1, 0.1)), PASSENGER_CAR))
    assert away.max() < 0.1
    assert activity(log).max() < 0.5
