"""Paths by the clock: stops, reverse, one leg after the other; signals that are derivatives of each other."""

import numpy as np
import pytest

import rumo
from rumo.references import TRACKS, Legs, Path, SpeedLimits, SpeedProfile, TimedPath, speed_profile
from rumo.references.manoeuvres import constant_radius, reverse_parking, stop_and_go
from rumo.vehicles import PASSENGER_CAR

LIMITS = SpeedLimits(lateral=4.0, braking=3.0, driving=2.0, top=15.0)
CLUB = TRACKS["club"]().path
ALL = ("p_x", "p_y", "psi", "course", "speed", "v_x", "omega")


def consistent(reference, times):
    """Velocity and rate of turning are the derivatives of position and heading."""
    step = 1e-5
    before, here, after = reference(times - step), reference(times), reference(times + step)
    rate = {name: (after[name] - before[name]) / (2.0 * step) for name in ("p_x", "p_y", "psi")}
    most = np.abs(here["v_x"]).max()
    np.testing.assert_allclose(rate["p_x"], here["speed"] * np.cos(here["course"]), atol=1e-4 * most)
    np.testing.assert_allclose(rate["p_y"], here["speed"] * np.sin(here["course"]), atol=1e-4 * most)
    np.testing.assert_allclose(rate["psi"], here["omega"], atol=1e-3)
    ahead = here["v_x"] * np.cos(here["psi"])
    np.testing.assert_allclose(ahead, here["speed"] * np.cos(here["course"]), atol=1e-9)


@pytest.mark.parametrize("reverse", [False, True])
def test_signals_belong_together(reverse):
    profile = speed_profile(CLUB, LIMITS)
    reference = TimedPath(CLUB, profile, outputs=ALL, reverse=reverse, begin=100.0)
    consistent(reference, np.linspace(-5.0, 2.2 * profile.duration, 1013))
    here = reference(np.zeros(1))
    np.testing.assert_allclose([here["p_x"][0], here["p_y"][0]], CLUB.offset(100.0, 0.0), atol=1e-9)
    assert reference.time_at(100.0) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("reverse", [False, True])
def test_a_rear_axle_has_no_sideslip(reverse):
    profile = speed_profile(CLUB, LIMITS)
    path = TimedPath(CLUB, profile, PASSENGER_CAR, (*ALL, "v_y", "delta"), reverse=reverse, rear_axle=True)
    times = np.linspace(0.0, profile.duration, 1013)
    step, here = 1e-5, path(times)
    before, after = path(times - step), path(times + step)
    rate = {name: (after[name] - before[name]) / (2.0 * step) for name in ("p_x", "p_y", "psi")}
    cos, sin = np.cos(here["psi"]), np.sin(here["psi"])
    # Of the centre of gravity along the car and across it; of the axle behind it there is nothing across.
    np.testing.assert_allclose(rate["p_x"] * cos + rate["p_y"] * sin, here["v_x"], atol=1e-3)
    np.testing.assert_allclose(rate["p_y"] * cos - rate["p_x"] * sin, here["v_y"], atol=1e-3)
    np.testing.assert_allclose(here["v_y"] - PASSENGER_CAR.l_r * rate["psi"], 0.0, atol=1e-3)
    np.testing.assert_allclose(rate["psi"], here["omega"], atol=1e-3)
    np.testing.assert_allclose(np.tan(here["delta"]) * here["v_x"], PASSENGER_CAR.wheelbase * here["omega"], atol=1e-9)
    np.testing.assert_allclose(rate["p_x"], here["speed"] * np.cos(here["course"]), atol=1e-3)
    np.testing.assert_allclose(rate["p_y"], here["speed"] * np.sin(here["course"]), atol=1e-3)
    axle = here["p_x"] - PASSENGER_CAR.l_r * cos, here["p_y"] - PASSENGER_CAR.l_r * sin
    points = CLUB.at(profile.at_time(times)[0])
    np.testing.assert_allclose(axle, [points.x, points.y], atol=1e-9)


