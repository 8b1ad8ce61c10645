"""Cars of all sizes follow a path by the problem that is made for it."""

from dataclasses import replace

import numpy as np
import pytest

import rumo
from rumo.analysis import damping
from rumo.references import TRACKS, PathTracking, SpeedLimits, Track, generators, speed_profile
from rumo.vehicles import (
    VEHICLES,
    Acceleration,
    AxleTorques,
    RearTorque,
    SteeringAngle,
    SteeringRate,
    four_wheel,
    frenet_bicycle,
    path_problem,
    rolling_bicycle,
    track_limits,
)


def drive(car, path, grip, drive=RearTorque(), steering=SteeringRate(), duration=15.0, dt=0.04, track=None):  # noqa: B008
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
        PathTracking(path, profile, parameters={} if track is None else track.room(car)),
        duration,
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


def test_the_whole_car_stays_on_the_track():
    """A straight whose right edge comes so near for a while that the path itself is no place for the car."""
    car, path = VEHICLES["passenger"], generators.straight(250.0)
    narrow = Track(path, 5.0, lambda s: np.where((s > 90.0) & (s < 140.0), 0.5 * car.width - 0.6, 4.0))
    log = drive(car, path, 0.8, duration=5.0, track=narrow)
    n, s, heading = (log["true_states"].sel(state=name).to_numpy() for name in ("n", "s", "heading_error"))
    for end in car.ends:
        # The corners, in the frame of a straight.
        x, aside = s + end * np.cos(heading), n + end * np.sin(heading) - 0.5 * car.width * np.cos(heading)
        inside = (x > 90.0) & (x < 140.0)
        assert inside.sum() > 20
        assert (aside + narrow.limits(x)[1])[inside].min() > -0.03
    assert np.abs(n[s > 200.0]).max() < 0.1  # and back
    assert n.max() < 0.8  # no further away than it needs


@pytest.mark.parametrize("where", [(0.0, 2.0, 0.0), (40.0, -3.0, 0.4), (90.0, 3.5, -0.8)])
def test_track_limits_are_those_of_corners(where):
    car, model = VEHICLES["passenger"], frenet_bicycle(VEHICLES["passenger"])
    s, n, heading = where
    rows = track_limits(car)
    x = model.states.vector(dict.fromkeys(model.states, 0.0) | {"s": s, "n": n, "heading_error": heading}, "x")
    found = model.packed([model.written(row.expression, name) for name, row in rows.items()])
    corners = {
        f"track_{end}_{side}": np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
        @ [along, across]
        for end, along in zip(("front", "rear"), car.ends, strict=True)
        for side, across in (("left", 0.5 * car.width), ("right", -0.5 * car.width))
    }
    room = {"front_left": 4.0, "front_right": 3.0, "rear_left": 2.5, "rear_right": 3.5}
    beyond = found(x, np.zeros(len(model.inputs)), model.parameter_vector(room)).full().ravel()
    for name, value in zip(rows, beyond, strict=True):
        aside = n + corners[name][1]
        expected = (aside if name.endswith("left") else -aside) - room[name.removeprefix("track_")]
        assert value == pytest.approx(expected)


def test_the_prediction_is_of_second_order_and_damps_the_loop():
    car = VEHICLES["passenger"]
    problem = path_problem(car)
    assert isinstance(rumo.RealTimeIteration(problem, backend="reference").transcription.discretization, rumo.Radau2)
    fast = {"s": 0.0, "n": 0.0, "heading_error": 0.0, "v_x": 40.0, "v_y": 0.0, "omega": 0.0, "delta": 0.0}
    still = dict.fromkeys(problem.model.inputs, 0.0)
    good = damping(problem, problem.discretization, fast, still)
    assert good.ratio > 0.9 * good.exact
    with pytest.warns(rumo.PoorDampingWarning):
        damping(problem, rumo.ImplicitEuler(), fast, still)


def test_bounds_are_those_of_the_car():
    car = VEHICLES["passenger"]
    problem = path_problem(car)
    assert problem.input_upper[1] == car.limits.steering_rate
    assert problem.input_lower[0] == pytest.approx(-0.5 * car.m * car.r * car.limits.braking)
    unknown = replace(car, limits=rumo.vehicles.VehicleLimits())
    assert np.isfinite(path_problem(unknown).input_upper).all()
    by_acceleration = path_problem(car, drive=Acceleration())
    assert by_acceleration.input_lower[0] == -car.limits.braking


@pytest.mark.parametrize(
    ("inputs", "unit"),
    [
        (RearTorque(), 2.0 / VEHICLES["passenger"].r),
        (RearTorque(axle=True), 1.0 / VEHICLES["passenger"].r),
        (Acceleration(), VEHICLES["passenger"].m),
    ],
)
def test_no_plan_asks_for_more_than_the_motor_has(inputs, unit):
    """Although the car is far too slow."""
    car = VEHICLES["passenger"]
    problem = path_problem(car, drive=inputs)
    controller = rumo.RealTimeIteration(problem, backend="portable")
    x = dict.fromkeys(problem.model.states, 0.0) | {"v_x": 30.0}
    for _ in range(3):
        plan = controller.step(x, {"n": 0.0, "velocity_across": 0.0, "velocity_along": 45.0})
    force = plan.u.values[:, 0] * unit
    v_x = plan.x.values[:-1, problem.model.states.index("v_x")]
    assert (force * v_x).max() == pytest.approx(car.limits.power, rel=0.01)
    unlimited = replace(car, limits=replace(car.limits, power=np.inf))
    assert len(path_problem(unlimited, drive=inputs).constraints) == len(problem.constraints) - 1


def test_inputs_without_weights_are_refused():
    with pytest.raises(rumo.ArgumentError, match="weights of your own"):
        path_problem(VEHICLES["passenger"], drive=AxleTorques())
