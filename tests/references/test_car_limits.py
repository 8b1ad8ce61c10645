"""Speeds that the tyres of a car hold, wheel by wheel."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rumo
from rumo.references import SpeedLimits, SpeedProfile, generators, speed_profile
from rumo.references.car_limits import accelerations
from rumo.studies.drive.start import first_motion
from rumo.vehicles import PASSENGER_CAR, VEHICLES, Acceleration, LinearTyre, friction_ellipses, rolling_bicycle
from rumo.vehicles.parameters import GRAVITY

CAR = PASSENGER_CAR


def test_a_car_without_height_that_brakes_by_its_loads_is_a_point():
    balance = CAR.l_r / CAR.wheelbase
    flat = replace(CAR, h=0.0, J=1e-9, brake_front=balance, drive_front=balance)
    found = accelerations(flat, 0.8, 1.1)
    limit = 0.8 * 1.1 * GRAVITY
    np.testing.assert_allclose(found.lateral, np.linspace(0.0, limit, len(found.lateral)))
    circle = np.sqrt(np.maximum(limit**2 - found.lateral**2, 0.0))
    np.testing.assert_allclose(found.braking, circle, rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(found.driving, circle, rtol=1e-6, atol=1e-3)


def test_braking_straight_ahead_is_full_at_one_axle():
    mu, g, L = CAR.mu, GRAVITY, CAR.wheelbase
    # Share b of a brakes the axle that carries (l + h a / g) / L of the weight in front, (l - h a / g) / L behind;
    # of a torque, each axle's two wheels keep what slows them down.
    mass, spin = 1.0 + 4.0 * CAR.J / (CAR.r**2 * CAR.m), 2.0 * CAR.J / (CAR.r**2 * CAR.m)
    front = mu * CAR.l_r * g / ((0.66 * mass - spin) * L - mu * CAR.h)
    rear = mu * CAR.l_f * g / ((0.34 * mass - spin) * L + mu * CAR.h)
    assert accelerations(CAR, 1.0, mu).braking[0] == pytest.approx(min(front, rear), rel=1e-9)
    # Driven wheels behind gain load.
    assert accelerations(CAR, 1.0, mu).driving[0] == pytest.approx(
        mu * CAR.l_f * g / ((mass - spin) * L - mu * CAR.h), rel=1e-9
    )


@settings(max_examples=25, deadline=None)
@given(
    name=st.sampled_from(sorted(set(VEHICLES) - {"paper"})),
    grip=st.floats(0.3, 1.0),
    radius=st.floats(15.0, 60.0),
    stretch=st.floats(10.0, 80.0),
)
def test_a_profile_fills_no_ellipse(name, grip, radius, stretch):
    """What the constraints of a controller say of a car that drives the profile as its bicycle would, without drag.

    At one end of each interval: that where driving begins, or braking ends.
    """
    car = VEHICLES[name]
    path = generators.sine(0.2 * stretch, 2.0 * stretch + radius, 3)
    limits = replace(SpeedLimits.of_car(car, grip), drag=0.0)
    profile = speed_profile(path, limits, spacing=0.25)
    model, tyre = rolling_bicycle(car, LinearTyre()), LinearTyre()
    ellipses = friction_ellipses(car, tyre, grip=grip)
    rows = model.packed([model.written(item.expression, key) for key, item in ellipses.items()])
    s, v = profile.s, profile.v
    omega = v * path.at(s).curvature
    share = np.abs(v * omega) / limits.lateral
    resistance = np.interp(share, np.linspace(0.0, 1.0, len(limits.resistance)), limits.resistance)
    # Slip angles at which a linear tyre gives the force that the bend needs.
    states = np.zeros((len(model.states), len(s)))
    index = model.states.index
    front, rear = (0.5 * car.m * v * omega * arm / car.wheelbase for arm in (car.l_r, car.l_f))
    alpha_r, alpha_f = rear / car.rear.C_a, front / car.front.C_a
    states[index("v_x")], states[index("omega")] = v, omega
    states[index("v_y")] = car.l_r * omega - np.tan(alpha_r) * np.hypot(v, 0.1)
    states[index("delta")] = np.arctan2(states[index("v_y")] + car.l_f * omega, v) + alpha_f

    def used(station, a):
        torque = 0.5 * car.rolling_mass * car.r * (a + resistance[station])
        return rows(states[:, station], [torque, 0.0], model.default_parameters).full().max()

    for i in range(0, len(s) - 1, 7):
        assert min(used(i, profile.a[i]), used(i + 1, profile.a[i])) < 0.02


@pytest.mark.parametrize("lateral", [3.0, 6.0, 8.5])
@pytest.mark.parametrize("name", ["passenger", "commonroad-1", "commonroad-3"])
def test_turning_takes_what_a_bicycle_needs_to_keep_its_speed(name, lateral):
    """By the tyres and load transfer of the prediction, where the profile has Dugoff's at mean loads."""
    car = replace(VEHICLES[name], b_lon=0.0, b_lat=0.0)
    radius = 150.0
    path, speed = generators.circle(radius), np.sqrt(lateral * radius)
    profile = SpeedProfile((0.0, path.length), (speed, speed), closed=True)
    _, inputs = first_motion(path, profile, car, Acceleration())
    found = accelerations(car, 0.95, car.mu)
    resistance = np.interp(lateral, found.lateral, found.resistance)
    assert resistance == pytest.approx(inputs["acceleration"] * car.m / car.rolling_mass, rel=0.2, abs=0.02)


