"""Speeds by place: closed forms on circles and drag races, limits that hold, and nothing given away."""

from dataclasses import replace

import numpy as np
import pytest
from curves import lobed
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import rumo
from rumo.references import Path, SpeedLimits, SpeedProfile, speed_profile

STRAIGHT = Path([(0.0, 0.0), (400.0, 0.0)])
LIMITS = SpeedLimits(lateral=8.0, braking=9.0, driving=4.0, top=50.0)
CIRCLE = Path.from_curvature((0.0, 50.0 * np.pi), (0.04, 0.04), closed=True)


def test_a_circle_is_driven_at_the_limit_of_its_radius():
    profile = speed_profile(CIRCLE, LIMITS)
    np.testing.assert_allclose(profile.v, np.sqrt(8.0 * 25.0), rtol=1e-9)
    assert profile.duration == pytest.approx(50.0 * np.pi / np.sqrt(200.0))
    np.testing.assert_allclose(profile.a, 0.0, atol=1e-9)


def test_a_drag_race_from_rest_to_rest():
    profile = speed_profile(STRAIGHT, LIMITS, start=0.0, end=0.0)
    # v^2 = 2 * 4 s up to v^2 = 2 * 9 (400 - s): they meet at 9 / 13 of the way.
    peak = np.sqrt(2.0 * 4.0 * 400.0 * 9.0 / 13.0)
    assert profile.v.max() == pytest.approx(min(peak, 50.0), rel=1e-3)
    assert profile.duration == pytest.approx(peak / 4.0 + peak / 9.0, rel=1e-3)
    s, v, a = profile.at_time(np.array([-1.0, 0.0, 2.0, profile.duration + 1.0]))
    np.testing.assert_allclose(s, [0.0, 0.0, 8.0, 400.0], atol=1e-9)
    np.testing.assert_allclose(v, [0.0, 0.0, 8.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(a, [0.0, 4.0, 4.0, 0.0], atol=1e-9)


def test_power_and_drag_are_those_of_the_equation_of_motion():
    limits = SpeedLimits(lateral=8.0, braking=9.0, driving=5.0, top=90.0, power=60.0, drag=4e-4)
    profile = speed_profile(STRAIGHT, limits, start=0.0, spacing=0.1)
    found = solve_ivp(
        lambda _, x: [x[1], min(5.0, 60.0 / max(x[1], 1e-3)) - 4e-4 * x[1] ** 2],
        (0.0, profile.duration),
        [0.0, 0.0],
        rtol=1e-9,
        t_eval=np.linspace(0.1, profile.duration, 50),
    )
    np.testing.assert_allclose(profile.speed_at(found.y[0]), found.y[1], rtol=2e-3)
    np.testing.assert_allclose(profile.time_at(found.y[0]), found.t, rtol=3e-3)


def test_a_top_speed_that_drag_forbids_is_not_reached_on_a_flying_lap():
    limits = SpeedLimits(lateral=1e3, braking=9.0, driving=9.0, top=90.0, power=60.0, drag=1e-3)
    profile = speed_profile(CIRCLE, limits)
    np.testing.assert_allclose(profile.v, (60.0 / 1e-3) ** (1.0 / 3.0), rtol=1e-3)


@st.composite
def cases(draw):
    points = draw(lobed())
    path = Path(points * (200.0 / np.abs(points).max()), closed=True)
    lateral, braking, driving = (draw(st.floats(2.0, 12.0)) for _ in range(3))
    power = draw(st.sampled_from([np.inf, 80.0]))
    return path, SpeedLimits(lateral, braking, driving, top=60.0, power=power, drag=draw(st.sampled_from([0.0, 3e-4])))


@settings(max_examples=30, deadline=None)
@given(cases(), st.sampled_from([1.0, 0.4]), st.booleans())
def test_limits_hold_and_one_of_them_is_reached_everywhere(case, slippery, flying):
    path, limits = case

    def friction(s):
        return np.where(s % path.length < 0.3 * path.length, slippery, 1.0)

    profile = speed_profile(path, limits, friction=friction, laps=None if flying else 1)
    kappa, mu = np.abs(path.at(profile.s).curvature), friction(profile.s)
    if flying:
        kappa[-1], mu[-1] = kappa[0], mu[0]
    across = profile.v**2 * kappa / (limits.lateral * mu)
    assert across.max() <= 1.0 + 1e-9
    left = np.sqrt(np.maximum(1.0 - across**2, 0.0)) * mu
    engine = np.minimum(limits.driving * left[:-1], limits.power / profile.v[:-1]) - limits.drag * profile.v[:-1] ** 2
    brakes = limits.braking * left[1:] + limits.drag * profile.v[1:] ** 2
    assert (profile.a <= engine + 1e-6).all()
    assert (-profile.a <= brakes + 1e-6).all()
    v = profile.v
    at_limit = (across >= 1.0 - 1e-6) | (v >= limits.top - 1e-6)
    driven, braked = profile.a >= engine - 1e-4, -profile.a >= brakes - 1e-4
    assert (at_limit[1:-1] | driven[:-1] | braked[1:]).all()


@settings(max_examples=20, deadline=None)
@given(cases(), st.floats(0.0, 2.0))
def test_turning_takes_speed(case, most):
    """At one end of each interval the car can drive or brake as it is to, without credit for turning in braking."""
    path, limits = case
    turning = (0.0, 0.1 * most, most)
    profile = speed_profile(path, replace(limits, resistance=turning))
    across = profile.v**2 * np.abs(path.at(profile.s).curvature) / limits.lateral
    left = np.sqrt(np.maximum(1.0 - across**2, 0.0))
    resistance, drag = np.interp(across, (0.0, 0.5, 1.0), turning), limits.drag * profile.v**2
    push = np.minimum(limits.driving * left, limits.power / profile.v) - resistance
    brakes = limits.braking * left + drag
    assert (resistance <= (limits.driving + limits.braking) * left + 1e-6).all()
    assert (profile.a <= np.maximum(push[:-1] - drag[:-1], push[1:] - drag[1:]) + 1e-6).all()
    assert (-profile.a <= np.maximum(brakes[:-1], brakes[1:]) + 1e-6).all()


@settings(max_examples=30, deadline=None)
@given(cases(), st.floats(1.0, 2.0))
def test_more_grip_is_nowhere_slower(case, more):
    path, limits = case
    less, greater = (speed_profile(path, limits, friction=mu) for mu in (1.0, more))
    # To the spacing: a station at its limit across the path leaves nothing for the next half metre.
    step = less.s[1] * max(limits.driving, limits.braking) * more / less.v.min()
    assert (greater.v >= less.v - step).all()
    assert greater.duration <= less.duration * (1.0 + 1e-3)


@settings(max_examples=20, deadline=None)
@given(cases())
def test_a_flying_lap_does_not_know_where_it_begins(case):
    path, limits = case
    profile = speed_profile(path, limits)
    assert profile.v[0] == profile.v[-1]
    s = np.linspace(-1.0, 2.0, 50) * path.length + 0.1
    np.testing.assert_allclose(profile.time_at(s + path.length), profile.time_at(s) + profile.duration)
    # In the middle of three laps from rest to rest it is the same lap, where these are long enough to get there.
    three = speed_profile(path, limits, laps=3, start=0.0, end=0.0)
    middle = three.speed_at(profile.s + path.length)
    # To the spacing, which is another one over three laps.
    step = three.s[1] * max(limits.driving, limits.braking) / profile.v.min()
    assert (middle <= profile.v + step).all()
    assert middle.max() == pytest.approx(profile.v.max(), rel=0.05)


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(0.1, 40.0), min_size=3, max_size=20), st.booleans())
def test_place_and_time_are_inverses(speeds, closed):
    s = np.linspace(0.0, 100.0, len(speeds))
    profile = SpeedProfile(s, [*speeds[:-1], speeds[0]] if closed else speeds, closed)
    places = np.linspace(-150.0, 250.0, 401)
    times = profile.time_at(places)
    back, v, a = profile.at_time(times)
    np.testing.assert_allclose(back, places, atol=1e-7)
    np.testing.assert_allclose(v, profile.speed_at(places), rtol=1e-6, atol=1e-9)
    assert (np.diff(times) > 0.0).all()
    between = np.abs((places % 100.0)[:, None] - s).min(axis=1) > 1e-3
    np.testing.assert_allclose(a[between], profile.acceleration_at(places)[between])


