"""A road by its curvature: clothoids, constant accelerations, straights beyond its ends; the speeds it allows."""

import numpy as np
import pytest
from scipy.special import fresnel

import rumo
from rumo.references import Following, Road, speeds_within
from rumo.signals import NamedArray, Signals
from rumo.vehicles import PASSENGER_CAR

BENDS = Road((0.0, 30.0, 38.0, 60.0, 68.0, 100.0), (0.0, 0.0, 0.1, 0.1, -0.05, 0.0), (20.0, 15.0, 8.0, 8.0, 9.0, 12.0))
TIMES = np.linspace(-1.0, 11.0, 2401)


def test_constant_curvature_is_a_circle():
    road = Road((0.0, 60.0), (0.1, 0.1), 10.0)
    reference = road(np.linspace(0.0, 6.0, 301))
    radius = np.hypot(reference["p_x"], reference["p_y"] - 10.0)
    np.testing.assert_allclose(radius, 10.0, rtol=1e-10)
    np.testing.assert_allclose(reference["psi"], np.linspace(0.0, 6.0, 301), atol=1e-12)


def test_linear_curvature_is_a_clothoid():
    # psi = s^2 / (2 a^2): Fresnel's integrals of s / (a sqrt(pi)).
    a, s = 15.0, np.linspace(0.0, 40.0, 401)
    reference = Road((0.0, 40.0), (0.0, 40.0 / a**2), 1.0)(s)
    y, x = (a * np.sqrt(np.pi) * part for part in fresnel(s / (a * np.sqrt(np.pi))))
    np.testing.assert_allclose(reference["p_x"], x, atol=1e-9)
    np.testing.assert_allclose(reference["p_y"], y, atol=1e-9)


def test_it_is_driven_at_its_speed_along_its_tangent():
    step = 1e-5
    before, here, after = BENDS(TIMES - step), BENDS(TIMES), BENDS(TIMES + step)
    rates = {name: (after[name] - before[name]) / (2.0 * step) for name in ("p_x", "p_y", "psi")}
    # Curvature jumps in no place of this road.
    np.testing.assert_allclose(rates["p_x"], here["v_x"] * np.cos(here["psi"]), atol=2e-4)
    np.testing.assert_allclose(rates["p_y"], here["v_x"] * np.sin(here["psi"]), atol=2e-4)
    np.testing.assert_allclose(rates["psi"], here["omega"], atol=2e-4)


def test_speeds_are_those_of_the_stations_with_constant_accelerations_between():
    times = np.array([BENDS.time_at(s) for s in BENDS.stations])
    np.testing.assert_allclose(BENDS(times)["v_x"], BENDS.speed)
    np.testing.assert_allclose(BENDS(times)["omega"], np.multiply(BENDS.speed, BENDS.curvature), atol=1e-12)
    lengths, averages = np.diff(BENDS.stations), 0.5 * (times[:-1] + times[1:])
    np.testing.assert_allclose(np.diff(times), 2.0 * lengths / np.add(BENDS.speed[:-1], BENDS.speed[1:]))
    np.testing.assert_allclose(BENDS(averages)["v_x"], 0.5 * np.add(BENDS.speed[:-1], BENDS.speed[1:]))


def test_it_is_straight_beyond_its_ends():
    for times, speed in ((np.array([-2.0, -1.0, 0.0]), 20.0), (BENDS.time_at(100.0) + np.array([0.0, 1.0, 2.0]), 12.0)):
        reference = BENDS(times)
        assert np.ptp(reference["psi"]) == 0.0
        np.testing.assert_array_equal(reference["v_x"], speed)
        legs = np.hypot(np.diff(reference["p_x"]), np.diff(reference["p_y"]))
        np.testing.assert_allclose(legs, speed)


@pytest.mark.parametrize("place", [-5.0, 0.0, 34.0, 68.0, 120.0])
def test_it_may_start_anywhere(place):
    road = Road(BENDS.stations, BENDS.curvature, BENDS.speed, start=place)
    assert road.time_at(place) == pytest.approx(0.0, abs=1e-12)
    there, whole = road(TIMES), BENDS(TIMES + BENDS.time_at(place))
    for name in there:
        np.testing.assert_allclose(there[name], whole[name], atol=1e-9)


def test_a_car_rolls_along_it():
    road = Road(BENDS.stations, BENDS.curvature, BENDS.speed, PASSENGER_CAR)
    reference = road(TIMES)
    rolling = PASSENGER_CAR.rolling(reference["v_x"], reference["omega"] / reference["v_x"])
    for name, values in rolling.items():
        np.testing.assert_allclose(reference[name], values, atol=1e-12)


