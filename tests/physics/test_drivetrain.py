"""Torques from a command to the wheels: who drives, who brakes, and that brakes turn nothing backwards."""

from dataclasses import replace

import numpy as np
import pytest
from model_values import derivative

import rumo
from rumo.vehicles import (
    PAPER_CAR,
    PASSENGER_CAR,
    Acceleration,
    AxleTorques,
    RearTorque,
    SteeringAngle,
    SteeringRate,
    WheelTorques,
    dynamic_bicycle,
    four_wheel,
    frenet_bicycle,
    rolling_bicycle,
)

ALL_WHEELS = replace(PASSENGER_CAR, drive_front=0.4, brake_front=0.7)


def wheel_torques(car, torque, speed, **options):
    """Torque that each wheel of a rolling car gets, from the rates of the wheels' speeds."""
    turning = speed / car.r
    x = {"v_x": speed, **{f"w_{wheel}": turning for wheel in ("fl", "fr", "rl", "rr")}}
    rates = derivative(four_wheel(car, **options), x, torque)
    return {wheel: car.J * rates[f"w_{wheel}"] for wheel in ("fl", "fr", "rl", "rr")}


def test_driving_and_braking_have_splits_of_their_own():
    driven = wheel_torques(ALL_WHEELS, {"torque": 100.0}, 20.0)
    assert driven == pytest.approx({"fl": 40.0, "fr": 40.0, "rl": 60.0, "rr": 60.0}, rel=1e-3)
    braked = wheel_torques(ALL_WHEELS, {"torque": -100.0}, 20.0)
    assert braked == pytest.approx({"fl": -70.0, "fr": -70.0, "rl": -30.0, "rr": -30.0}, rel=1e-3)


def test_without_brakes_the_motor_brakes_what_it_drives():
    braked = wheel_torques(PAPER_CAR, {"torque": -100.0}, 20.0)
    assert braked == pytest.approx({"fl": 0.0, "fr": 0.0, "rl": -100.0, "rr": -100.0}, abs=1e-9)


def test_a_car_with_brakes_can_be_driven_backwards():
    for speed in (0.0, -3.0):
        driven = wheel_torques(PASSENGER_CAR, {"torque": -100.0}, speed)
        assert driven == pytest.approx({"fl": 0.0, "fr": 0.0, "rl": -100.0, "rr": -100.0}, abs=1e-9)


@pytest.mark.parametrize(
    ("drive", "command"),
    [
        (RearTorque(), {"torque": 100.0}),
        (RearTorque(axle=True), {"torque": 200.0}),
        (Acceleration(), {"acceleration": 200.0 / (PASSENGER_CAR.m * PASSENGER_CAR.r)}),
        (AxleTorques(), {"torque_rear": 200.0}),
        (WheelTorques(), {"torque_rl": 100.0, "torque_rr": 100.0}),
    ],
)
def test_every_drive_can_say_the_same(drive, command):
    said = wheel_torques(PASSENGER_CAR, command, 20.0, drive=drive)
    assert said == pytest.approx({"fl": 0.0, "fr": 0.0, "rl": 100.0, "rr": 100.0}, abs=1e-6)


def test_a_steering_angle_is_what_its_rate_leads_to():
    for model in (dynamic_bicycle, four_wheel, rolling_bicycle, frenet_bicycle):
        by_rate, by_angle = (model(PASSENGER_CAR, steering=kind) for kind in (SteeringRate(), SteeringAngle()))
        x = {"v_x": 15.0, "v_y": 0.3, "omega": 0.2, **{name: 40.0 for name in by_angle.states if name[:2] == "w_"}}
        one = derivative(by_rate, {**x, "delta": 0.05})
        other = derivative(by_angle, x, {"steering_angle": 0.05})
        assert other == pytest.approx({name: rate for name, rate in one.items() if name != "delta"})


@pytest.mark.parametrize("car", [PASSENGER_CAR, replace(PASSENGER_CAR, brake_front=0.3)])
def test_brakes_lock_wheels_and_turn_none_backwards(car):
    """A car in a bend that brakes as hard as it can: wheels lock, and slide until it stands."""
    model = four_wheel(car, load_transfer=True)
    turning = 40.0 / car.r
    x = dict.fromkeys(model.states, 0.0) | {"v_x": 40.0, "omega": 0.2, "delta": 0.02}
    x |= {name: turning for name in model.states if name.startswith("w_")}
    x = model.states.vector(x, "x")
    plant, u = rumo.Plant(model, 0.02), np.array([-3000.0, 0.0])
    slowest = []
    wheels = [i for i, name in enumerate(model.states) if name.startswith("w_")]
    while x[3] > 5.0:
        x = plant.advance(x, u, plant.default_parameters)
        slowest.append(x[wheels].min())
    assert min(slowest) >= 0.0
    assert min(slowest) < 0.05  # one was locked


def test_what_is_no_input_is_refused():
    with pytest.raises(rumo.ArgumentError, match="drive: got 'torque'"):
        four_wheel(PASSENGER_CAR, drive="torque")
    with pytest.raises(rumo.ArgumentError, match="steering: got <class"):
        rolling_bicycle(PASSENGER_CAR, steering=SteeringAngle)
    with pytest.raises(rumo.ArgumentError, match=r"drive_front: got 1\.2, expected a share from 0 to 1"):
        replace(PASSENGER_CAR, drive_front=1.2)
