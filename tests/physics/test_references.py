"""Sine path: on the path, at constant speed, along its tangent."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from rumo.references import Held, SinePath
from rumo.vehicles import PAPER_CAR

TIMES = np.linspace(0.0, 24.0, 2401)
PATHS = {
    "paper": SinePath(),
    "fast": SinePath(3.0, 50.0, 30.0),
    "steep": SinePath(20.0, 60.0, 8.0),
    "nearly_straight": SinePath(1e-9, 60.0, 8.0),
    "reverse": SinePath(3.0, 60.0, -8.0),
}
# Slope 2 pi a / w of the path where it crosses the axis: 3, 6 and 63.
EXTREMES = {
    "slope_3": SinePath(90.0 / np.pi, 60.0, 8.0),
    "slope_6": SinePath(10.0, 10.0, 8.0),
    "slope_63": SinePath(100.0, 10.0, 8.0),
}
every_path = pytest.mark.parametrize("path", [*PATHS.values(), *EXTREMES.values()], ids=[*PATHS, *EXTREMES])
usual_paths = pytest.mark.parametrize("path", PATHS.values(), ids=PATHS.keys())


def rate(path, name, t, step=5e-6):
    """Time derivative by central differences."""
    return (path(t + step)[name] - path(t - step)[name]) / (2.0 * step)


@pytest.mark.parametrize("path", [*PATHS.values(), *EXTREMES.values()], ids=[*PATHS, *EXTREMES])
def test_points_lie_on_the_sine(path):
    reference = path(TIMES)
    expected = path.amplitude * np.sin(2.0 * np.pi * reference["p_x"] / path.wavelength)
    # p_x is up to 700 m; its rounding, 1e-13 m, times the slope.
    np.testing.assert_allclose(reference["p_y"], expected, atol=1e-9 * path.amplitude)


@every_path
def test_speed_along_the_path_is_constant(path):
    speed = np.hypot(rate(path, "p_x", TIMES), rate(path, "p_y", TIMES))
    # Rounding of positions of 1e3 m over the step is 1e-8; the sharpest bend, of 2.5 cm, leaves 4e-7.
    np.testing.assert_allclose(speed, abs(path.speed), rtol=1e-6)
    np.testing.assert_array_equal(path(TIMES)["v_x"], path.speed)


@every_path
def test_distance_covered_is_the_arc_length(path):
    k = 2.0 * np.pi / path.wavelength
    ends = np.r_[0.0, path(TIMES)["p_x"]]
    lengths = [quad(lambda s: np.hypot(1.0, path.amplitude * k * np.cos(k * s)), *pair)[0] for pair in pairwise(ends)]
    # The intervals are a small part of a wavelength, where `quad` is exact to rounding.
    np.testing.assert_allclose(np.cumsum(lengths), path.speed * TIMES, rtol=1e-9, atol=1e-9)


@usual_paths
def test_heading_is_the_tangent(path):
    direction = np.arctan2(rate(path, "p_y", TIMES), rate(path, "p_x", TIMES))
    heading = path(TIMES)["psi"] if path.speed > 0.0 else path(TIMES)["psi"] + np.pi
    # Finite differences as above, 1e-8; angles are compared as points on the circle.
    np.testing.assert_allclose(np.exp(1j * heading), np.exp(1j * direction), atol=1e-6)


@usual_paths
def test_yaw_rate_is_the_derivative_of_the_heading(path):
    omega = path(TIMES)["omega"]
    np.testing.assert_allclose(rate(path, "psi", TIMES), omega, rtol=1e-6, atol=1e-6 * np.abs(omega).max())


@usual_paths
def test_one_time_gives_what_many_give(path):
    many = path(TIMES)
    for k in (0, 100, 2400):
        for name, values in path(TIMES[k : k + 1]).items():
            # Newton's method stops after the step that suits the worst of all times.
            np.testing.assert_allclose(values[0], many[name][k], rtol=1e-11, atol=1e-11)


def test_starts_at_the_origin():
    start = SinePath()(np.zeros(1))
    assert start["p_x"][0] == 0.0
    assert start["p_y"][0] == 0.0


def test_vehicle_rolls_along_the_path():
    path = SinePath(vehicle=PAPER_CAR)
    reference = path(TIMES)
    np.testing.assert_allclose(PAPER_CAR.r * reference["w_r"], reference["v_x"])
    front_speed = np.hypot(reference["v_x"], reference["v_y"] + PAPER_CAR.l_f * reference["omega"])
    np.testing.assert_allclose(PAPER_CAR.r * reference["w_f"], front_speed)
    # The rear axle doesn't slip sideways, and the front wheel points along its own velocity.
    np.testing.assert_allclose(reference["v_y"] - PAPER_CAR.l_r * reference["omega"], 0.0, atol=1e-12)
    front = reference["v_y"] + PAPER_CAR.l_f * reference["omega"]
    np.testing.assert_allclose(np.tan(reference["delta"]), front / reference["v_x"], atol=1e-12)


def test_constant_is_held():
    reference = Held({"p_x": 3, "v_x": -1.5})(TIMES)
    np.testing.assert_array_equal(reference["p_x"], np.full(2401, 3.0))
    np.testing.assert_array_equal(reference["v_x"], np.full(2401, -1.5))
