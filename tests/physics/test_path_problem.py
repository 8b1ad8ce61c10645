"""Cars of all sizes follow a path by the problem that is made for it."""

from dataclasses import replace

import numpy as np
import pytest

import rumo
from rumo.references import TRACKS, PathTracking, SpeedLimits, generators, speed_profile
from rumo.vehicles import (
    VEHICLES,
    Acceleration,
    AxleTorques,
    RearTorque,
    SteeringAngle,
    SteeringRate,
    four_wheel,
    path_problem,
    rolling_bicycle,
)


def drive(car, path, grip, drive=RearTorque(), steering=SteeringRate(), duration=15.0, dt=0.04):  # noqa: B008
    profile = speed_profile(path, SpeedLimits.of_car(car, grip))
    here, speed = path.at(0.0), float(profile.speed_at(0.0))
    options = {"drive": drive, "steering": steering}
    plant = four_wheel(car, load_transfer=True, **options)
    start = {"p_x": float(here.x), "p_y": float(here.y), "psi": float(here.heading), "v_x": speed}
    start |= {name: speed / car.r for name in plant.states if name.startswith("w_")}
    return rumo.Scenario(
        path_problem(car, sampling_time=dt, **options),
        plant,
        dict.fromkeys(plant.states, 0.0) | start,
        PathTracking(path, profile),
        duration,
        discretization=rumo.Radau2(),
        backend="portable",
        observed=rolling_bicycle(car, **options),
    ).run()


@pytest.mark.parametrize("name", ["passenger", "commonroad-1", "commonroad-3"])
def test_cars_follow_a_track(name):
    log = drive(VEHICLES[name], TRACKS["club"]().path, 0.7)
    settled = log["time"].to_numpy() > 2.0
    assert set(log["status"].to_numpy()[settled]) == {"OPTIMAL"}
    assert np.abs(log["true_states"].sel(state="n").to_numpy()[settled]).max() < 0.05


def test_a_small_car_follows_a_small_track():
    log = drive(VEHICLES["racer"], generators.figure_of_eight(3.0, clothoid=2.0), 0.7, dt=0.02, duration=10.0)
    settled = log["time"].to_numpy() > 1.0
    assert np.abs(log["true_states"].sel(state="n").to_numpy()[settled]).max() < 0.05
    assert set(log["status"].to_numpy()[settled]) == {"OPTIMAL"}


@pytest.mark.parametrize("steering", [SteeringRate(), SteeringAngle()])
@pytest.mark.parametrize("inputs", [RearTorque(axle=True), Acceleration()])
def test_cars_can_be_told_in_other_ways(inputs, steering):
    log = drive(VEHICLES["passenger"], generators.figure_of_eight(30.0), 0.6, inputs, steering, duration=8.0)
    settled = log["time"].to_numpy() > 2.0
    assert np.abs(log["true_states"].sel(state="n").to_numpy()[settled]).max() < 0.05


def test_bounds_are_those_of_the_car():
    car = VEHICLES["passenger"]
    problem = path_problem(car)
    assert problem.input_upper[1] == car.limits.steering_rate
    assert problem.input_lower[0] == pytest.approx(-0.5 * car.m * car.r * car.limits.braking)
    unknown = replace(car, limits=rumo.vehicles.VehicleLimits())
    assert np.isfinite(path_problem(unknown).input_upper).all()
    by_acceleration = path_problem(car, drive=Acceleration())
    assert by_acceleration.input_lower[0] == -car.limits.braking


def test_inputs_without_weights_are_refused():
    with pytest.raises(rumo.ArgumentError, match="weights of your own"):
        path_problem(VEHICLES["passenger"], drive=AxleTorques())