@pytest.mark.parametrize(("begin", "before"), [(0.0, 0.0), (5.0, -2.0)])
def test_where_the_speed_beyond_an_end_is_0_that_end_is_as_far_as_it_gets(begin, before):
    profile = SpeedProfile([0.0, 10.0, 20.0], [begin, 5.0, 0.0])
    np.testing.assert_array_equal(
        profile.time_at([-10.0, 0.0, 20.0, 30.0]), [before, 0.0, profile.duration, profile.duration]
    )


def test_stops_are_stops():
    profile = speed_profile(STRAIGHT, LIMITS, stops=(150.3, 260.0), start=0.0, end=0.0)
    np.testing.assert_array_equal(profile.speed_at([0.0, 150.3, 260.0, 400.0]), 0.0)
    assert profile.v.max() > 20.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SpeedProfile((0.0, 1.0), (1.0,)), r"speed: got shape \(1,\), expected shape \(2,\)"),
        (lambda: SpeedProfile((0.0, 0.0), (1.0, 1.0)), "stations: got .*, expected at least two arc lengths"),
        (lambda: SpeedProfile((0.0, 1.0), (1.0, -1.0)), "speed: got .*, expected finite numbers of at least 0"),
        (lambda: SpeedProfile((0.0, 1.0), (0.0, 0.0)), "speed: got 0 at two stations in a row, .*TimedPath"),
        (lambda: SpeedProfile((0.0, 1.0), (1.0, 2.0), True), "speed: got 1 at first and 2 at last, expected the same"),
        (lambda: SpeedLimits(0.0, 1.0, 1.0), "lateral: got 0.0, expected a positive finite number"),
        (lambda: SpeedLimits(1.0, 1.0, 1.0, power=0.0), "power: got 0.0, expected a positive number"),
        (lambda: SpeedLimits(1.0, 1.0, 1.0, drag=np.inf), "drag: got inf, expected a finite number"),
        (lambda: SpeedLimits.race(-1.0), "grip: got -1.0, expected a positive finite number"),
        (
            lambda: speed_profile(CIRCLE, LIMITS, start=1.0),
            "start, end, stops: got some, expected none of a flying lap",
        ),
        (lambda: speed_profile(STRAIGHT, LIMITS, laps=2), "laps: got 2, expected none on an open path"),
        (
            lambda: speed_profile(STRAIGHT, LIMITS, stops=(500.0,)),
            "stops: got .*, expected arc lengths from 0 to 400 m",
        ),
        (
            lambda: speed_profile(STRAIGHT, LIMITS, stops=(5.0, 5.1)),
            "stops: got .*, expected arc lengths at least 1.5 m",
        ),
        (lambda: speed_profile(STRAIGHT, LIMITS, friction=0.0), "friction: got 0.0, expected positive finite numbers"),
        (lambda: speed_profile(STRAIGHT, LIMITS, friction=[1.0, 2.0]), r"friction: got shape \(2,\), .*Write lambda s"),
        (
            lambda: speed_profile(STRAIGHT, LIMITS, friction=lambda s: s[:3]),
            r"friction\(s\): got shape \(3,\), expected",
        ),
        (lambda: speed_profile(STRAIGHT, 8.0), "limits: got 8.0, expected a rumo.SpeedLimits"),
    ],
)
def test_mistakes(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()


def test_what_turning_takes_has_to_be_overcome_somewhere():
    with pytest.raises(rumo.ArgumentError, match=r"resistance: got 2.5 m/s.* at first, expected at first at most"):
        SpeedLimits(8.0, 1.0, 1.0, top=40.0, resistance=(2.5, 2.5))