def test_a_circle_is_driven_as_fast_as_the_driven_axle_can_keep_up():
    grip, radius = 0.9, 30.0
    limits = SpeedLimits.of_car(CAR, grip)
    profile = speed_profile(generators.circle(radius), limits)
    assert np.ptp(profile.v) < 1e-6
    lateral = profile.v[0] ** 2 / radius
    found = accelerations(CAR, grip, CAR.mu)
    driving, resistance = (np.interp(lateral, found.lateral, item) for item in (found.driving, found.resistance))
    assert driving == pytest.approx(resistance + limits.drag * profile.v[0] ** 2, rel=1e-3)
    assert lateral < 0.93 * limits.lateral
    # A short bend is over before that.
    short = speed_profile(generators.bends([60.0, generators.Bend(radius, 0.5, 10.0), 60.0]), limits)
    assert short.v.min() > 1.02 * profile.v[0]


def test_a_car_that_lifts_a_wheel_is_on_a_road_that_gives_no_more():
    tall = replace(CAR, limits=replace(CAR.limits, lateral=7.0))
    found, slippery = accelerations(tall, 0.9, CAR.mu), accelerations(CAR, 0.9, 7.0 / GRAVITY)
    for name in ("lateral", "braking", "driving"):
        np.testing.assert_allclose(getattr(found, name), getattr(slippery, name))
    assert found.resistance[-1] < 0.7 * slippery.resistance[-1]  # its tyres are those of a dry road
    np.testing.assert_array_equal(accelerations(tall, 0.9, 0.5), accelerations(CAR, 0.9, 0.5))


def test_more_grip_is_faster_and_a_wet_road_slower():
    path = generators.figure_of_eight(40.0)
    laps = [speed_profile(path, SpeedLimits.of_car(CAR, grip)).duration for grip in (0.5, 0.7, 0.9, 1.0)]
    assert (np.diff(laps) < 0.0).all()
    assert speed_profile(path, SpeedLimits.of_car(CAR, 0.9, mu=0.5)).duration > laps[0]


@pytest.mark.parametrize("left", [(1.0,), (1.0, 2.0), (1.0, np.nan), "all"])
def test_shares_that_cannot_be_left_are_refused(left):
    with pytest.raises(rumo.ArgumentError, match="braking_left"):
        SpeedLimits(9.0, 9.0, 9.0, braking_left=left)
