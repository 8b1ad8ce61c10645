"""A filter for a car expects what it meets, on roads that it was not tuned on."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rumo
from rumo.estimation import consistency
from rumo.estimation.tuning import recorded_drive, replayed
from rumo.references import TRACKS, PathTracking, SpeedLimits, generators, load_track, speed_profile
from rumo.simulation import Constant, RandomWalk
from rumo.studies.paper import NOISE
from rumo.vehicles import (
    PASSENGER_CAR,
    VEHICLES,
    SteeringAngle,
    SteeringRate,
    car_filter,
    four_wheel,
    path_problem,
    rolling_bicycle,
)

FOLDER = os.environ.get("RUMO_TRACKS")
FILES = sorted(Path(FOLDER).glob("*.csv")) if FOLDER else []


def scenario(car, path, grip, duration, dt=0.04, steering=SteeringRate(), noise=NOISE, wind=2.0, **problem):  # noqa: B008
    profile = speed_profile(path, SpeedLimits.of_car(car, grip))
    here, speed = path.at(0.0), float(profile.speed_at(0.0))
    plant, observed = four_wheel(car, load_transfer=True, steering=steering), rolling_bicycle(car, steering=steering)
    start = {"p_x": float(here.x), "p_y": float(here.y), "psi": float(here.heading), "v_x": speed}
    start |= {name: speed / car.r for name in plant.states if name.startswith("w_")}
    noise = {name: noise[name] for name in observed.states}
    return rumo.Scenario(
        path_problem(car, sampling_time=dt, steering=steering, **problem),
        plant,
        dict.fromkeys(plant.states, 0.0) | start,
        PathTracking(path, profile, vehicle=car),
        duration or 1.004 * profile.duration,
        discretization=rumo.Radau2(),
        backend="portable",
        observed=observed,
        sensors=rumo.Sensors(noise),
        estimator=car_filter(car, noise, steering=steering, sampling_time=dt),
        disturbances={"wind_speed": RandomWalk(mean=wind, std=0.75 * wind), "wind_direction": Constant(1.57)},
    )


def check(log, least=0.6):
    """In all, and each channel's mean square at least, and 1.4 at most."""
    judged = consistency(log, after=1.0)
    assert 0.85 < judged.nis / judged.expected < 1.15, judged
    for name, channel in judged.channels.items():
        assert least < channel.mean_square < 1.4, (name, judged)


@pytest.mark.parametrize(
    ("name", "dt"), [("passenger", 0.04), ("passenger", 0.02), ("commonroad-1", 0.04), ("commonroad-3", 0.04)]
)
def test_cars_are_what_their_filters_expect(name, dt):
    check(scenario(VEHICLES[name], TRACKS["club"]().path, 0.8, 10.0, dt).run())


def test_so_is_one_that_is_told_angles():
    check(scenario(PASSENGER_CAR, TRACKS["club"]().path, 0.8, 10.0, steering=SteeringAngle()).run())


def test_so_is_a_small_one():
    """But for its yaw rate, which settles so quickly that less is missed of it."""
    noise = NOISE | {"p_x": 0.005, "p_y": 0.005}
    path = generators.figure_of_eight(3.0, clothoid=2.0)
    check(scenario(VEHICLES["racer"], path, 0.9, 10.0, 0.02, noise=noise, wind=0.0).run(), least=0.3)


def test_a_log_has_all_that_the_filter_was_told():
    """Of a controller whose model has other parameters than the filter's, in another order."""
    drive = scenario(PASSENGER_CAR, TRACKS["club"]().path, 0.8, 4.0)
    drive = replace(drive, problem=drive.problem.changed(parameters={"mu": 0.8}))
    log, observed = drive.run(), rolling_bicycle(PASSENGER_CAR)
    log = log.isel(model_parameter=slice(None, None, -1))
    weights = {"track": {"v_x": rumo.Weight(1.0)}, "moves": {name: rumo.Weight(1.0) for name in observed.inputs}}
    problem = rumo.Problem(observed, horizon=1, sampling_time=0.04, **weights)
    again = replayed(drive.estimator.start(problem, drive.estimator.noise), recorded_drive(log, observed))
    nis = [np.nan if item is None else item.nis for item in again]
    np.testing.assert_allclose(nis, log["nis"], rtol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        (("passenger", NOISE), {}, "car: got 'passenger'"),
        ((PASSENGER_CAR, NOISE), {"sampling_time": 0.0}, "sampling_time: got 0"),
        ((PASSENGER_CAR, NOISE), {"steering": "angle"}, "steering: got 'angle'"),
    ],
)
def test_arguments_are_checked(arguments, options, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        car_filter(*arguments, **options)


@pytest.mark.slow
@pytest.mark.skipif(not FILES, reason="RUMO_TRACKS names no folder with tracks")
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_laps_at_nine_tenths_of_grip(file):
    """Real tracks in wind, with the paper's noise, from grids and weights of a car that is to be on time."""
    drive = scenario(PASSENGER_CAR, load_track(file).path, 0.9, 0.0, horizon=rumo.Grid([0.04] * 4 + [0.08] * 20))
    log = replace(drive, problem=drive.problem.changed(weights={"velocity_along": 5.0})).run()
    n = log["true_states"].sel(state="n").to_numpy()
    assert np.sqrt((n**2).mean()) < 0.05
    check(log)