def test_it_can_be_followed():
    here = {name: values[0] for name, values in BENDS(np.array([4.0])).items()}
    place = NamedArray(Signals({"p_x": "m", "p_y": "m"}, "states"), np.array([here["p_x"], here["p_y"]]))
    ahead = Following(BENDS).preview(np.array([3.0, 3.5]), place)
    np.testing.assert_allclose(ahead.signals["psi"], BENDS(np.array([4.0, 4.5]))["psi"], atol=1e-5)


def test_speeds_stay_within_what_tyres_hold_and_reach_it():
    s = np.arange(0.0, 200.0, 0.5)
    kappa = np.interp(s, BENDS.stations, BENDS.curvature)
    limits = {"lateral": 8.0, "braking": 5.0, "driving": 3.0}
    v = speeds_within(s, kappa, **limits, top=25.0)
    across, along = v**2 * np.abs(kappa), 0.5 * np.diff(v**2) / np.diff(s)
    assert across.max() == pytest.approx(8.0)
    # An acceleration is within what is left where it begins: in time for driving, backwards for braking.
    left = np.sqrt(1.0 - np.minimum(across / 8.0, 1.0) ** 2)
    assert (along <= 3.0 * left[:-1] + 1e-9).all()
    assert (-along <= 5.0 * left[1:] + 1e-9).all()
    # Nothing is given away: each speed is at one of its limits.
    binding = [across[1:-1] >= 8.0 - 1e-9, along[:-1] >= 3.0 * left[:-2] - 1e-9, -along[1:] >= 5.0 * left[2:] - 1e-9]
    assert np.any([*binding, v[1:-1] == 25.0], axis=0).all()
    # Against the direction of travel braking is driving.
    mirrored = speeds_within(s, kappa[::-1], lateral=8.0, braking=3.0, driving=5.0, top=25.0)
    np.testing.assert_allclose(mirrored, v[::-1])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"stations": (0.0, 0.0)}, "stations: got (0.0, 0.0), expected at least two arc lengths [m], increasing."),
        ({"stations": (1.0,)}, "stations: got (1.0,), expected at least two arc lengths"),
        ({"curvature": (0.0,)}, "curvature: got shape (1,), expected shape (2,), one at each station."),
        ({"curvature": (0.0, np.nan)}, "curvature: got (0.0, nan), expected finite numbers [1/m]."),
        ({"speed": (8.0, 0.0)}, "speed: got (8.0, 0.0), expected positive finite numbers [m/s]."),
        ({"speed": (8.0, 8.0, 8.0)}, "speed: got shape (3,), expected shape (2,), one at each station."),
        ({"start": np.inf}, "start: got inf, expected a finite number."),
        ({"vehicle": PASSENGER_CAR.m}, "vehicle: got 1093"),
    ],
)
def test_bad_roads(settings, message):
    with pytest.raises(rumo.ArgumentError) as error:
        Road(**{"stations": (0.0, 50.0), "curvature": (0.0, 0.1), "speed": 8.0} | settings)
    assert message in str(error.value)


@pytest.mark.parametrize("name", ["lateral", "braking", "driving", "top"])
def test_bad_limits(name):
    limits = {"lateral": 8.0, "braking": 5.0, "driving": 3.0, "top": 25.0} | {name: 0.0}
    with pytest.raises(rumo.ArgumentError, match=f"{name}: got 0.0, expected a positive finite number"):
        speeds_within((0.0, 1.0), (0.0, 0.1), **limits)


@pytest.mark.parametrize(
    ("stations", "curvature", "message"),
    [
        ((0.0, 1.0), (0.0, np.nan), r"curvature: got \(0\.0, nan\), expected finite numbers \[1/m\]"),
        ((0.0, 1.0), (0.0, np.inf), r"curvature: got \(0\.0, inf\), expected finite numbers \[1/m\]"),
        ((0.0, 1.0), (0.0, 0.0, 0.0), r"curvature: got shape \(3,\), expected shape \(2,\), one at each station"),
        (((0.0, 1.0),), ((0.0, 0.0),), r"stations: got \(\(0\.0, 1\.0\),\), expected at least two arc lengths"),
        ((1.0, 0.0), (0.0, 0.1), r"stations: got \(1\.0, 0\.0\), expected at least two arc lengths \[m\], increasing"),
        ((0.0, np.nan), (0.0, 0.1), r"stations: got \(0\.0, nan\), expected at least two arc lengths"),
        ((), (), r"stations: got \(\), expected at least two arc lengths"),
        ("road", (0.0, 0.1), "stations: got 'road'"),
    ],
)
def test_speeds_along_no_road(stations, curvature, message):
    with pytest.raises(rumo.ArgumentError, match=message):
        speeds_within(stations, curvature, lateral=8.0, braking=5.0, driving=3.0, top=25.0)