def test_stop_and_go():
    reference = stop_and_go(stops=3, distance=60.0, pause=3.0)
    times = np.linspace(0.0, reference.duration, 5001)
    signals = reference(times)
    standing = signals["v_x"] < 1e-3
    assert standing.sum() * times[1] == pytest.approx(4 * 3.0, abs=0.1)
    np.testing.assert_allclose(np.unique(np.round(signals["p_x"][standing], 3)), [0.0, 60.0, 120.0, 180.0], atol=1e-3)
    np.testing.assert_allclose(reference(np.array([reference.duration + 9.0]))["p_x"], 180.0)
    assert reference.time_at(60.0) == pytest.approx(3.0 + (reference.duration - 12.0) / 3.0)
    assert np.abs(np.diff(signals["v_x"])).max() < 2.0 * times[1] * 1.1


def test_back_into_a_parking_space():
    reference = reverse_parking(vehicle=PASSENGER_CAR)
    signals = reference(np.linspace(0.0, reference.duration + 1.0, 4001))
    assert np.abs(np.diff(signals["psi"])).max() < 0.01
    assert signals["psi"][-1] == pytest.approx(0.5 * np.pi, abs=1e-6)
    assert signals["v_x"].max() == pytest.approx(1.5)
    assert signals["v_x"].min() == pytest.approx(-1.5)
    # Wheels turn backwards in reverse; steering to the right brings the tail to the right.
    back = signals["v_x"] < -0.5
    assert (signals["w_r"][back] < 0.0).all()
    assert signals["delta"][back].min() == pytest.approx(-np.arctan(PASSENGER_CAR.wheelbase / 6.0))
    assert signals["p_y"][-1] < -5.0
    yaw = np.gradient(signals["psi"], (reference.duration + 1.0) / 4000)
    np.testing.assert_allclose(yaw, signals["omega"], atol=0.02)


def test_a_circle_ever_faster():
    path, profile = constant_radius(50.0, lateral=6.0, start=5.0, acceleration=0.2)
    signals = TimedPath(path, profile)(np.linspace(0.0, profile.duration, 101))
    np.testing.assert_allclose(np.diff(signals["v_x"]), 0.2 * profile.duration / 100.0)
    assert signals["v_x"][-1] ** 2 / 50.0 == pytest.approx(6.0)
    np.testing.assert_allclose(np.hypot(signals["p_x"], signals["p_y"] - 50.0), 50.0, rtol=1e-9)
    np.testing.assert_allclose(signals["omega"], signals["v_x"] / 50.0)


STRAIGHT = Path([(0.0, 0.0), (50.0, 0.0)])
MOVING = SpeedProfile((0.0, 50.0), (5.0, 5.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: TimedPath(STRAIGHT, MOVING, pauses={20.0: 1.0}),
            r"pauses\[20.0\]: got a place that is passed at 5 m/s",
        ),
        (
            lambda: TimedPath(CLUB, speed_profile(CLUB, LIMITS), pauses={0.0: 1.0}),
            "pauses: got .*, expected none on a flying",
        ),
        (lambda: TimedPath(STRAIGHT, MOVING, outputs=("w_f",)), "outputs: got 'w_f'.*vehicle"),
        (lambda: TimedPath(STRAIGHT, MOVING, rear_axle=True), "vehicle: got None, expected one that knows .* l_r"),
        (
            lambda: TimedPath(STRAIGHT, MOVING, PASSENGER_CAR, ("n",), rear_axle=True),
            "outputs: got 'n', expected one of",
        ),
        (lambda: TimedPath(STRAIGHT, MOVING, begin=np.nan), "begin: got nan, expected a finite number"),
        (lambda: Legs(()), r"legs: got \(\), expected some of"),
        (lambda: Legs((TimedPath(STRAIGHT, MOVING), MOVING)), r"legs\[1\]: got .*, expected a rumo.TimedPath"),
        (
            lambda: Legs((TimedPath(STRAIGHT, MOVING), TimedPath(STRAIGHT, MOVING, PASSENGER_CAR))),
            r"legs\[1\]: got other signals than those of the first",
        ),
        (lambda: constant_radius(100.0, lateral=0.1), "lateral: got 0.1, expected more than 0.25 m/s"),
        (lambda: stop_and_go(stops=0), "stops: got 0, expected a whole number of at least 1"),
    ],
)
def test_mistakes(make, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        make()
